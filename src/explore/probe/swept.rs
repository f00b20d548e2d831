//! The space that a touch has found free: what the finger's hull swept on its way.

use crate::robot::finger::shape::Finger;
use nalgebra::Point3;

/// Where an approach ended; the hull came there along −y, so no surface is above its front.
#[derive(Clone, Debug, PartialEq)]
pub struct Swept {
    /// The hull.
    pub finger: Finger,
    /// The centre of the fingertip's hemisphere in `W`: at rest on the surface, or for a miss where
    /// the finger turned back.
    pub p_wt: Point3<f64>,
}

impl Swept {
    /// The largest y that the surface can have at (`x_m`, `z_m`) in `W`; none where the hull did not
    /// pass.
    pub fn ceiling_y_m(&self, x_m: f64, z_m: f64) -> Option<f64> {
        let front_m = self.finger.front_m(x_m - self.p_wt.x, z_m - self.p_wt.z)?;
        Some(self.p_wt.y + front_m)
    }
}
