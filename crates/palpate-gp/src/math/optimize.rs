//! Common types of the optimisers, which maximise in a box, and a compass search.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Reason why an optimiser returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// Converged.
    Converged,
    /// The budget of evaluations is exhausted.
    Budget,
    /// Rounding errors prevented progress; the result is the best place found.
    Roundoff,
    /// The search could not start or was aborted; the result is the best place found.
    Failed,
}

/// Result of an optimiser.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// Best point found, inside the box.
    pub x: Vec<f64>,
    /// Value of the objective there.
    pub value: f64,
    /// Number of evaluations of the objective.
    pub evaluations: u32,
    /// Reason why it returned.
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

/// Maximises `f` within `bounds` by a few steps along the axes from `start`, for expensive
/// functions: compass search (Kolda, Lewis & Torczon 2003, SIAM Review 45, 385). Returns the best
/// place found, and the additional result of `f` there.
///
/// The first step is tried along `axis`; the step is halved from the first of `steps` to the last
/// whenever no axis improves. Uses at most `budget` evaluations, and one more if the last axis is
/// tried in both directions.
///
/// # Errors
/// The first error of `f`.
pub fn compass<T, E>(
    start: Vec<f64>,
    bounds: &[[f64; 2]],
    axis: usize,
    [mut step, shortest]: [f64; 2],
    budget: u32,
    mut f: impl FnMut(&[f64]) -> Result<(f64, T), E>,
) -> Result<(Optimum, T), E> {
    let (value, mut values) = f(&start)?;
    let mut best = Optimum { x: start, value, evaluations: 1, stop: Stop::Budget };
    // Number of consecutive axes without an improvement.
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
                (best.x, best.value, values, idle) = (x, value, new, 0);
                break;
            }
        }
        if idle == bounds.len() {
            (step, idle) = (step / 2.0, 0);
        }
    }
    Ok((best, values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::convert::Infallible;

    proptest! {
        /// The maximum of a concave paraboloid is found to within the shortest step, or the bound
        /// before it; no place is outside, and the additional result belongs to the place returned.
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
            let (found, values) = compass(start, &bounds, axis, [0.5, 1e-3], 10_000, bowl).unwrap();
            prop_assert_eq!(found.stop, Stop::Converged);
            prop_assert_eq!(&values, &found.x);
            prop_assert_eq!(found.evaluations, asked);
            for (x, top) in found.x.iter().zip(&top) {
                prop_assert!((x - top.clamp(-1.0, 1.0)).abs() <= 1e-3);
            }
        }

        /// The search evaluates at most one place more than the budget, and keeps the best.
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

        /// An error ends the search.
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
