//! Load of an object on the finger.

use nalgebra::{Point3, Vector3};

/// Contact load in one pose, in `T`; all zero without contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactLoad {
    /// Force on the finger.
    pub force_n: Vector3<f64>,
    /// Torque on the finger about the origin of `T`.
    pub torque_nm: Vector3<f64>,
    /// Centre of pressure: mean of the contact points, weighted by force.
    pub centre_t: Point3<f64>,
    /// Mean outward normal of the object, weighted by force.
    pub normal_t: Vector3<f64>,
    /// Deepest indentation of the skin.
    pub indentation_max_m: f64,
    /// Area of the object under load.
    pub area_m2: f64,
    /// Displaced fluid volume.
    pub displaced_m3: f64,
    /// Fluid pressure above rest.
    pub pressure_pa: f64,
    /// Energy stored in skin and fluid.
    pub energy_j: f64,
    /// Whether the gap is closed somewhere, so that the core carries load.
    pub is_core_loaded: bool,
}

/// Error of a pose that has no load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PressError {
    /// A number in the pose is NaN or infinite.
    NotFinite,
    /// The object encloses the origin of `T`: the finger is farther in than its skin is thick.
    Inside,
}
