//! How the fingertip stands and moves.

use nalgebra::{Isometry3, Vector3, Vector6};

/// How the fingertip stands and moves in `W`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipMotion {
    /// Pose of `T`.
    pub x_wt: Isometry3<f64>,
    /// Velocity of the origin of `T`, in m/s.
    pub linear_w: Vector3<f64>,
    /// Angular velocity of `T`, in rad/s.
    pub angular_w: Vector3<f64>,
}

impl TipMotion {
    /// Standing still.
    pub fn at(x_wt: Isometry3<f64>) -> Self {
        Self::moving(x_wt, &Vector6::zeros())
    }

    /// At `x_wt` with a twist: linear velocity of the origin of `T`, then angular, in `W`.
    pub fn moving(x_wt: Isometry3<f64>, twist: &Vector6<f64>) -> Self {
        let [linear_w, angular_w] = [0, 3].map(|part| twist.fixed_rows::<3>(part).into());
        Self { x_wt, linear_w, angular_w }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let numbers = [&self.linear_w, &self.angular_w, &self.x_wt.translation.vector];
        numbers.iter().all(|vector| vector.iter().all(|number| number.is_finite()))
            && self.x_wt.rotation.coords.iter().all(|number| number.is_finite())
    }
}
