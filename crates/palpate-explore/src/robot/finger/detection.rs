//! Contact detection from tactile frames: the deviation of a frame from the sensor at rest,
//! relative to the stored mean and scatter of each channel.

use super::contact_point::OPEN_COUNTS;
use super::frame::{ELECTRODES, FULL_SCALE_COUNTS, Frame};
use palpate_input::config::{Rules, Validate, is_default};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Channels that detect contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactChannels {
    /// The fluid's pressure (PDC).
    #[default]
    Pressure,
    /// The electrodes, by changes that differ from their common drift.
    Electrodes,
    /// Pressure or electrodes.
    Both,
}

impl ContactChannels {
    /// Whether a sensor with these channels supports this detection.
    pub fn is_supported(self, pressure: bool, electrodes: bool) -> bool {
        let [by_pressure, by_electrodes] = self.by();
        by_pressure && pressure || by_electrodes && electrodes
    }

    fn by(self) -> [bool; 2] {
        [self != Self::Electrodes, self != Self::Pressure]
    }
}

/// Settings of contact detection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Detection {
    /// Channels that detect contact; electrodes require `threshold_sds`.
    #[serde(skip_serializing_if = "is_default")]
    pub by: ContactChannels,
    /// Threshold of PDC above its tare, counts; ignored with `threshold_sds`.
    pub threshold_counts: f64,
    /// Threshold in standard deviations of the sensor's noise at rest; `threshold_counts` is used
    /// if omitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold_sds: Option<f64>,
    /// Number of consecutive frames that must agree.
    pub frames: u32,
}

impl Default for Detection {
    /// Returns the default detection. Threshold: tams_biotac and balakumar-s/biotac_force_net.
    /// Frames: a heuristic, 30 ms; the latter waits for 10.
    fn default() -> Self {
        Self {
            by: ContactChannels::Pressure,
            threshold_counts: 10.0,
            threshold_sds: None,
            frames: 3,
        }
    }
}

impl Validate for Detection {
    fn check(&self, rules: &mut Rules) {
        rules.number("threshold_counts", self.threshold_counts, 0.0..=FULL_SCALE_COUNTS);
        if let Some(threshold_sds) = self.threshold_sds {
            rules.number("threshold_sds", threshold_sds, 1.0..=100.0);
        }
        let is_told = self.by == ContactChannels::Pressure || self.threshold_sds.is_some();
        rules.require("threshold_sds", "(none)", is_told, || {
            "a number, since detection by electrodes needs a threshold in standard deviations"
                .into()
        });
        rules.require("frames", self.frames, (1..=1000).contains(&self.frames), || {
            "1 to 1000".into()
        });
    }
}

/// Contact detector; its state changes only when enough consecutive frames agree.
#[derive(Clone, Debug)]
pub struct Detector {
    detection: Detection,
    tare: Option<Frame>,
    rest: RestState,
    touching: bool,
    against: u32,
}

impl Detector {
    /// Creates a detector without data of a sensor.
    pub fn new(detection: Detection) -> Self {
        Self { detection, tare: None, rest: RestState::default(), touching: false, against: 0 }
    }

    /// Smallest number of frames at rest for the next [`tare`](Self::tare).
    pub fn tare_frame_count(&self) -> usize {
        self.detection.threshold_sds.map_or(0, |_| self.rest.tare_frame_count())
    }

    /// Sets the rest state to the mean of `frames`, without contact. The scatter is accumulated
    /// over tares.
    pub fn tare(&mut self, frames: &[Frame]) {
        self.tare = Some(Frame::mean(frames));
        if self.detection.threshold_sds.is_some() {
            self.rest.tare(frames);
        }
        (self.touching, self.against) = (false, 0);
    }

    /// Whether `frame` has a channel that is used for detection.
    pub fn has_channel(&self, frame: &Frame) -> bool {
        let Some(tare) = &self.tare else { return false };
        let pressure = tare.pdc_counts.is_some() && frame.pdc_counts.is_some();
        let electrodes = tare.electrode_counts.is_some() && frame.electrode_counts.is_some();
        self.detection.by.is_supported(pressure, electrodes)
    }

    /// Updates with a frame and returns whether there is contact. A frame without usable channels
    /// changes nothing.
    ///
    /// If n frames must agree on a threshold of T standard deviations, the rate of false alarms per
    /// frame is Q(T)ⁿ for the electrodes, and ∫ φ(u) Q(T √(1 + v) + u √v)ⁿ du for the pressure: all
    /// frames share the error u of a tare of 1/v frames.
    pub fn update(&mut self, frame: &Frame) -> bool {
        let Some(says) = self.is_contact(frame) else { return self.touching };
        self.against = if says == self.touching { 0 } else { self.against + 1 };
        if self.against >= self.detection.frames {
            (self.touching, self.against) = (says, 0);
        }
        self.touching
    }

    /// Whether this frame alone indicates contact.
    fn is_contact(&self, frame: &Frame) -> Option<bool> {
        if !self.has_channel(frame) {
            return None;
        }
        let Some(threshold_sds) = self.detection.threshold_sds else {
            let rest = self.tare.as_ref()?.pdc_counts?;
            return Some(frame.pdc_counts? - rest > self.detection.threshold_counts);
        };
        let [pressure, electrodes] = self.rest.evidence(frame);
        let [by_pressure, by_electrodes] = self.detection.by.by();
        let exceeds = |evidence: Option<f64>| evidence.is_some_and(|sds| sds > threshold_sds);
        Some(by_pressure && exceeds(pressure) || by_electrodes && exceeds(electrodes))
    }
}

/// Number of frames at rest over which a channel's scatter is averaged across tares; a heuristic:
/// one second, so that an increase of a channel's noise is followed within twenty touches.
const MEMORY: f64 = 100.0;

/// Number of frames required for a channel's scatter; a heuristic: from here on the false-alarm
/// rate equals that with many frames (`tests/suite/detection.rs`).
const LEARNT: usize = 20;

/// Smallest standard deviation of an electrode, counts: rounding; no recorded one has less than 1.5
/// (MiaoLi/syntouchcontact).
const LEAST_COUNTS: f64 = 1.0;

/// Smallest standard deviation of PDC, counts: recorded ones have up to 0.5
/// (RuihanGao/BioTacSP_setup).
const LEAST_PDC_COUNTS: f64 = 0.5;

/// Rest state: mean of every channel over the frames of the last tare, and its variance over recent
/// tares.
///
/// Electrodes drift together with the conductivity of the fluid: dE = E (1 − E/4095) d ln G.
/// Therefore each is compared with the median change of ln G over all that are not open. Two real
/// sensors at rest drift by 24 and 54 counts (standard deviations of means over 20 s), by 2 about
/// this law, and by 3 and 7 about an equal change of counts; they scatter about it as much over 20
/// s as over 20 ms (MiaoLi/syntouchcontact). PDC at rest stays within a count for 20 s
/// (I-Quotient-Robotics/syntouch_btd_decode). No other drift is compensated between two tares, so
/// slow contacts are detected too.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestState {
    electrodes: Option<[Channel; ELECTRODES]>,
    pdc: Option<Channel>,
    /// Number of frames averaged in the means.
    mean_of: f64,
    /// Degrees of freedom of the variances: number of frames minus one per tare.
    variance_of: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Channel {
    mean: f64,
    variance: f64,
}

impl RestState {
    /// Number of frames that the next tare needs for valid evidence.
    pub fn tare_frame_count(&self) -> usize {
        LEARNT.saturating_sub(self.variance_of as usize)
    }

    /// Updates with frames at rest: sets the means to theirs, and the variances gradually.
    pub fn tare(&mut self, frames: &[Frame]) {
        self.mean_of = 0.0;
        frames.iter().for_each(|frame| self.learn(frame));
    }

    fn learn(&mut self, frame: &Frame) {
        let has = [frame.electrode_counts.is_some(), frame.pdc_counts.is_some()];
        // A channel that appears or disappears starts anew.
        if [self.electrodes.is_some(), self.pdc.is_some()] != has {
            *self = Self::default();
        }
        let first = self.mean_of == 0.0;
        let to_mean = 1.0 / (self.mean_of + 1.0);
        let to_variance = 1.0 / (self.variance_of + 1.0).min(MEMORY);
        let alone = self.alone();
        let learn = |channel: &mut Channel, off: f64, moved: f64| {
            if !first {
                channel.variance += to_variance * (off * off / alone - channel.variance);
            }
            channel.mean += to_mean * moved;
        };
        if let Some(now) = frame.electrode_counts {
            let channels = self.electrodes.get_or_insert_default();
            let moved: [f64; ELECTRODES] = std::array::from_fn(|i| now[i] - channels[i].mean);
            let common = common_change(channels, &moved);
            for (channel, moved) in channels.iter_mut().zip(moved) {
                learn(channel, moved - common * channel.sensitivity_counts(), moved);
            }
        }
        if let Some(now) = frame.pdc_counts {
            let channel = self.pdc.get_or_insert_default();
            let moved = now - channel.mean;
            learn(channel, moved, moved);
        }
        self.mean_of += 1.0;
        self.variance_of += f64::from(u8::from(!first));
    }

    /// Computes the evidence of contact, in standard deviations of a normal distribution, from the
    /// pressure and from all electrodes.
    ///
    /// A channel's difference over its standard deviation, t, follows Student's distribution with
    /// as many degrees of freedom as frames determine the latter, and is mapped to the normal z of
    /// the same probability by z² = ν ln(1 + t²/ν) ((8ν + 1)/(8ν + 3))² (Wallace 1959). The mean of
    /// z² over n electrodes is χ²/ν' with ν' = n − 1, since the median change is removed, and is
    /// mapped to a normal variable by its cube root (Wilson and Hilferty 1931).
    pub fn evidence(&self, frame: &Frame) -> [Option<f64>; 2] {
        if self.mean_of == 0.0 || self.variance_of == 0.0 {
            return [None; 2];
        }
        let alone = self.alone();
        let freedom = self.variance_of.min(2.0 * MEMORY - 1.0);
        let squared = |channel: &Channel, off: f64, least: f64| {
            let variance = channel.variance.max(least * least);
            let squared = freedom * (off * off / (alone * variance * freedom)).ln_1p();
            squared * ((8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)).powi(2)
        };
        let pressure = self.pdc.zip(frame.pdc_counts).map(|(channel, now)| {
            let rise = now - channel.mean;
            squared(&channel, rise, LEAST_PDC_COUNTS).sqrt().copysign(rise)
        });
        let electrodes = self.electrodes.zip(frame.electrode_counts).and_then(|(channels, now)| {
            let moved = std::array::from_fn(|i| now[i] - channels[i].mean);
            let common = common_change(&channels, &moved);
            let (mut sum, mut count) = (0.0, 0.0);
            for (channel, moved) in channels.iter().zip(moved).filter(|(one, _)| one.is_sound()) {
                let own = moved - common * channel.sensitivity_counts();
                sum += squared(channel, own, LEAST_COUNTS);
                count += 1.0;
            }
            let ninth = 2.0 / (9.0 * (count - 1.0));
            (count > 1.0).then(|| ((sum / count).cbrt() - (1.0 - ninth)) / ninth.sqrt())
        });
        [pressure, electrodes]
    }

    /// Variance of a new frame about the mean, in units of the variance of one frame about the true
    /// value.
    fn alone(&self) -> f64 {
        1.0 + 1.0 / self.mean_of
    }
}

impl Channel {
    /// Whether the electrode is neither open nor at the end of its range.
    fn is_sound(&self) -> bool {
        (OPEN_COUNTS..FULL_SCALE_COUNTS - 1.0).contains(&self.mean)
    }

    /// Derivative of an electrode's counts by ln G, from the voltage divider.
    fn sensitivity_counts(&self) -> f64 {
        self.mean * (1.0 - self.mean / FULL_SCALE_COUNTS)
    }
}

/// Median change of ln G over the electrodes that are not open.
fn common_change(channels: &[Channel; ELECTRODES], moved: &[f64; ELECTRODES]) -> f64 {
    let mut sorted = [0.0; ELECTRODES];
    let mut count = 0;
    for (channel, moved) in channels.iter().zip(moved).filter(|(one, _)| one.is_sound()) {
        sorted[count] = moved / channel.sensitivity_counts();
        count += 1;
    }
    let sorted = &mut sorted[..count];
    sorted.sort_unstable_by(f64::total_cmp);
    match count {
        0 => 0.0,
        _ => 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]),
    }
}
