//! Settings of the interlocks: limits and timeouts.

use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[interlocks]`: limits beyond which the robot is stopped. The reduced speed is from EN ISO
/// 10218-1; values without a source are heuristics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct InterlockSettings {
    /// Largest fingertip speed, m/s; default 0.25 for a real robot (EN ISO 10218-1), the
    /// controller's maximum in simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip_speed_m_s: Option<f64>,
    /// Largest distance of the tip from the box around home and all approaches, m.
    pub tip_margin_m: f64,
    /// Workspace of tip and elbow in `W`, [smallest, largest] of x, y, z, m; unlimited if omitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workspace_m: Option<[[f64; 2]; 3]>,
    /// Height in `W` of table or floor, m, avoided by all links except the foot; required for a
    /// real robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lowest_m: Option<f64>,
    /// Largest distance of the tip beyond the turning point of a touch, m.
    pub depth_margin_m: f64,
    /// Smallest distance between links, and from links to table and object, m.
    pub clearance_m: f64,
    /// Delay from a command until the robot reacts, s, assumed by predictive interlocks.
    pub reaction_s: f64,
    /// Force limit relative to the force at the start, N; default `touch.force_limit_n` + 10.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_limit_n: Option<f64>,
    /// Torque limit about the fingertip, N·m; default: the force limit times the finger's
    /// length, and ten standard deviations of the sensor's noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_limit_nm: Option<f64>,
    /// Timeout of joint states, s.
    pub joint_timeout_s: f64,
    /// Timeout of the force/torque sensor, s.
    pub wrench_timeout_s: f64,
    /// Timeout of tactile frames, s.
    pub frame_timeout_s: f64,
    /// Time after which a constant electrode or position of a commanded joint stops a real robot,
    /// s.
    // heuristic: seven tactile frames.
    pub stuck_s: f64,
    /// Largest velocity tracking error over 0.2 s, as a fraction of the joint's velocity limit.
    #[serde(alias = "follow_share")]
    pub tracking_error_ratio: f64,
    /// Largest delay of a real robot's joints, s, that position tracking allows.
    pub tracking_lag_s: f64,
    /// Retract distance along the approach path after excessive force, m; 0 disables it.
    pub retract_m: f64,
}

/// Margin of the fault force above that at which a touch retracts; a heuristic: a finger at 20 mm/s
/// adds 4 N within 10 ms against 20 N/mm.
const ABOVE_TOUCH_N: f64 = 10.0;

/// Defaults that the check of planned motions uses as well.
pub mod defaults {
    /// Largest distance of the tip from the box around home and its touches.
    pub const TIP_MARGIN_M: f64 = 0.2;
    /// Smallest distance between links.
    pub const CLEARANCE_M: f64 = 0.02;
    /// Delay from a command until the joints begin to brake.
    pub const REACTION_S: f64 = 0.01;
}

impl Default for InterlockSettings {
    /// Returns the default limits; no touch of the built-in scenes comes close to them.
    fn default() -> Self {
        Self {
            tip_speed_m_s: None,
            tip_margin_m: defaults::TIP_MARGIN_M,
            workspace_m: None,
            lowest_m: None,
            depth_margin_m: 0.01,
            clearance_m: defaults::CLEARANCE_M,
            reaction_s: defaults::REACTION_S,
            force_limit_n: None,
            torque_limit_nm: None,
            joint_timeout_s: 0.04,
            wrench_timeout_s: 0.07,
            frame_timeout_s: 0.2,
            stuck_s: 0.07,
            tracking_error_ratio: 0.3,
            tracking_lag_s: 0.1,
            retract_m: 0.01,
        }
    }
}

impl InterlockSettings {
    /// Returns the force that is a fault, if a touch retracts at `touch_force_n`.
    pub fn force_n(&self, touch_force_n: f64) -> f64 {
        self.force_limit_n.unwrap_or(touch_force_n + ABOVE_TOUCH_N)
    }

    /// Checks that the fault force exceeds `touch_force_n`, the value of `touch.force_limit_n`.
    pub fn check_against_touch(&self, touch_force_n: f64, rules: &mut Rules) {
        let force_n = self.force_n(touch_force_n);
        rules.require("force_limit_n", force_n, force_n > touch_force_n, || {
            format!("more than touch.force_limit_n = {touch_force_n} N")
        });
    }
}

impl Validate for InterlockSettings {
    fn check(&self, rules: &mut Rules) {
        let numbers = [
            ("tip_speed_m_s", self.tip_speed_m_s, 1e-3..=2.0),
            ("tip_margin_m", Some(self.tip_margin_m), 0.0..=10.0),
            ("lowest_m", self.lowest_m, -1e3..=1e3),
            ("depth_margin_m", Some(self.depth_margin_m), 0.0..=1.0),
            ("clearance_m", Some(self.clearance_m), 0.0..=0.5),
            ("reaction_s", Some(self.reaction_s), 0.0..=1.0),
            ("force_limit_n", self.force_limit_n, 0.1..=1e5),
            ("torque_limit_nm", self.torque_limit_nm, 1e-3..=1e4),
            ("joint_timeout_s", Some(self.joint_timeout_s), 1e-3..=10.0),
            ("wrench_timeout_s", Some(self.wrench_timeout_s), 1e-3..=10.0),
            ("frame_timeout_s", Some(self.frame_timeout_s), 1e-2..=10.0),
            ("stuck_s", Some(self.stuck_s), 0.05..=100.0),
            ("tracking_error_ratio", Some(self.tracking_error_ratio), 0.01..=10.0),
            ("tracking_lag_s", Some(self.tracking_lag_s), 0.0..=1.0),
            ("retract_m", Some(self.retract_m), 0.0..=0.1),
        ];
        for (key, value, allowed) in numbers {
            value.into_iter().for_each(|value| rules.number(key, value, allowed.clone()));
        }
        for (i, side) in self.workspace_m.into_iter().flatten().enumerate() {
            rules.interval(&format!("workspace_m[{i}]"), side, -1e3..=1e3);
        }
    }
}
