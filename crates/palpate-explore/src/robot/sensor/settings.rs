//! Settings of a finger's sensor: its kind, and what is known of its accuracy.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[sensor]`: the sensor that locates the contacts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SensorSettings {
    /// Kind of the sensor.
    pub kind: SensorKind,
}

/// Kind of a fingertip sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SensorKind {
    /// The BioTac of the effects or of the robot; without one, the exact contact in a simulation,
    /// and the force/torque sensor of a robot.
    #[default]
    Automatic,
    /// Rigid tip on a force/torque sensor: the wrench locates the contact.
    ForceTorqueTip,
    /// Elastomer pad with a camera behind it: depth images locate a patch of the surface.
    DepthPatch,
    /// A flag or a force that tells contact, and nothing of its place on the tip.
    Contact,
}

impl SensorKind {
    /// Returns the name used in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Automatic => "automatic",
            Self::ForceTorqueTip => "force_torque_tip",
            Self::DepthPatch => "depth_patch",
            Self::Contact => "contact",
        }
    }
}

/// Accuracy of a force/torque sensor. Vectors are along x, y, z of the sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WrenchAccuracy {
    /// Standard deviation of the noise of a force reading.
    pub noise_n: [f64; 3],
    /// Standard deviation of the noise of a torque reading.
    pub noise_nm: [f64; 3],
    /// Resolution of the forces.
    pub resolution_n: [f64; 3],
    /// Resolution of the torques.
    pub resolution_nm: [f64; 3],
    /// Random walk of the force bias: standard deviation per square root of a second.
    pub drift_n_sqrt_s: [f64; 3],
    /// Change of the force bias with the arm's posture: standard deviation per metre of motion of
    /// the tip.
    pub posture_n_m: f64,
    /// Largest force readings; 0 if unknown.
    pub range_n: [f64; 3],
    /// Largest torque readings; 0 if unknown.
    pub range_nm: [f64; 3],
}
