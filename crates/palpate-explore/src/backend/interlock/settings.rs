//! Thresholds of the interlocks.

use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[interlocks]`: beyond these the body is stopped, whatever it was told. EN ISO 10218-1 has
/// the reduced speed; where nothing else is said the figures are chosen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct InterlockSettings {
    /// Fastest that the fingertip may be. Left out, 0.25 m/s for a real body (EN ISO 10218-1,
    /// reduced speed), for a simulated one what its controller may ask for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip_speed_m_s: Option<f64>,
    /// How far the tip may be from the box around its home and the ways of all its touches.
    pub tip_margin_m: f64,
    /// A box in `W`, [smallest, largest] of x, y and z, that neither tip nor elbow may leave. Left
    /// out, there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workspace_m: Option<[[f64; 2]; 3]>,
    /// Height in `W` of the table or floor that nothing of the robot but its foot may come near.
    /// Left out, there is none; a real robot must be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lowest_m: Option<f64>,
    /// How far the tip may go beyond where a touch turns back.
    pub depth_margin_m: f64,
    /// Distance that links keep from each other, from the table and from the object.
    pub clearance_m: f64,
    /// From a command until the body heeds it, as the interlocks that look ahead take it.
    pub reaction_s: f64,
    /// Force, beyond that at the start, that is a fault. Left out, 10 N above
    /// `touch.force_limit_n`, at which a touch retreats by itself: 25 N with the default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_limit_n: Option<f64>,
    /// The same of the torque about the fingertip. Left out, that force at the lever of the
    /// finger's length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_limit_nm: Option<f64>,
    /// Longest that the time of the joints may stand still.
    pub joint_silence_s: f64,
    /// Longest without a new reading of the force/torque sensor.
    pub wrench_silence_s: f64,
    /// Longest without a tactile frame.
    pub frame_silence_s: f64,
    /// Stop a real body if an electrode, or a joint that is commanded to move, has read the same
    /// value for this long: seven tactile frames.
    pub frozen_s: f64,
    /// Stop if the velocity tracking error of a joint has been larger for 0.2 s, as a share of its
    /// largest velocity.
    #[serde(alias = "follow_share")]
    pub tracking_error_ratio: f64,
    /// Longest delay with which the joints of a real body may follow their commands: what they move
    /// within a second is compared with what was commanded up to this much earlier.
    pub tracking_lag_s: f64,
    /// How far the finger goes back, the way it came, when too much force has stopped it; 0 for not
    /// at all.
    pub retract_m: f64,
}

/// By how much a force that is a fault lies above that at which a touch retreats; chosen: what a
/// finger at 20 mm/s adds within 10 ms against 20 N/mm is 4 N.
const ABOVE_TOUCH_N: f64 = 10.0;

/// Defaults that a rehearsal of motions keeps to as well.
pub mod defaults {
    /// Farthest that the tip may leave the box around home and its touches.
    pub const TIP_MARGIN_M: f64 = 0.2;
    /// Least distance between links.
    pub const CLEARANCE_M: f64 = 0.02;
    /// From a command until the joints begin to brake.
    pub const REACTION_S: f64 = 0.01;
}

impl Default for InterlockSettings {
    /// No touch of the scenes that ship comes near to them.
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
            joint_silence_s: 0.04,
            wrench_silence_s: 0.07,
            frame_silence_s: 0.2,
            frozen_s: 0.07,
            tracking_error_ratio: 0.3,
            tracking_lag_s: 0.1,
            retract_m: 0.01,
        }
    }
}

impl InterlockSettings {
    /// The force that is a fault where a touch retreats at `touch_force_n`.
    pub fn force_n(&self, touch_force_n: f64) -> f64 {
        self.force_limit_n.unwrap_or(touch_force_n + ABOVE_TOUCH_N)
    }

    /// The fault must lie above what is none: `touch_force_n` is `touch.force_limit_n`.
    pub fn check_beside(&self, touch_force_n: f64, rules: &mut Rules) {
        let force_n = self.force_n(touch_force_n);
        rules.require("force_limit_n", force_n, force_n > touch_force_n, || {
            format!("more than touch.force_limit_n = {touch_force_n} N, at which a touch retreats")
        });
    }
}

impl Checked for InterlockSettings {
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
            ("joint_silence_s", Some(self.joint_silence_s), 1e-3..=10.0),
            ("wrench_silence_s", Some(self.wrench_silence_s), 1e-3..=10.0),
            ("frame_silence_s", Some(self.frame_silence_s), 1e-2..=10.0),
            ("frozen_s", Some(self.frozen_s), 0.05..=100.0),
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
