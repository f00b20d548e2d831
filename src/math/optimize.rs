//! Maximisation in a box: DIRECT finds the hill, L-BFGS climbs it (NLopt).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Whether this build has optimisers (feature `nlopt`). Without them [`direct`] and [`lbfgs`]
/// return where they began, with [`Stop::Failed`].
pub const BUILT: bool = cfg!(feature = "nlopt");

/// Why an optimiser returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// The value or the argument no longer changed.
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

/// Maximises `objective` globally by dividing rectangles (Jones, Perttunen & Stuckman 1993).
///
/// Deterministic. Stops after `max_evaluations`.
pub fn direct(
    bounds: Bounds,
    max_evaluations: u32,
    mut objective: impl FnMut(&[f64]) -> f64,
) -> Optimum {
    let middle: Vec<f64> =
        bounds.lower.iter().zip(bounds.upper).map(|(lower, upper)| 0.5 * (lower + upper)).collect();
    run(Method::Direct, bounds, &middle, max_evaluations, &mut |x, _| objective(x))
}

/// Maximises `objective` from `start` by limited-memory BFGS within the box.
///
/// The objective writes its gradient into its second argument. A non-finite value counts as
/// the worst possible.
pub fn lbfgs(
    bounds: Bounds,
    start: &[f64],
    max_evaluations: u32,
    mut objective: impl FnMut(&[f64], &mut [f64]) -> f64,
) -> Optimum {
    run(Method::Lbfgs, bounds, start, max_evaluations, &mut |x, gradient| {
        objective(x, gradient.unwrap_or(&mut []))
    })
}

#[derive(Clone, Copy, PartialEq)]
enum Method {
    Direct,
    Lbfgs,
}

type Objective<'a> = dyn FnMut(&[f64], Option<&mut [f64]>) -> f64 + 'a;

/// The objective and the best it returned so far: an optimiser may end on a worse point.
#[cfg_attr(not(feature = "nlopt"), allow(dead_code))]
struct TrackedObjective<'a, 'b> {
    objective: &'a mut Objective<'b>,
    best: Optimum,
}

fn run(
    method: Method,
    bounds: Bounds,
    start: &[f64],
    max_evaluations: u32,
    objective: &mut Objective,
) -> Optimum {
    let mut x = start.to_vec();
    for ((x, lower), upper) in x.iter_mut().zip(bounds.lower).zip(bounds.upper) {
        *x = x.max(*lower).min(*upper);
    }
    let best =
        Optimum { x: x.clone(), value: f64::NEG_INFINITY, evaluations: 0, stop: Stop::Failed };
    engine::run(method, bounds, x, max_evaluations, TrackedObjective { objective, best })
}

#[cfg(not(feature = "nlopt"))]
mod engine {
    use super::{Bounds, Method, Optimum, TrackedObjective};

    pub(super) fn run(
        _: Method,
        _: Bounds,
        _: Vec<f64>,
        _: u32,
        tracked: TrackedObjective,
    ) -> Optimum {
        tracked.best
    }
}

#[cfg(feature = "nlopt")]
mod engine {
    use super::{Bounds, Method, Optimum, Stop, TrackedObjective};
    use nlopt::{Algorithm, FailState, Nlopt, SuccessState, Target};

    /// Relative change of the value below which L-BFGS counts as converged; chosen well above
    /// rounding, far below what changes a plan.
    const VALUE_TOLERANCE: f64 = 1e-8;

    fn evaluate(
        x: &[f64],
        mut gradient: Option<&mut [f64]>,
        tracked: &mut TrackedObjective,
    ) -> f64 {
        let mut value = (tracked.objective)(x, gradient.as_deref_mut());
        if !value.is_finite() {
            value = f64::MIN;
            gradient.into_iter().flatten().for_each(|slope| *slope = 0.0);
        }
        tracked.best.evaluations += 1;
        if value > tracked.best.value {
            tracked.best.value = value;
            tracked.best.x.copy_from_slice(x);
        }
        value
    }

    pub(super) fn run(
        method: Method,
        bounds: Bounds,
        mut x: Vec<f64>,
        max_evaluations: u32,
        tracked: TrackedObjective,
    ) -> Optimum {
        let (algorithm, tolerance) = match method {
            Method::Direct => (Algorithm::Direct, 0.0),
            Method::Lbfgs => (Algorithm::Lbfgs, VALUE_TOLERANCE),
        };
        let mut nlopt = Nlopt::new(algorithm, x.len(), evaluate, Target::Maximize, tracked);
        let outcome = nlopt
            .set_lower_bounds(bounds.lower)
            .and_then(|_| nlopt.set_upper_bounds(bounds.upper))
            .and_then(|_| nlopt.set_maxeval(max_evaluations))
            .and_then(|_| nlopt.set_ftol_rel(tolerance))
            .and_then(|_| nlopt.optimize(&mut x).map_err(|(fail, _)| fail).map(|(end, _)| end));
        let best = nlopt.recover_user_data().best;
        let stop = match outcome {
            Ok(SuccessState::MaxEvalReached) => Stop::Budget,
            Ok(_) => Stop::Converged,
            Err(FailState::RoundoffLimited) => Stop::Roundoff,
            // A line search that finds no step uphill: at a top, where only rounding is left.
            Err(FailState::Failure) if best.value > f64::MIN => Stop::Roundoff,
            Err(_) => Stop::Failed,
        };
        Optimum { stop, ..best }
    }
}

#[cfg(all(test, feature = "nlopt"))]
mod tests {
    use super::*;

    const BOX: Bounds = Bounds { lower: &[-2.0, -2.0], upper: &[2.0, 2.0] };

    fn rosenbrock(x: &[f64], gradient: &mut [f64]) -> f64 {
        let [a, b] = [x[0], x[1]];
        gradient[0] = 2.0 * (1.0 - a) + 400.0 * a * (b - a * a);
        gradient[1] = -200.0 * (b - a * a);
        -((1.0 - a).powi(2) + 100.0 * (b - a * a).powi(2))
    }

    #[test]
    fn lbfgs_climbs_rosenbrocks_valley() {
        let optimum = lbfgs(BOX, &[-1.2, 1.0], 200, rosenbrock);
        assert!(optimum.value > -1e-8, "{optimum:?}");
        assert!(optimum.evaluations < 100, "{optimum:?}");
    }

    #[test]
    fn lbfgs_stays_in_the_box() {
        let optimum = lbfgs(BOX, &[0.0, 0.0], 100, |x, gradient| {
            gradient.fill(1.0);
            x[0] + x[1]
        });
        assert_eq!(optimum.x, [2.0, 2.0]);
    }

    #[test]
    fn direct_finds_the_higher_of_two_hills() {
        let hills = |x: &[f64]| {
            let hill = |a: f64, b: f64| (-8.0 * ((x[0] - a).powi(2) + (x[1] - b).powi(2))).exp();
            hill(-1.3, 0.4) + 1.2 * hill(1.1, -1.6)
        };
        let optimum = direct(BOX, 400, hills);
        assert!((optimum.x[0] - 1.1).abs() < 0.05, "{optimum:?}");
        assert!((optimum.x[1] + 1.6).abs() < 0.05, "{optimum:?}");
        assert_eq!(optimum.stop, Stop::Budget);
    }

    #[test]
    fn a_value_that_is_not_finite_is_never_the_optimum() {
        let optimum = direct(BOX, 100, |x| if x[0] > 0.0 { f64::NAN } else { x[0] });
        assert!(optimum.x[0] <= 0.0 && optimum.value.is_finite());
    }
}
