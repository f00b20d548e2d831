//! Views of a depth camera: points of the surface with a noise of their own and a rigid error of
//! the camera's pose in common.
//!
//! [`thin`] turns the thousands of points of a [`View`] into a few hundred surface elements. A
//! [`SeenSurface`] is the evidence that a belief takes from them.

mod seen;
mod thin;

pub use seen::{
    CorrectedElement, ERRORS, PoseErrors, RigidError, SeenSurface, corrected_pose, found_by_touch,
};
pub use thin::{SurfaceElement, thin};

use nalgebra::{Isometry3, Point3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Points that a depth camera has seen.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Stated pose of the camera in `W`: z ahead, x right, y down (REP 103, optical frames).
    pub x_wc: Isometry3<f64>,
    /// Points in the camera's frame.
    pub points_c: Vec<Point3<f64>>,
    /// Point about which the error of the pose is stated, in `W`: near what the camera looks at,
    /// where a calibration is tested.
    pub pivot_w: Point3<f64>,
    /// Accuracy of the points and of the pose.
    pub accuracy: CameraAccuracy,
}

/// Accuracy of a depth camera and of its stated pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CameraAccuracy {
    /// Standard deviation of the noise of a pixel's depth, m.
    pub noise_m: f64,
    /// Standard deviation of the noise of a pixel's depth, as a fraction of the depth; added to
    /// `noise_m` as independent noise.
    pub noise_ratio: f64,
    /// Distance over which the noise of pixels is equal, pixels; 1 for independent pixels.
    pub noise_px: f64,
    /// Standard deviation of the shift of the points at the pivot along x, y and z of the camera,
    /// m.
    pub position_sd_m: [f64; 3],
    /// Standard deviation of their rotation about the same axes through the pivot, deg.
    pub rotation_sd_deg: [f64; 3],
    /// Standard deviation of the relative error of all depths.
    pub scale_sd: f64,
}

impl Default for CameraAccuracy {
    /// Returns the errors of a calibrated camera: 2 to 5 mm and 0.5 to 1°.
    fn default() -> Self {
        Self {
            noise_m: 0.0,
            noise_ratio: 0.0,
            noise_px: 1.0,
            position_sd_m: [3e-3; 3],
            rotation_sd_deg: [0.7; 3],
            scale_sd: 0.0,
        }
    }
}

impl CameraAccuracy {
    /// Standard deviation of the noise of a pixel at `depth_m`.
    pub fn noise_sd_m(&self, depth_m: f64) -> f64 {
        self.noise_m.hypot(self.noise_ratio * depth_m)
    }
}
