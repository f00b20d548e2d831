//! A few steps uphill along the axes, for functions that cost too much for more: compass search
//! (Kolda, Lewis & Torczon 2003, SIAM Review 45, 385).

use super::optimize::Stop;

/// How a search goes.
#[derive(Clone, Copy, Debug)]
pub struct Compass {
    /// The axis along which the first step is tried.
    pub axis: usize,
    /// The first step, halved where no axis leads uphill, and the shortest.
    pub steps: [f64; 2],
    /// Places that may be asked for; one more where the last axis is tried both ways.
    pub budget: u32,
}

/// Where a search ended.
#[derive(Clone, Debug)]
pub struct Ascent<T> {
    /// The best place asked for, inside the box.
    pub x: Vec<f64>,
    /// The value there.
    pub value: f64,
    /// What else was told of it.
    pub told: T,
    /// How many places were asked for.
    pub evaluations: u32,
    /// Why it ended.
    pub stop: Stop,
}

impl Compass {
    /// From `start` to larger values of `f` within `bounds`, one axis after the other.
    ///
    /// # Errors
    /// The first of `f`.
    pub fn climb<T, E>(
        self,
        start: Vec<f64>,
        bounds: &[[f64; 2]],
        mut f: impl FnMut(&[f64]) -> Result<(f64, T), E>,
    ) -> Result<Ascent<T>, E> {
        let Self { axis, steps: [mut step, shortest], budget } = self;
        let (value, told) = f(&start)?;
        let mut best = Ascent { x: start, value, told, evaluations: 1, stop: Stop::Budget };
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
            idle = if best.try_along(axis, step, bounds[axis], &mut f)? { 0 } else { idle + 1 };
            if idle == bounds.len() {
                (step, idle) = (step / 2.0, 0);
            }
        }
        Ok(best)
    }
}

impl<T> Ascent<T> {
    /// Moves up or else down an axis if that leads uphill; whether it did.
    fn try_along<E>(
        &mut self,
        axis: usize,
        step: f64,
        [low, high]: [f64; 2],
        f: &mut impl FnMut(&[f64]) -> Result<(f64, T), E>,
    ) -> Result<bool, E> {
        for way in [step, -step] {
            let mut x = self.x.clone();
            x[axis] = (x[axis] + way).clamp(low, high);
            if x[axis] == self.x[axis] {
                continue;
            }
            let (value, told) = f(&x)?;
            self.evaluations += 1;
            if value > self.value {
                (self.x, self.value, self.told) = (x, value, told);
                return Ok(true);
            }
        }
        Ok(false)
    }
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
            let compass = Compass { axis, steps: [0.5, 1e-3], budget: 10_000 };
            let found = compass.climb(start.to_vec(), &bounds, bowl).unwrap();
            prop_assert_eq!(found.stop, Stop::Converged);
            prop_assert_eq!(&found.told, &found.x);
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
            let compass = Compass { axis: 1, steps: [0.1, 1e-9], budget };
            let found = compass.climb(vec![0.0; 2], &[[0.0, 1e9]; 2], hill).unwrap();
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
            let compass = Compass { axis: 0, steps: [1.0, 0.1], budget: 100 };
            prop_assert_eq!(compass.climb(vec![0.0], &[[-9.0, 9.0]], f).unwrap_err(), at);
        }
    }
}
