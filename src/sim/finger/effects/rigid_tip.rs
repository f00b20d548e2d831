//! Rigid tip on a spring: a ball or rod that does not yield, on a sensor and an arm that do.

use super::constants::effect;
use super::effect::{Effect, EffectSwitch, Requirement};
use crate::sim::finger::load::{ContactLoad, PressError};
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_explore::robot::finger::Finger;
use palpate_geometry::bvh::MeshBvh;

effect! {
    /// Table `[rigid_tip]`: the finger's hull as a rigid body; instead of a `[skin]`.
    RigidTipEffect in "rigid_tip"
    constants {
        /// Stiffness of what carries the tip.
        stiffness_n_m: f64, 1.0..=1e9;
    }
}

impl Effect for RigidTipEffect {
    type State = ();

    const REQUIRES: Requirement = Requirement::Nothing;

    fn switches() -> Vec<EffectSwitch<Option<Self>>> {
        Vec::new()
    }
}

// heuristic: places along the axis at which the distance is evaluated first, per radius.
const PER_RADIUS: f64 = 2.0;

// heuristic: steps of the golden section between two of these places, to a nanometre.
const STEPS: usize = 36;

impl RigidTipEffect {
    /// Returns the load of an object in `W` on the tip of `finger` at `x_wt`: F = k d, for the
    /// depth d of the hull in the object at the point of the axis that is nearest to the object.
    ///
    /// # Errors
    /// If the pose is not finite, or the object encloses the nearest point of the axis.
    pub fn press(
        &self,
        finger: &Finger,
        object: &MeshBvh,
        x_wt: &Isometry3<f64>,
    ) -> Result<ContactLoad, PressError> {
        let numbers = x_wt.translation.vector.iter().chain(x_wt.rotation.coords.iter());
        if !numbers.copied().all(f64::is_finite) {
            return Err(PressError::NotFinite);
        }
        let axis_w = |share: f64| x_wt * Point3::new(-share * finger.length_m, 0.0, 0.0);
        let middle_w = axis_w(0.5);
        if !object.touches(&middle_w, finger.radius_m + 0.5 * finger.length_m) {
            return Ok(ContactLoad::default());
        }
        let distance_m = |share: f64| {
            let p_w = axis_w(share);
            (object.closest_point(&p_w).point - p_w).norm()
        };
        let share = nearest(finger, distance_m);
        let p_w = axis_w(share);
        let surface_w = object.closest_point(&p_w).point;
        let off_w = p_w - surface_w;
        let depth_m = finger.radius_m - off_w.norm();
        if depth_m <= 0.0 {
            return Ok(ContactLoad::default());
        }
        if object.is_enclosed(&p_w) || off_w.norm() == 0.0 {
            return Err(PressError::Inside);
        }
        let normal_t: Vector3<f64> = x_wt.rotation.inverse() * off_w.normalize();
        let centre_t = Point3::new(-share * finger.length_m, 0.0, 0.0) - normal_t * finger.radius_m;
        let force_n = normal_t * (self.stiffness_n_m * depth_m);
        Ok(ContactLoad {
            force_n,
            torque_nm: centre_t.coords.cross(&force_n),
            centre_t,
            normal_t,
            indentation_max_m: depth_m,
            energy_j: 0.5 * self.stiffness_n_m * depth_m * depth_m,
            ..ContactLoad::default()
        })
    }
}

/// Returns the place on the finger's axis, from 0 at its tip to 1, with the smallest distance.
fn nearest(finger: &Finger, distance_m: impl Fn(f64) -> f64) -> f64 {
    let count = (PER_RADIUS * finger.length_m / finger.radius_m).ceil() as usize;
    if count == 0 {
        return 0.0;
    }
    let step = 1.0 / count as f64;
    let places = (0..=count).map(|i| i as f64 * step);
    let best = places.min_by(|a, b| distance_m(*a).total_cmp(&distance_m(*b))).unwrap_or(0.0);
    let (mut low, mut high) = ((best - step).max(0.0), (best + step).min(1.0));
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..STEPS {
        let [left, right] = [high - golden * (high - low), low + golden * (high - low)];
        match distance_m(left) <= distance_m(right) {
            true => high = right,
            false => low = left,
        }
    }
    // An end of the axis is hit exactly.
    [0.5 * (low + high), best]
        .into_iter()
        .min_by(|a, b| distance_m(*a).total_cmp(&distance_m(*b)))
        .unwrap_or(best)
}
