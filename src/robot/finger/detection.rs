//! From tactile frames to contact: is there one?

use super::contact_point::Tare;
use super::frame::{FULL_SCALE_COUNTS, Frame};
use super::rest::{Evidence, Rest};
use crate::config::{Checked, Rules, is_default};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What says contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Alarm {
    /// A rise of the fluid's pressure (PDC).
    #[default]
    Pressure,
    /// Electrodes that change otherwise than all of them do together.
    Electrodes,
    /// Either.
    Both,
}

impl Alarm {
    /// Whether a sensor with these channels can say it.
    pub fn is_heard(self, pressure: bool, electrodes: bool) -> bool {
        let [by_pressure, by_electrodes] = self.by();
        by_pressure && pressure || by_electrodes && electrodes
    }

    fn by(self) -> [bool; 2] {
        [self != Self::Electrodes, self != Self::Pressure]
    }
}

/// When a frame counts as contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Detection {
    /// What says contact; electrodes do by `threshold_sds` only.
    #[serde(skip_serializing_if = "is_default")]
    pub by: Alarm,
    /// Rise of PDC above its tare; without meaning beside `threshold_sds`.
    pub threshold_counts: f64,
    /// Change since the tare, in standard deviations of the sensor's own noise as tares show it.
    /// Left out, `threshold_counts` decides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold_sds: Option<f64>,
    /// Frames in a row that must agree.
    pub frames: u32,
}

impl Default for Detection {
    /// Threshold: tams_biotac and balakumar-s/biotac_force_net. Frames: chosen, 30 ms; the latter
    /// waits for 10.
    fn default() -> Self {
        Self { by: Alarm::Pressure, threshold_counts: 10.0, threshold_sds: None, frames: 3 }
    }
}

impl Checked for Detection {
    fn check(&self, rules: &mut Rules) {
        rules.number("threshold_counts", self.threshold_counts, 0.0..=FULL_SCALE_COUNTS);
        if let Some(threshold_sds) = self.threshold_sds {
            rules.number("threshold_sds", threshold_sds, 1.0..=100.0);
        }
        let is_told = self.by == Alarm::Pressure || self.threshold_sds.is_some();
        rules.require("threshold_sds", "(none)", is_told, || {
            "a number, because only standard deviations say when electrodes tell contact".into()
        });
        rules.require("frames", self.frames, (1..=1000).contains(&self.frames), || {
            "1 to 1000".into()
        });
    }
}

/// Says whether there is contact, and changes its mind only when enough frames agree.
#[derive(Clone, Debug)]
pub struct Detector {
    detection: Detection,
    tare: Option<Tare>,
    rest: Rest,
    touching: bool,
    against: u32,
}

impl Detector {
    /// A detector that knows no sensor yet.
    pub fn new(detection: Detection) -> Self {
        Self { detection, tare: None, rest: Rest::default(), touching: false, against: 0 }
    }

    /// Frames at rest that it wants at the next [`tare`](Self::tare), at least.
    pub fn wants(&self) -> usize {
        self.detection.threshold_sds.map_or(0, |_| self.rest.wants())
    }

    /// What untouched frames read is the rest, and nothing is touched. How much they scatter is
    /// remembered from one tare to the next.
    pub fn tare(&mut self, frames: &[Frame]) {
        self.tare = Some(Tare::of(frames));
        if self.detection.threshold_sds.is_some() {
            self.rest.tare(frames);
        }
        (self.touching, self.against) = (false, 0);
    }

    /// Whether `frame` can say anything about contact.
    pub fn hears(&self, frame: &Frame) -> bool {
        let Some(tare) = &self.tare else { return false };
        let pressure = tare.pdc_counts.is_some() && frame.pdc_counts.is_some();
        let electrodes = tare.electrode_counts.is_some() && frame.electrode_counts.is_some();
        self.detection.by.is_heard(pressure, electrodes)
    }

    /// Whether the skin is touched, after another frame. One that says nothing changes nothing.
    ///
    /// Where n frames must agree on a threshold of T standard deviations, noise alarms Q(T)ⁿ times
    /// a frame by the electrodes. By the pressure it does so ∫ φ(u) Q(T √(1 + v) + u √v)ⁿ du times:
    /// all frames share the error u of a tare of 1/v frames.
    pub fn update(&mut self, frame: &Frame) -> bool {
        let Some(says) = self.says(frame) else { return self.touching };
        self.against = if says == self.touching { 0 } else { self.against + 1 };
        if self.against >= self.detection.frames {
            (self.touching, self.against) = (says, 0);
        }
        self.touching
    }

    /// Whether this frame alone says contact.
    fn says(&self, frame: &Frame) -> Option<bool> {
        if !self.hears(frame) {
            return None;
        }
        let Some(threshold_sds) = self.detection.threshold_sds else {
            let rest = self.tare.as_ref()?.pdc_counts?;
            return Some(frame.pdc_counts? - rest > self.detection.threshold_counts);
        };
        let Evidence { pressure, electrodes } = self.rest.evidence(frame);
        let [by_pressure, by_electrodes] = self.detection.by.by();
        let exceeds = |evidence: Option<f64>| evidence.is_some_and(|sds| sds > threshold_sds);
        Some(by_pressure && exceeds(pressure) || by_electrodes && exceeds(electrodes))
    }
}
