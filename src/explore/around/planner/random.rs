//! Uniformly random directions at the ball's centre: the baseline without a model.

use super::plan::{Planner, decided};
use crate::explore::around::belief::Belief;
use crate::explore::around::scope::Scope;
use crate::explore::plan::Plan;
use crate::task::{Aim, Ball};
use nalgebra::{Point3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Asks for random directions.
pub struct Random {
    rng: ChaCha8Rng,
}

impl Random {
    /// Whose only randomness is `rng`.
    pub fn new(rng: ChaCha8Rng) -> Self {
        Self { rng }
    }
}

impl Planner for Random {
    fn plan(&mut self, belief: &Belief) -> Plan {
        decided(&anywhere(belief.scope(), &mut self.rng), None)
    }
}

/// Sides that are tried before one is asked for that cannot be reached, which ends the trial;
/// chosen.
const TRIED: usize = 1000;

/// From a uniformly random side at the ball's centre, of those that can be reached.
pub fn anywhere(scope: &Scope, rng: &mut ChaCha8Rng) -> Aim {
    reached(scope, || [rng.random(), rng.random()])
}

/// A uniformly random point of a ball.
pub(super) fn in_ball(ball: &Ball, rng: &mut ChaCha8Rng) -> Point3<f64> {
    let [u, v, w]: [f64; 3] = rng.random();
    let outward_w = side([u, v]);
    ball.centre_w + outward_w * (ball.radius_m * w.cbrt())
}

/// From the first side, as [`from_side`] takes one, that can be reached.
pub(super) fn reached(scope: &Scope, mut side: impl FnMut() -> [f64; 2]) -> Aim {
    let mut next = || from_side(&scope.ball, side());
    let first = next();
    std::iter::once(first)
        .chain(std::iter::repeat_with(next).take(TRIED))
        .find(|aim| scope.reaches(aim))
        .unwrap_or(first)
}

/// From the side of the sphere that a place of the unit square stands for, at the ball's centre;
/// equal areas are equal areas: z = 1 − 2u at the longitude 2πv.
fn from_side(ball: &Ball, at: [f64; 2]) -> Aim {
    Aim::against(ball.centre_w, &side(at))
}

/// The unit vector of a side.
fn side([u, v]: [f64; 2]) -> Vector3<f64> {
    let up = 1.0 - 2.0 * u;
    let beside = (1.0 - up * up).max(0.0).sqrt();
    let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
    Vector3::new(beside * cosine, beside * sine, up)
}
