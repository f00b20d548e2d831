//! Views of a depth camera: points of the surface with a noise of their own and a rigid error of
//! the camera's pose in common.
//!
//! [`thin`] turns the thousands of points of a [`View`] into a few hundred surface elements. A
//! [`SeenSurface`] is the evidence that a belief takes from them.

mod doubt;
pub(crate) mod look;
mod offer;
mod register;
mod reject;
mod seen;
mod sight;
mod thin;

pub use doubt::ViewDoubt;
pub use offer::LookOffer;
pub use seen::{CorrectedElement, ERRORS, RigidError, SeenSurface, corrected_pose};
pub use sight::{DepthMap, Sight};
pub use thin::{SurfaceElement, thin};

use nalgebra::{Isometry3, Point3};
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Points that a depth camera has seen.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Stated pose of the camera in `W`: z ahead, x right, y down (REP 103, optical frames).
    pub x_wc: Isometry3<f64>,
    /// Points in the camera's frame.
    pub points_c: Vec<Point3<f64>>,
    /// Lowest and highest (x/z, y/z) of its image, if known: a pixel without a point shows none.
    pub image: Option<[[f64; 2]; 2]>,
    /// Point about which the error of the pose is stated, in `W`: near what the camera looks at,
    /// where a calibration is tested.
    pub pivot_w: Point3<f64>,
    /// Accuracy of the points and of the pose.
    pub accuracy: CameraAccuracy,
}

/// Standard deviations of the camera's position by which a seen point may be off.
const MARGIN_SIGMAS: f64 = 3.0;

impl View {
    /// Distance by which a seen point may be off: a point beside the zone may be in it once the
    /// pose is corrected, and one above the table may be the table's.
    pub fn margin_m(&self) -> f64 {
        MARGIN_SIGMAS * self.accuracy.pose_error.position_sd_m.into_iter().fold(0.0, f64::max)
    }
}

/// Accuracy of a depth camera and of its stated pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CameraAccuracy {
    /// Noise of each pixel.
    pub noise: PixelNoise,
    /// Error of the stated pose.
    pub pose_error: PoseError,
}

/// Table `[camera.noise]`: noise of each pixel's depth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PixelNoise {
    /// Standard deviation, m.
    pub noise_m: f64,
    /// Further, independent standard deviation as a fraction of the depth.
    pub noise_ratio: f64,
    /// Side of the squares of pixels with equal noise, pixels.
    pub noise_px: usize,
}

impl Default for PixelNoise {
    /// Returns the noise of a D405.
    fn default() -> Self {
        Self { noise_m: 0.0, noise_ratio: 3e-3, noise_px: 3 }
    }
}

impl PixelNoise {
    /// No noise.
    pub const NONE: Self = Self { noise_m: 0.0, noise_ratio: 0.0, noise_px: 1 };

    /// Standard deviation at a depth.
    pub fn sd_m(&self, depth_m: f64) -> f64 {
        self.noise_m.hypot(self.noise_ratio * depth_m)
    }
}

/// Table `[camera.pose_error]`: error of the camera's stated pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PoseError {
    /// Standard deviation of the shift of the seen points along x, y and z of the camera, at what
    /// it looks at, m.
    pub position_sd_m: [f64; 3],
    /// Standard deviation of their rotation about the same axes, deg.
    pub rotation_sd_deg: [f64; 3],
    /// Standard deviation of the relative error of all depths.
    pub scale_sd: f64,
}

impl Default for PoseError {
    /// Returns the error of a calibrated camera beside an arm.
    fn default() -> Self {
        // Calibrated cameras beside an arm are off by 2 to 5 mm and 0.5 to 1°.
        Self { position_sd_m: [3e-3; 3], rotation_sd_deg: [0.7; 3], scale_sd: 0.0 }
    }
}

impl PoseError {
    /// An exact pose.
    pub const NONE: Self =
        Self { position_sd_m: [0.0; 3], rotation_sd_deg: [0.0; 3], scale_sd: 0.0 };
}

impl Validate for PixelNoise {
    fn check(&self, rules: &mut Rules) {
        rules.number("noise_m", self.noise_m, 0.0..=0.1);
        rules.number("noise_ratio", self.noise_ratio, 0.0..=0.5);
        rules.number("noise_px", self.noise_px as f64, 1.0..=64.0);
    }
}

impl Validate for PoseError {
    fn check(&self, rules: &mut Rules) {
        rules.numbers("position_sd_m", &self.position_sd_m, 0.0..=0.1);
        rules.numbers("rotation_sd_deg", &self.rotation_sd_deg, 0.0..=20.0);
        rules.number("scale_sd", self.scale_sd, 0.0..=0.2);
    }
}
