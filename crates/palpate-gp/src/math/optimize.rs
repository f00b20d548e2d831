//! What optimisers have in common: they maximise in a box; and the simplest of them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Why an optimiser returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// No more was to be won.
    Converged,
    /// The budget of evaluations was spent.
    Budget,
    /// Rounding errors kept it from going on; what it returns is the best it saw.
    Roundoff,
    /// It could not begin or broke off; what it returns is the best it saw.
    Failed,
}

/// Where an optimiser ended.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// The best point seen, inside the box.
    pub x: Vec<f64>,
    /// The objective there.
    pub value: f64,
    /// How often the objective was evaluated.
    pub evaluations: u32,
    /// Why it returned.
    pub stop: Stop,
}

/// A box `lower ≤ x ≤ upper` in as many dimensions as the slices are long.
#[derive(Clone, Copy, Debug)]
pub struct Bounds<'a> {
    /// Smallest coordinates.
    pub lower: &'a [f64],
    /// Largest coordinates.
    pub upper: &'a [f64],
}

/// A few steps uphill along the axes from `start` to larger values of `f` within `bounds`, for
/// functions that cost too much for more: compass search (Kolda, Lewis & Torczon 2003, SIAM Review
/// 45, 385). Returns the best place asked for, and what else `f` told of it.
///
/// The first step is tried along `axis`; of the `steps` the first is halved where no axis leads
/// uphill, down to the last. `budget` places may be asked for, and one more where the last axis is
/// tried both ways.
///
/// # Errors
/// The first of `f`.
pub fn compass<T, E>(
    start: Vec<f64>,
    bounds: &[[f64; 2]],
    axis: usize,
    [mut step, shortest]: [f64; 2],
    budget: u32,
    mut f: impl FnMut(&[f64]) -> Result<(f64, T), E>,
) -> Result<(Optimum, T), E> {
    let (value, mut told) = f(&start)?;
    let mut best = Optimum { x: start, value, evaluations: 1, stop: Stop::Budget };
    // Axes in a row along which neither way led uphill.
    let mut idle = 0;
    for axis in (0..bounds.len()).cycle().skip(axis) {
        if step < shortest {
            best.stop = Stop::Converged;
            break;
        }
        if best.evaluations >= budget {
            break;
        }
        idle += 1;
        for way in [step, -step] {
            let mut x = best.x.clone();
            x[axis] = (x[axis] + way).clamp(bounds[axis][0], bounds[axis][1]);
            if x[axis] == best.x[axis] {
                continue;
            }
            let (value, new) = f(&x)?;
            best.evaluations += 1;
            if value > best.value {
                (best.x, best.value, told, idle) = (x, value, new, 0);
                break;
            }
        }
        if idle == bounds.len() {
            (step, idle) = (step / 2.0, 0);
        }
    }
    Ok((best, told))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::convert::Infallible;

    proptest! {
        /// The top of a bowl turned over is found to the shortest step, or the wall before it;
        /// never a place outside, and what was told is of the place that is returned.
        #[test]
        fn it_climbs_to_the_top_within_its_box(
            top in prop::array::uniform3(-2f64..2.0),
            start in prop::array::uniform3(-1f64..1.0),
            axis in 0usize..9,
        ) {
            let bounds = [[-1.0, 1.0]; 3];
            let mut asked = 0;
            let bowl = |x: &[f64]| {
                asked += 1;
                assert!(x.iter().all(|x| x.abs() <= 1.0));
                let away: f64 = x.iter().zip(&top).map(|(x, top)| (x - top).powi(2)).sum();
                Ok::<_, Infallible>((-away, x.to_vec()))
            };
            let start = start.to_vec();
            let (found, told) = compass(start, &bounds, axis, [0.5, 1e-3], 10_000, bowl).unwrap();
            prop_assert_eq!(found.stop, Stop::Converged);
            prop_assert_eq!(&told, &found.x);
            prop_assert_eq!(found.evaluations, asked);
            for (x, top) in found.x.iter().zip(&top) {
                prop_assert!((x - top.clamp(-1.0, 1.0)).abs() <= 1e-3);
            }
        }

        /// It asks for at most one place more than it may, and keeps the best of them.
        #[test]
        fn it_keeps_to_its_budget(budget in 1u32..20) {
            let mut best = f64::NEG_INFINITY;
            let hill = |x: &[f64]| {
                best = best.max(x[0] + x[1]);
                Ok::<_, Infallible>((x[0] + x[1], ()))
            };
            let bounds = [[0.0, 1e9]; 2];
            let (found, ()) = compass(vec![0.0; 2], &bounds, 1, [0.1, 1e-9], budget, hill).unwrap();
            prop_assert!(found.evaluations <= budget + 1);
            prop_assert_eq!(found.stop, Stop::Budget);
            prop_assert_eq!(found.value, best);
        }

        /// An error ends it.
        #[test]
        fn an_error_ends_it(at in 1u32..6) {
            let mut asked = 0;
            let f = |_: &[f64]| {
                asked += 1;
                if asked == at { Err(at) } else { Ok((f64::from(asked), ())) }
            };
            let found = compass(vec![0.0], &[[-9.0, 9.0]], 0, [1.0, 0.1], 100, f);
            prop_assert_eq!(found.unwrap_err(), at);
        }
    }
}
