//! Settings of a touch by a moving robot: travel, approach, contact, settle, read, retract.

use super::stroke::StrokeSettings;
use crate::robot::finger::Detection;
use crate::robot::finger::contact_point::ContactEstimate;
use crate::robot::finger::frame::FRAME_S;
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[touch]`: settings of a touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TouchSettings {
    /// Control period, s; default: that of the backend.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
    /// Speed of travel in front of the object, and of the retraction, m/s.
    pub travel_m_s: f64,
    /// Speed of the approach, m/s.
    pub approach_m_s: f64,
    /// Distance between the finger's hull and the object's foremost point during travel, m.
    pub standoff_m: f64,
    /// Contact detection by pressure or electrodes.
    pub detection: Detection,
    /// Force threshold of contact, N, without a pressure sensor or as `detection.by` selects.
    pub detection_n: f64,
    /// Distance that a soft finger, a pad, or a real finger without a tactile sensor is pressed
    /// beyond detection, m; less where the force reaches a quarter of `force_limit_n`.
    pub press_m: f64,
    /// Time at rest on the object before reading, s.
    pub settle_s: f64,
    /// Number of tactile frames averaged at rest and on the object; `detection.threshold_sds` needs
    /// at least 20 at first.
    pub frames: usize,
    /// Force at which the finger retracts without reading, N.
    pub force_limit_n: f64,
    /// Rise of the pressure (PDC) at which the finger retracts without reading, counts.
    pub pressure_limit_counts: f64,
    /// Point of the finger that is recorded as the contact.
    pub point: ContactEstimate,
    /// Slides along the surface after contact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stroke: Option<StrokeSettings>,
}

impl Default for TouchSettings {
    /// Returns the default settings of a touch. Heuristics, except the detection: the approach is
    /// slow enough that the skin is indented by less than a millimetre before the pressure detects
    /// contact.
    fn default() -> Self {
        Self {
            period_s: None,
            travel_m_s: 0.1,
            approach_m_s: 0.02,
            standoff_m: 0.01,
            detection: Detection::default(),
            detection_n: 0.05,
            press_m: 0.0,
            settle_s: 0.05,
            frames: 5,
            force_limit_n: 15.0,
            pressure_limit_counts: 1500.0,
            point: ContactEstimate::Skin,
            stroke: None,
        }
    }
}

/// Largest deceleration of a robot; the stage's largest acceleration.
const BRAKE_M_S2: f64 = 1.0;

impl TouchSettings {
    /// Largest approach speed at which the finger stops within `depth_m` of the first contact, if
    /// contact is detected by force, or by frames that arrive in batches of `batch`, with control
    /// ticks of `period_s`.
    ///
    /// Contact begins just after a frame; the delay t is the frames that must agree, the rest of
    /// their batch, and the tick that delivers them: v t + v² / 2a = depth.
    pub fn approach_limit_m_s(&self, period_s: f64, batch: Option<usize>, depth_m: f64) -> f64 {
        let wait_s = match batch {
            Some(batch) => {
                let frames = self.detection.frames as usize + batch.max(1) - 1;
                frames as f64 * FRAME_S.max(period_s) + period_s
            }
            None => 2.0 * period_s,
        };
        let lost_m_s = BRAKE_M_S2 * wait_s;
        (lost_m_s * lost_m_s + 2.0 * BRAKE_M_S2 * depth_m).sqrt() - lost_m_s
    }
}

impl Validate for TouchSettings {
    fn check(&self, rules: &mut Rules) {
        rules.optional_number("period_s", self.period_s, 1e-4..=0.1);
        rules.number("travel_m_s", self.travel_m_s, 1e-4..=1.0);
        rules.number("approach_m_s", self.approach_m_s, 1e-4..=1.0);
        rules.number("standoff_m", self.standoff_m, 1e-4..=1.0);
        rules.table("detection", &self.detection);
        rules.number("detection_n", self.detection_n, 1e-3..=100.0);
        rules.number("press_m", self.press_m, 0.0..=2e-3);
        rules.number("settle_s", self.settle_s, 0.0..=10.0);
        rules
            .require("frames", self.frames, (1..=100).contains(&self.frames), || "1 to 100".into());
        rules.number("force_limit_n", self.force_limit_n, 0.01..=1e4);
        rules.number("pressure_limit_counts", self.pressure_limit_counts, 1.0..=4095.0);
        if let Some(stroke) = &self.stroke {
            rules.table("stroke", stroke);
            let is_below = stroke.force_n < self.force_limit_n;
            rules.require("stroke.force_n", stroke.force_n, is_below, || {
                format!("less than force_limit_n, {}", self.force_limit_n)
            });
        }
    }
}
