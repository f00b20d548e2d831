//! Elastomer pad of a finger: its size, shape and noise.

use crate::robot::finger::Finger;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// Default number of points of a patch.
// heuristic: more tell a belief of the surface little.
const PATCH_POINTS: usize = 4;

/// A pad at the end of the finger: its middle touches the hull's foremost point, and it faces the
/// approach. Its frame `P` has its origin there, x along the width, which is y of `T`, and z
/// outwards.
#[derive(Clone, Debug, PartialEq)]
pub struct GelPad {
    /// Width and height, m.
    pub size_m: [f64; 2],
    /// Radius of a domed pad; 0 for a flat one.
    pub dome_m: f64,
    /// Standard deviation of the noise of a pixel.
    pub noise_m: f64,
    /// Depths of its images over the true ones.
    pub scale: f64,
    /// Standard deviation of this scale, common to all pixels.
    pub scale_sd: f64,
    /// Indentation beyond which the pad is overloaded.
    pub depth_max_m: f64,
    /// Largest number of points of a patch.
    pub patch_points: usize,
}

impl Default for GelPad {
    /// Returns a flat pad without size and noise.
    fn default() -> Self {
        let [dome_m, noise_m, scale_sd, depth_max_m] = [0.0; 4];
        let (size_m, patch_points) = ([0.0; 2], PATCH_POINTS);
        Self { size_m, dome_m, noise_m, scale: 1.0, scale_sd, depth_max_m, patch_points }
    }
}

impl GelPad {
    /// Pose of `P` in `T`.
    pub fn x_tp(finger: &Finger) -> Isometry3<f64> {
        let ahead_t = finger.direction_t();
        let axes = Matrix3::from_columns(&[Vector3::y(), ahead_t.cross(&Vector3::y()), ahead_t]);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Isometry3::from_parts((ahead_t * finger.radius_m).into(), turn)
    }

    /// Height of the unloaded surface in `P` at (x, y).
    pub fn surface_m(&self, [x, y]: [f64; 2]) -> f64 {
        let across2 = x * x + y * y;
        // The difference of nearly equal numbers, rearranged.
        let inside = (self.dome_m * self.dome_m - across2).max(0.0).sqrt();
        if self.dome_m > 0.0 { -across2 / (self.dome_m + inside) } else { 0.0 }
    }

    /// Returns where a point of `P` is if the indentation there is smaller by the factor `scale`.
    pub fn rescaled(&self, p: &Point3<f64>, scale: f64) -> Point3<f64> {
        let surface_m = self.surface_m([p.x, p.y]);
        Point3::new(p.x, p.y, surface_m - (surface_m - p.z) / scale)
    }

    /// Place of a pixel's centre, in `P`, of an image with these numbers of pixels.
    pub fn pixel_m(&self, pixels: [usize; 2], index: usize) -> [f64; 2] {
        let at = [index % pixels[0], index / pixels[0]];
        [0, 1].map(|axis| ((at[axis] as f64 + 0.5) / pixels[axis] as f64 - 0.5) * self.size_m[axis])
    }
}
