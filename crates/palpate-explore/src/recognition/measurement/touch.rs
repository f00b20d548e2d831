//! Evidence of a touch for an object at a pose: residuals of contacts and of free space.
//!
//! Each number is a likelihood ratio: the density of what was measured if the object is at the
//! pose, over its density if the shape is unknown. For a contact at the distance r from the surface
//! and the angle θ between both normals, with the deviations σ and σₙ and the share ε of outliers,
//!
//! L = (1 − ε) s / (½ √(2π) σ) exp(−r²/2σ² − g²/2σ²) exp(−θ²/2σₙ²) / σₙ² + ε,
//!
//! where s is the range over which an unknown surface is uniform, half of unknown approaches miss,
//! and its normals are uniform over a hemisphere. g is the depth by which the hull would have met
//! the object before. For a miss L = 2 (1 − ε) exp(−g²/2σ²) + ε. A temperature τ adds to both
//! deviations, so that at a large one all poses are equal.

use super::likelihood::{LogLikelihood, NoiseModel, PointFit, Residual, Terms, inflation};
use crate::evidence::{Contact, End, FreeVolume, Outcome};
use crate::recognition::library::{Nearest, PlacedObject};
use crate::robot::Finger;
use crate::robot::sensor::GelPad;
use crate::task::any_orthogonal;
use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};
use palpate_geometry::sweep::Capsule;
use std::f64::consts::PI;

/// Lever at which a turn counts as much as a distance, m.
// heuristic: half the size of an object for a hand.
pub const LEVER_M: f64 = 0.03;

/// Probability of a miss on an approach to an unknown shape.
// heuristic: undecided.
const UNKNOWN_MISS: f64 = 0.5;

/// Number of a contact's standard deviations within which the hull's predicted contact is the same.
// heuristic: nearly all errors.
const NOISE_SDS: f64 = 3.0;

/// Largest number of further points of a touch.
const POINTS: usize = 24;

/// One point of a surface that a touch shows.
struct TouchedPoint {
    p_w: Point3<f64>,
    normal_w: Option<Vector3<f64>>,
    /// Deviation that its sensor states, m.
    sd_m: f64,
    /// Factor on all deviations.
    inflation: f64,
    /// Range over which it would be uniform on an unknown surface, m.
    range_m: f64,
}

/// Way of a hull that was found free.
struct FreeWay {
    /// Hull at its start.
    hull: Capsule,
    ahead_w: UnitVector3<f64>,
    length_m: f64,
}

/// Evidence of one touch.
pub struct TouchMeasurement {
    /// Way of the hull; `None` of a contact whose approach is not known.
    way: Option<FreeWay>,
    /// Depth by which the hull yields at contact, m.
    slack_m: f64,
    /// Points of contact; none for a miss.
    points: Vec<TouchedPoint>,
    /// Points of a pad's face at the end of the way.
    face_w: Vec<Point3<f64>>,
}

/// Residuals of a touch for an object at a pose.
#[derive(Clone, Debug, Default)]
pub struct TouchFit {
    /// Depth by which the hull would have met the object before it did, m, along the normal.
    depth: Residual,
    points: Vec<PointFit>,
}

impl TouchMeasurement {
    /// Returns the measurement of a touch, with a hull that yields by `slack_m` and may have a pad,
    /// in a region of the size `region_m`; `None` after an overload, and if nothing was seen.
    pub fn new(
        outcome: &Outcome,
        slack_m: f64,
        pad: Option<&GelPad>,
        region_m: f64,
    ) -> Option<Self> {
        let Some(free) = outcome.free() else {
            let points = points(outcome.points(), region_m);
            let is_seen = outcome.end != End::Overload && !points.is_empty();
            return is_seen.then_some(Self { way: None, slack_m, points, face_w: Vec::new() });
        };
        if free.end == End::Overload {
            return None;
        }
        let FreeVolume { finger, p_wt: end_w, ahead_w, .. } = free;
        // The hull starts outside of the region, and the tip ends where it was at contact.
        let length_m = free.way_m + before_m(finger);
        let hull = hull(finger, &free.r_wt, end_w - ahead_w.scale(length_m));
        let points = points(outcome.points(), free.approach_m);
        let x_wt = Isometry3::from_parts(end_w.coords.into(), free.r_wt);
        let face_w = pad.map(|pad| face_w(pad, &(x_wt * GelPad::x_tp(finger)))).unwrap_or_default();
        let way = Some(FreeWay { hull, ahead_w: *ahead_w, length_m });
        Some(Self { way, slack_m, points, face_w })
    }

    /// Returns the point of contact, in `W`, and its normal, if it is known; `None` for a miss.
    pub fn touched_w(&self) -> Option<(Point3<f64>, Option<Vector3<f64>>)> {
        self.points.first().map(|point| (point.p_w, point.normal_w))
    }

    /// Returns the residuals for an object at a pose.
    pub fn fit(&self, placed: &PlacedObject) -> TouchFit {
        let met = self.way.as_ref().and_then(|FreeWay { hull, ahead_w, length_m }| {
            let hit = placed.sweep(hull, ahead_w, length_m + hull.radius_m)?;
            let inside_m = length_m - hit.travel_m;
            Some((hit, hull.radius_m, inside_m, ahead_w))
        });
        let points: Vec<PointFit> = (self.points.iter())
            .map(|point| {
                let (distance, Nearest { q_w, face_w, .. }) =
                    Residual::of_point(placed, &point.p_w);
                // On an edge, the hull's normal lies between those of the faces; and near a thin
                // plate, a noisy contact is nearest to a face that the hull does not meet.
                let is_same = |p_w: &Point3<f64>, radius_m: f64| {
                    (p_w - q_w).norm() < 0.5 * radius_m + NOISE_SDS * point.sd_m
                };
                let normal_w = match &met {
                    Some((hit, radius_m, ..)) if is_same(&hit.p_w, *radius_m) => hit.normal_w,
                    _ => face_w,
                };
                let turn = point.normal_w.map(|to_w| (turn_between(&normal_w, &to_w), normal_w));
                PointFit { distance, turn }
            })
            .collect();
        let of_hull =
            met.filter(|(_, _, inside_m, _)| *inside_m > 0.0).map(|(hit, _, inside_m, ahead_w)| {
                // The turn of the normal is left out of the slope: it only counts deep inside.
                let facing = (-hit.normal_w.dot(ahead_w)).max(0.0);
                Residual::along(inside_m * facing, &hit.normal_w, &hit.p_w, placed.x_wo)
            });
        let of_face = self.face_w.iter().filter_map(|p_w| {
            let Nearest { q_w, face_w, distance_m } = placed.nearest(p_w);
            let inside = || Residual::along(-distance_m, &face_w, &q_w, placed.x_wo);
            (distance_m < 0.0).then(inside)
        });
        let deepest =
            of_hull.into_iter().chain(of_face).max_by(|a, b| a.value_m.total_cmp(&b.value_m));
        let depth = deepest.map(|mut depth| {
            // A contact that is inside of the object is that depth already.
            let inside = points.first().map(|point| &point.distance).filter(|it| it.value_m < 0.0);
            if let Some(inside) = inside {
                depth.value_m += inside.value_m;
                depth.slope += inside.slope;
            }
            depth.value_m -= self.slack_m;
            (depth.value_m > 0.0).then_some(depth)
        });
        TouchFit { depth: depth.flatten().unwrap_or_default(), points }
    }

    /// Adds the log-likelihood ratio of residuals at the temperature `tau_m`.
    pub fn add(&self, fit: &TouchFit, noise: &NoiseModel, tau_m: f64, to: &mut LogLikelihood) {
        let sd_m = noise.contact_sd_m.hypot(tau_m);
        if self.points.is_empty() {
            let mut terms = Terms::default();
            terms.add(&fit.depth, sd_m);
            let inlier = (1.0 - noise.outliers) * (-terms.half_squares).exp() / UNKNOWN_MISS;
            return to.add(inlier, noise.outliers, &terms);
        }
        for (i, (point, fitted)) in self.points.iter().zip(&fit.points).enumerate() {
            let mut terms = Terms::default();
            let sd_m = sd_m.hypot(point.sd_m) * point.inflation;
            terms.add(&fitted.distance, sd_m);
            let mut density = point.range_m / (sd_m * (2.0 * PI).sqrt());
            if i == 0 {
                terms.add(&fit.depth, sd_m);
                density /= 1.0 - UNKNOWN_MISS;
            }
            if let Some((turn, normal_w)) = &fitted.turn {
                let sd_rad = noise.normal_sd_rad.hypot(tau_m / LEVER_M) * point.inflation;
                terms.add_turn(turn, normal_w, sd_rad);
                density /= sd_rad * sd_rad;
            }
            let inlier = (1.0 - noise.outliers) * density * (-terms.half_squares).exp();
            to.add(inlier, noise.outliers, &terms);
        }
    }
}

/// Distance before the nearest point of an approach at which a hull is outside of the region.
pub fn before_m(finger: &Finger) -> f64 {
    finger.radius_m + finger.length_m
}

/// Returns the hull of a finger with this attitude and its tip at `p_wt`.
pub fn hull(finger: &Finger, r_wt: &UnitQuaternion<f64>, p_wt: Point3<f64>) -> Capsule {
    let axis_w = r_wt * Vector3::x() * -finger.length_m;
    Capsule { p0_w: p_wt, p1_w: p_wt + axis_w, radius_m: finger.radius_m }
}

/// Returns the rotation vector from one unit vector to another, rad.
pub(super) fn turn_between(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    match UnitQuaternion::rotation_between(from, to) {
        Some(turn) => turn.scaled_axis(),
        // Opposite vectors: about any axis across.
        None => any_orthogonal(&UnitVector3::new_normalize(*from)) * PI,
    }
}

/// Number of points along each side of a pad's face.
// heuristic: a few millimetres apart on a usual pad.
const FACE: usize = 4;

/// Returns points spread over the face of a pad at the pose `x_wp`.
fn face_w(pad: &GelPad, x_wp: &Isometry3<f64>) -> Vec<Point3<f64>> {
    let point = |i: usize| {
        let pixels = [FACE; 2];
        let [x, y] = pad.pixel_m(pixels, i);
        x_wp * Point3::new(x, y, pad.surface_m([x, y]))
    };
    (0..FACE * FACE).map(point).collect()
}

/// Returns the points of contact, thinned.
fn points(contacts: &[Contact], whole_m: f64) -> Vec<TouchedPoint> {
    let Some((contact, further)) = contacts.split_first() else { return Vec::new() };
    let step = further.len().div_ceil(POINTS).max(1);
    let count = further.len().div_ceil(step);
    let inflation = inflation(count);
    let point = |point: &Contact, inflation: f64, range_m: f64| TouchedPoint {
        p_w: point.p_wc,
        normal_w: point.has_normal.then_some(point.normal_w),
        sd_m: point.sd_m().unwrap_or(0.0),
        inflation,
        range_m,
    };
    let first = point(contact, 1.0, whole_m);
    // Between the faces of an edge a patch has normals of neither, so that only places count.
    let others = further.iter().step_by(step).map(|further| {
        // An unknown surface may rise or fall by as much as the point is away.
        let range_m = 2.0 * (further.p_wc - contact.p_wc).norm().max(1e-4);
        TouchedPoint { normal_w: None, ..point(further, inflation, range_m) }
    });
    std::iter::once(first).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::Evidence;
    use crate::recognition::library::LibraryObject;
    use crate::recognition::pose_prior::moved;
    use crate::task::{Aim, Ball};
    use nalgebra::Vector6;
    use palpate_geometry::mesh::Mesh;
    use palpate_geometry::solids::sphere_mesh;
    use proptest::prelude::*;

    fn ellipsoid() -> LibraryObject {
        let (vertices, triangles) = sphere_mesh(Point3::origin(), 1.0, 24);
        let stretched: Vec<_> =
            vertices.iter().map(|p| Point3::new(0.05 * p.x, 0.03 * p.y, 0.04 * p.z)).collect();
        LibraryObject::new("ellipsoid", &Mesh::new(&stretched, &triangles).unwrap().0)
    }

    const NOISE: NoiseModel = NoiseModel { contact_sd_m: 1e-3, normal_sd_rad: 0.3, outliers: 1e-3 };

    /// A touch at `p_w` from a direction, with the tip where it rests if `is_contact`.
    fn touch(p_w: [f64; 3], from: [f64; 3], is_contact: bool) -> TouchMeasurement {
        let ball = Ball { centre_w: Point3::origin(), radius_m: 0.1, lowest_m: None };
        let finger = Finger { pitch_deg: 0.0, ..Finger::default() };
        let aim = Aim::against(p_w.into(), &from.into());
        let approach = ball.approach(&aim, &finger, 0.01, 0.0);
        let normal_w = -approach.direction_w().into_inner();
        let p_wt = aim.p_w + normal_w * finger.radius_m;
        // The normal of a hull on the facets of a mesh has no derivative.
        let contact = Contact { has_normal: false, ..Contact::new(aim.p_w, normal_w) };
        let end = if is_contact { End::Contact } else { End::Miss };
        let free = FreeVolume::new(finger, &approach, p_wt, end);
        let points = is_contact.then(|| Evidence::Points(contact.into()));
        let evidence = points.into_iter().chain([Evidence::Free(free)]).collect();
        TouchMeasurement::new(&Outcome::new(end, evidence), 0.0, None, 0.1).unwrap()
    }

    /// The angle between normals is that of the rotation, for opposite ones too.
    #[test]
    fn opposite_normals_are_half_a_turn_apart() {
        let (x, y) = (Vector3::x(), Vector3::y());
        for (to, expected_rad) in [(x, 0.0), (y, PI / 2.0), (-x, PI)] {
            assert!((turn_between(&x, &to).norm() - expected_rad).abs() < 1e-9, "{to}");
        }
    }

    proptest! {
        /// The gradient is the derivative of the value where the object's face stays the same, and
        /// the information is positive. Inside of the object the gradient is approximate, because
        /// it leaves out the turn of the normal.
        #[test]
        fn the_gradient_is_the_derivative(
            from in prop::array::uniform3(-1f64..1.0),
            share in 0.7f64..1.3,
            offset in prop::array::uniform3(-0.003f64..0.003),
            axis in 0usize..6,
            tau_m in 1e-3f64..0.02,
        ) {
            let outward = Vector3::from(from);
            prop_assume!(outward.norm() > 0.3);
            let object = ellipsoid();
            let radii = Vector3::new(0.05, 0.03, 0.04);
            let at = outward.normalize().component_mul(&radii) * share;
            let evidence = touch(at.into(), from, true);
            let x_wo = Isometry3::from(Vector3::from(offset));
            let log = |by_m: f64| {
                let mut sum = LogLikelihood::zero();
                let mut by = Vector6::zeros();
                by[axis] = by_m;
                let fit = evidence.fit(&PlacedObject::exact(&object, &moved(&x_wo, &by)));
                evidence.add(&fit, &NOISE, tau_m, &mut sum);
                sum
            };
            let step_m = 1e-6;
            let [back, here, ahead] = [-step_m, 0.0, step_m].map(log);
            let slopes = [here.value - back.value, ahead.value - here.value].map(|x| x / step_m);
            // At the border of two triangles it has a kink.
            let scale = here.information[(axis, axis)].sqrt() + 1.0;
            prop_assume!((slopes[1] - slopes[0]).abs() < 0.02 * scale);
            let error = here.gradient[axis] - 0.5 * (slopes[0] + slopes[1]);
            prop_assert!(share < 1.1 || error.abs() < 0.015 * scale, "{error} of {} at {scale}", here.gradient[axis]);
            prop_assert!(here.information.symmetric_eigenvalues().min() > -1e-6 * scale * scale);
        }

        /// Wherever a touch ends, ratios are finite, and at a large temperature all poses are
        /// equal.
        #[test]
        fn ratios_are_finite_anywhere(
            p_w in prop::array::uniform3(-0.1f64..0.1),
            from in prop::array::uniform3(-1f64..1.0),
            offset in prop::array::uniform3(-0.05f64..0.05),
            is_contact: bool,
        ) {
            prop_assume!(Vector3::from(from).norm() > 0.01);
            let (object, evidence) = (ellipsoid(), touch(p_w, from, is_contact));
            let x_wo = Isometry3::from(Vector3::from(offset));
            let fits = [x_wo, Isometry3::identity()].map(|x_wo| evidence.fit(&PlacedObject::exact(&object, &x_wo)));
            for tau_m in [0.0, 1e-3, 1e3] {
                let values = fits.each_ref().map(|fit| {
                    let mut sum = LogLikelihood::zero();
                    evidence.add(fit, &NOISE, tau_m, &mut sum);
                    sum.value
                });
                prop_assert!(values.iter().all(|value| value.is_finite()), "{values:?}");
                prop_assert!(tau_m < 1.0 || (values[0] - values[1]).abs() < 1e-3, "{values:?}");
            }
        }
    }
}
