//! The fingertip's outer skin as a rigid hull: a cylinder closed by a hemisphere.

use crate::ground::config::{Checked, Rules};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Shape and attitude of the finger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Finger {
    /// Radius of cylinder and hemisphere.
    pub radius_m: f64,
    /// Length of the cylinder behind the hemisphere's centre.
    pub length_m: f64,
    /// Angle of the finger's axis above the direction of approach: 0 touches with the tip's
    /// apex, 90 with the finger's side.
    pub pitch_deg: f64,
}

impl Default for Finger {
    /// The BioTac: the outer skin lies 7.0 mm from the axis at the sides and the sensing part
    /// is 28 mm long (NVIDIA's FEM mesh of the sensor). The pitch is chosen, half-way between
    /// touching with the tip's apex and with the pad.
    fn default() -> Self {
        Self { radius_m: 0.007, length_m: 0.021, pitch_deg: 45.0 }
    }
}

impl Finger {
    /// From the hemisphere's centre (origin of `T`) to the cylinder's far end, in `W`.
    ///
    /// The finger points along the approach −y and up by its pitch, so its cylinder lies
    /// behind (+y) and below.
    pub fn axis_w(&self) -> Vector3<f64> {
        let (up, forward) = self.pitch_deg.to_radians().sin_cos();
        Vector3::new(0.0, forward, -up) * self.length_m
    }

    /// Attitude of `T` in `W`: +x distal, towards -y and up by the pitch; the pad, -z, towards
    /// the object.
    pub fn attitude_w(&self) -> UnitQuaternion<f64> {
        let (up, forward) = self.pitch_deg.to_radians().sin_cos();
        let axes = [Vector3::new(0.0, -forward, up), Vector3::x(), Vector3::new(0.0, up, forward)];
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes));
        UnitQuaternion::from_rotation_matrix(&rotation)
    }
}

impl Checked for Finger {
    fn check(&self, rules: &mut Rules) {
        rules.number("radius_m", self.radius_m, 1e-5..=0.1);
        rules.number("length_m", self.length_m, 0.0..=1.0);
        rules.number("pitch_deg", self.pitch_deg, -90.0..=90.0);
    }
}
