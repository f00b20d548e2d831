//! Whether the finger can go straight at a place of the believed surface.

use crate::explore::around::ImplicitSurface;
use crate::explore::around::surface::SurfaceField;
use crate::task::Aim;
use nalgebra::{Point3, UnitVector3, Vector3};

/// Room that the believed surface must leave around the way, and the way's first and later steps,
/// in radii of the fingertip; chosen.
const ROOM: f64 = 0.7;
const FIRST: f64 = 1.5;
const STEP: f64 = 0.7;

/// How far ways are tilted sideways from the normal, as a tangent; chosen, 35°.
const TILT: f64 = 0.7;

/// Least cosine between way and normal; chosen.
const SLANT: f64 = 0.3;

/// Aims this near to an earlier one bring nothing new: distance in radii of the fingertip, and
/// cosine of the directions. Chosen.
const NEAR: f64 = 0.25;
const ALONG: f64 = 0.97;

/// An aim at `p_w` of the believed surface with the outward normal `normal_w`, along whose way the
/// belief leaves room for the fingertip: against the normal if it can be, or from another side.
/// None if there is none that was not asked for before.
pub fn free_aim(
    belief: &ImplicitSurface,
    surface: &mut SurfaceField,
    (p_w, normal_w): (&Point3<f64>, &UnitVector3<f64>),
) -> Option<Aim> {
    let ball = &belief.scope().ball;
    let outward_w = (p_w - ball.centre_w).try_normalize(1e-12).unwrap_or(**normal_w);
    let beside_w = any_orthogonal(normal_w);
    let across_w = normal_w.cross(&beside_w);
    let ways = [
        **normal_w,
        **normal_w + outward_w,
        **normal_w + beside_w * TILT,
        **normal_w - beside_w * TILT,
        **normal_w + across_w * TILT,
        **normal_w - across_w * TILT,
    ];
    let upright = ways.iter().filter_map(|way_w| UnitVector3::try_new(*way_w, 1e-6));
    upright
        .filter(|way_w| way_w.dot(normal_w) >= SLANT)
        .map(|way_w| Aim { p_w: *p_w, ahead_w: -way_w })
        .find(|aim| {
            ball.contains(aim)
                && is_new(belief, aim)
                && has_room(belief, surface, aim)
                && belief.scope().reaches(aim)
        })
}

/// A unit vector square to another.
fn any_orthogonal(to: &UnitVector3<f64>) -> Vector3<f64> {
    let axis = if to.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    to.cross(&axis).normalize()
}

fn is_new(belief: &ImplicitSurface, aim: &Aim) -> bool {
    let near_m = NEAR * belief.scope().radius_m;
    belief.asked().iter().all(|asked| {
        (asked.p_w - aim.p_w).norm() > near_m || asked.ahead_w.dot(&aim.ahead_w) < ALONG
    })
}

/// Whether the belief leaves the fingertip room along the way of `aim` outside the object.
pub(super) fn has_room(belief: &ImplicitSurface, surface: &mut SurfaceField, aim: &Aim) -> bool {
    let (ball, radius_m) = (&belief.scope().ball, belief.scope().radius_m);
    let back = |radii: f64| aim.p_w - aim.ahead_w.scale(radii * radius_m);
    let mut radii = FIRST;
    while (back(radii) - ball.centre_w).norm() < ball.radius_m {
        if surface.value(&back(radii)) < ROOM * radius_m {
            return false;
        }
        radii += STEP;
    }
    true
}
