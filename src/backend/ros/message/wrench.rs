//! What a force/torque sensor says.

use super::definition::{Definition, Described};
use super::header::Header;
use serde::{Deserialize, Serialize};

/// `geometry_msgs/Vector3`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vector3 {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
}

impl Described for Vector3 {
    const DEFINITION: Definition = Definition {
        name: "geometry_msgs/msg/Vector3",
        fields: "float64 x\nfloat64 y\nfloat64 z\n",
        parts: &[],
    };
}

impl From<nalgebra::Vector3<f64>> for Vector3 {
    fn from(v: nalgebra::Vector3<f64>) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Vector3> for nalgebra::Vector3<f64> {
    fn from(v: Vector3) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

/// `geometry_msgs/Wrench`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// N.
    pub force: Vector3,
    /// N·m.
    pub torque: Vector3,
}

impl Described for Wrench {
    const DEFINITION: Definition = Definition {
        name: "geometry_msgs/msg/Wrench",
        fields: "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
        parts: &[&Vector3::DEFINITION],
    };
}

/// `geometry_msgs/WrenchStamped`, in the sensor's own frame, its bias not taken off.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WrenchStamped<H = Header> {
    /// When it was measured, in which frame.
    pub header: H,
    /// What was.
    pub wrench: Wrench,
}

impl<H> Described for WrenchStamped<H> {
    const DEFINITION: Definition = Definition {
        name: "geometry_msgs/msg/WrenchStamped",
        fields: "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
        parts: &[&Header::DEFINITION, &Wrench::DEFINITION],
    };
}
