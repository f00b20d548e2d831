//! Rigid fingertip on a force-torque sensor: intrinsic contact sensing.

use super::sample::{Sample, Wrench};
use super::{SensedContact, Sensor};
use crate::robot::finger::Finger;
use nalgebra::{Point3, Vector3};

/// Smallest force whose line of action locates a contact.
// heuristic: below it, the noise of a common sensor turns the force by more than 30°.
const LEAST_N: f64 = 0.1;

/// Locates contacts by the wrench relative to that of the finger at rest.
#[derive(Clone, Debug, Default)]
pub struct ForceTorqueTip {
    at_rest: Option<Wrench>,
    sum: Wrench,
    count: f64,
}

/// Returns the point of a sphere of `radius_m` about the origin at which a pure, inward force
/// produces the wrench `(f, τ)`: `p = (f × τ) / |f|² − λ f` with `|p| = radius` (Bicchi, Salisbury
/// & Brock 1993, Int. J. Robotics Research 12, contact with friction). If measurement error
/// makes the line of action miss the sphere, returns the sphere's nearest point. Returns `None` for
/// a force of less than 0.1 N.
pub fn point_on_sphere(radius_m: f64, wrench: &Wrench) -> Option<Point3<f64>> {
    let Wrench { force_n: f, torque_nm } = wrench;
    let squared = f.norm_squared();
    if squared < LEAST_N * LEAST_N || !squared.is_finite() {
        return None;
    }
    let foot = f.cross(torque_nm) / squared;
    let back = ((radius_m * radius_m - foot.norm_squared()).max(0.0) / squared).sqrt();
    let p = foot - f * back;
    Some(Point3::from(p.try_normalize(0.0)? * radius_m))
}

impl Sensor for ForceTorqueTip {
    fn push(&mut self, _: f64, _: &[Sample], wrench: Option<&Wrench>) {
        if let Some(wrench) = wrench {
            self.sum.force_n += wrench.force_n;
            self.sum.torque_nm += wrench.torque_nm;
            self.count += 1.0;
        }
    }

    fn clear_samples(&mut self) {
        (self.sum, self.count) = (Wrench::default(), 0.0);
    }

    fn tare(&mut self) {
        self.at_rest = self.mean();
    }

    fn is_present(&self) -> bool {
        self.at_rest.is_some()
    }

    /// Locates the contact on the hemisphere, with the sphere's normal there.
    fn locate(&self, finger: &Finger) -> Option<SensedContact> {
        let (rest, now) = (self.at_rest?, self.mean()?);
        let load = Wrench {
            force_n: now.force_n - rest.force_n,
            torque_nm: now.torque_nm - rest.torque_nm,
        };
        let p_tc = point_on_sphere(finger.radius_m, &load)?;
        Some(SensedContact { p_tc, normal_t: -p_tc.coords.try_normalize(0.0)? })
    }
}

impl ForceTorqueTip {
    /// Returns the mean of the wrenches since [`clear_samples`](Sensor::clear_samples).
    fn mean(&self) -> Option<Wrench> {
        let Self { sum, count, .. } = self;
        let mean = |sum: Vector3<f64>| sum / *count;
        (*count > 0.0)
            .then(|| Wrench { force_n: mean(sum.force_n), torque_nm: mean(sum.torque_nm) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A force at a point of the sphere, within its friction cone, is located at that point.
        #[test]
        fn a_force_is_found_where_it_acts(
            outward in prop::array::uniform3(-1f64..1.0),
            slip in prop::array::uniform3(-1f64..1.0),
            force_n in 0.2f64..20.0,
            radius_m in 1e-3f64..0.05,
        ) {
            let outward = Vector3::from(outward);
            prop_assume!(outward.norm() > 0.01);
            let n = outward.normalize();
            let across = Vector3::from(slip) - n * n.dot(&Vector3::from(slip));
            let force = (-n + 0.4 * across).normalize() * force_n;
            let p = n * radius_m;
            let wrench = Wrench { force_n: force, torque_nm: p.cross(&force) };
            let found = point_on_sphere(radius_m, &wrench).unwrap();
            prop_assert!((found.coords - p).norm() < 1e-9 * (1.0 + 1.0 / force_n));
        }
    }

    /// A force along the finger's axis is located at the tip; a zero force gives no contact.
    #[test]
    fn the_tip_is_pressed_by_a_force_along_the_axis() {
        let wrench = Wrench { force_n: -Vector3::x(), torque_nm: Vector3::zeros() };
        assert_eq!(point_on_sphere(0.007, &wrench).unwrap(), Point3::new(0.007, 0.0, 0.0));
        assert!(point_on_sphere(0.007, &Wrench::default()).is_none());
    }
}
