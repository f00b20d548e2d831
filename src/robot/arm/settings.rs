//! The arm in a scene: which, where, and how it stands.

use super::chain::{Chain, Joints};
use super::pa10::Links;
use crate::config::{Checked, Rules};
use crate::math::pose::pose;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// A PA-10 with the finger along its flange's axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ArmSettings {
    /// Link lengths: `"C"` or `"A"`.
    pub links: Links,
    /// Where the base stands in `W`.
    pub base_position_m: [f64; 3],
    /// Turns of the base about the fixed axes x, then y, then z of `W`.
    pub base_rotation_deg: [f64; 3],
    /// The posture S1 S2 S3 E1 E2 W1 W2 to start from and to prefer.
    pub home_deg: [f64; 7],
    /// From the flange along its axis to the origin of `T`.
    pub mount_m: f64,
    /// Where the origin of `T` really is, in the frame that `T` has at the end of the mount, as
    /// `palpate register` finds it.
    #[serde(skip_serializing_if = "is_zero")]
    pub tool_position_m: [f64; 3],
    /// Turns of `T` about the fixed axes x, then y, then z of that frame.
    #[serde(skip_serializing_if = "is_zero")]
    pub tool_rotation_deg: [f64; 3],
    /// Mass of adapter and finger, which a `dynamic` body moves.
    pub tool_kg: f64,
}

/// Mass of adapter and finger beyond the force/torque sensor; chosen.
pub const TOOL_KG: f64 = 0.15;

impl Default for ArmSettings {
    /// Chosen: the base is `W`; at home the elbow is up and the finger points along -y, 45
    /// degrees up, 0.56 m in front of the base's axis and 0.48 m above its foot. The mount
    /// leaves room for a force/torque sensor and an adapter.
    fn default() -> Self {
        Self {
            links: Links::C,
            base_position_m: [0.0; 3],
            base_rotation_deg: [0.0; 3],
            home_deg: [-90.0, 15.0, 0.0, 120.0, 0.0, -90.0, 0.0],
            mount_m: 0.12,
            tool_position_m: [0.0; 3],
            tool_rotation_deg: [0.0; 3],
            tool_kg: TOOL_KG,
        }
    }
}

impl ArmSettings {
    /// Pose of `T` in the frame that it has at the end of the mount; none if it is that frame.
    pub fn correction(&self) -> Option<Isometry3<f64>> {
        let is_there = is_zero(&self.tool_position_m) && is_zero(&self.tool_rotation_deg);
        (!is_there).then(|| pose(self.tool_position_m, self.tool_rotation_deg))
    }

    /// The arm as a chain from `W` to `T`.
    pub fn chain(&self) -> Chain {
        Chain {
            base: pose(self.base_position_m, self.base_rotation_deg),
            joints: self.links.joints().into(),
            flange: Translation3::new(0.0, 0.0, self.links.flange_m()).into(),
            tool: match self.correction() {
                Some(correction) => tool(self.mount_m) * correction,
                None => tool(self.mount_m),
            },
            home: Joints::from(self.home_deg.map(f64::to_radians)),
        }
    }
}

fn is_zero(numbers: &[f64; 3]) -> bool {
    *numbers == [0.0; 3]
}

/// Pose of `T` in the flange's frame: distal along the flange's +z, the pad towards its +x.
pub(super) fn tool(mount_m: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(0.0, 0.0, mount_m),
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -FRAC_PI_2),
    )
}

impl Checked for ArmSettings {
    fn check(&self, rules: &mut Rules) {
        rules.numbers("base_position_m", &self.base_position_m, -1e3..=1e3);
        rules.numbers("base_rotation_deg", &self.base_rotation_deg, -360.0..=360.0);
        for (i, (joint, &home)) in self.links.joints().iter().zip(&self.home_deg).enumerate() {
            let [low, high] = joint.q_limits.map(f64::to_degrees).map(f64::round);
            rules.number(&format!("home_deg[{i}]"), home, low..=high);
        }
        rules.number("mount_m", self.mount_m, 0.01..=0.5);
        rules.numbers("tool_position_m", &self.tool_position_m, -0.1..=0.1);
        rules.numbers("tool_rotation_deg", &self.tool_rotation_deg, -45.0..=45.0);
        rules.number("tool_kg", self.tool_kg, 1e-6..=100.0);
    }
}
