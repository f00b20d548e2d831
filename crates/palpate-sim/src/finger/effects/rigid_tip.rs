//! Rigid tip on a spring: a ball or rod that does not yield, on a sensor and an arm that do.

use super::constants::effect;
use super::effect::{Effect, EffectSwitch, Requirement};
use crate::finger::load::{ContactLoad, PressError};
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_explore::robot::finger::Finger;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::sweep::Capsule;

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
        let [p0_w, p1_w] = [0.0, -finger.length_m].map(|x| x_wt * Point3::new(x, 0.0, 0.0));
        let hull = Capsule { p0_w, p1_w, radius_m: finger.radius_m };
        let Some((p_w, surface_w)) = object.nearest_to_axis(&hull) else {
            return Ok(ContactLoad::default());
        };
        let off_w = p_w - surface_w;
        let depth_m = finger.radius_m - off_w.norm();
        if depth_m <= 0.0 {
            return Ok(ContactLoad::default());
        }
        if object.is_enclosed(&p_w) || off_w.norm() == 0.0 {
            return Err(PressError::Inside);
        }
        let normal_t: Vector3<f64> = x_wt.rotation.inverse() * off_w.normalize();
        let centre_t = x_wt.inverse_transform_point(&p_w) - normal_t * finger.radius_m;
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
