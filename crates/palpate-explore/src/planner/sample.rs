//! Sampling of targets without a model: points of the unit square, mapped to the zone or object.

use crate::belief::SurfaceBelief;
use crate::task::{Aim, Ball, Region, Target, Zone};
use nalgebra::{Point3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Returns a uniformly random place of the zone.
pub fn uniform(zone: &Zone, rng: &mut ChaCha8Rng) -> Vec<f64> {
    zone.at(&fractions(zone.dimension(), rng))
}

/// Returns a uniformly random target: a place of a zone, or an aim from a random direction at the
/// ball's centre.
pub fn random_target(belief: &dyn SurfaceBelief, rng: &mut ChaCha8Rng) -> Target {
    target_from_fractions(belief, |count| fractions(count, rng))
}

fn fractions(count: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..count).map(|_| rng.random()).collect()
}

/// Returns the target at the fractions in 0..1 returned by `next`, whose argument is the number of
/// fractions, one or two. For a whole object, they encode a direction, and `next` is called until
/// one is reachable.
pub fn target_from_fractions(
    belief: &dyn SurfaceBelief,
    mut next: impl FnMut(usize) -> Vec<f64>,
) -> Target {
    match belief.region() {
        Region::Zone(zone) => zone.at(&next(zone.dimension())).into(),
        Region::Ball(ball) => reached(belief, &ball, || next(2)).into(),
    }
}

/// Number of directions tried before an unreachable one is returned, which ends the trial.
// heuristic: the chance to miss a reachable thousandth of the sphere is 1/e.
const TRIED: usize = 1000;

/// Returns a uniformly random point of a ball.
pub(super) fn in_ball(ball: &Ball, rng: &mut ChaCha8Rng) -> Point3<f64> {
    let [u, v, w]: [f64; 3] = rng.random();
    let outward_w = outward(&[u, v]);
    ball.centre_w + outward_w * (ball.radius_m * w.cbrt())
}

/// Returns an aim at the ball's centre from the first reachable direction.
fn reached(belief: &dyn SurfaceBelief, ball: &Ball, mut side: impl FnMut() -> Vec<f64>) -> Aim {
    let mut next = || Aim::against(ball.centre_w, &outward(&side()));
    let first = next();
    std::iter::once(first)
        .chain(std::iter::repeat_with(next).take(TRIED))
        .find(|aim| belief.reaches(&Target::from(*aim)))
        .unwrap_or(first)
}

/// Maps a point of the unit square to a unit vector on the sphere. The map preserves areas: z = 1 −
/// 2u at the longitude 2πv.
fn outward(at: &[f64]) -> Vector3<f64> {
    let [u, v] = [0, 1].map(|i| at.get(i).copied().unwrap_or(0.5));
    let up = 1.0 - 2.0 * u;
    let beside = (1.0 - up * up).max(0.0).sqrt();
    let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
    Vector3::new(beside * cosine, beside * sine, up)
}
