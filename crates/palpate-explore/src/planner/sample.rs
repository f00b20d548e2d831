//! Targets without a model: places of the unit square, carried over to what is explored.

use crate::around::Scope;
use crate::belief::Belief;
use crate::task::{Aim, Ball, Target, Zone};
use nalgebra::{Point3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A uniformly random place of the zone.
pub fn uniform(zone: &Zone, rng: &mut ChaCha8Rng) -> Vec<f64> {
    zone.at(&fractions(zone.dimension(), rng))
}

/// A uniformly random target: a place of a zone, or a side of the ball from which the finger goes
/// at its centre.
pub fn anywhere(belief: &Belief, rng: &mut ChaCha8Rng) -> Target {
    sampled(belief, |count| fractions(count, rng))
}

fn fractions(count: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..count).map(|_| rng.random()).collect()
}

/// The target at the fractions 0..1 that `next` returns, of which it is asked for one or two.
/// Around an object they stand for a side, and more are asked for until one can be reached.
pub fn sampled(belief: &Belief, mut next: impl FnMut(usize) -> Vec<f64>) -> Target {
    match belief {
        Belief::HeightField(field) => field.zone().at(&next(field.zone().dimension())).into(),
        Belief::ImplicitSurface(surface) => reached(surface.scope(), || next(2)).into(),
    }
}

/// Sides that are tried before one is asked for that cannot be reached, which ends the trial.
// heuristic: a thousandth of the sphere is missed by one in e of so many.
const TRIED: usize = 1000;

/// From a uniformly random side at the ball's centre, of those that can be reached.
pub fn any_side(scope: &Scope, rng: &mut ChaCha8Rng) -> Aim {
    reached(scope, || fractions(2, rng))
}

/// A uniformly random point of a ball.
pub(super) fn in_ball(ball: &Ball, rng: &mut ChaCha8Rng) -> Point3<f64> {
    let [u, v, w]: [f64; 3] = rng.random();
    let outward_w = outward(&[u, v]);
    ball.centre_w + outward_w * (ball.radius_m * w.cbrt())
}

/// From the first of the sides at the ball's centre that can be reached.
fn reached(scope: &Scope, mut side: impl FnMut() -> Vec<f64>) -> Aim {
    let mut next = || Aim::against(scope.ball.centre_w, &outward(&side()));
    let first = next();
    std::iter::once(first)
        .chain(std::iter::repeat_with(next).take(TRIED))
        .find(|aim| scope.reaches(aim))
        .unwrap_or(first)
}

/// The unit vector of the side of a sphere at a place of the unit square. The map keeps areas:
/// z = 1 − 2u at the longitude 2πv.
fn outward(at: &[f64]) -> Vector3<f64> {
    let [u, v] = [0, 1].map(|i| at.get(i).copied().unwrap_or(0.5));
    let up = 1.0 - 2.0 * u;
    let beside = (1.0 - up * up).max(0.0).sqrt();
    let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
    Vector3::new(beside * cosine, beside * sine, up)
}
