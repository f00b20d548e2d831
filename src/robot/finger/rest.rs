//! A sensor at rest: what each channel reads, how much it scatters, and how far a frame is from it.

use super::contact_point::OPEN_COUNTS;
use super::frame::{ELECTRODES, FULL_SCALE_COUNTS, Frame};

/// Frames at rest over which the scatter of a channel is remembered, from one tare to the next;
/// chosen: one second, so that a channel that grows noisy is known to within twenty touches.
const MEMORY: f64 = 100.0;

/// Frames that tell how much a channel scatters; chosen: from here on the rate of false alarms is
/// that of many (`tests/suite/detection.rs`).
const LEARNT: usize = 20;

/// Least standard deviation of an electrode: rounding, and no recorded one has less than 1.5
/// (MiaoLi/syntouchcontact).
const LEAST_COUNTS: f64 = 1.0;

/// The same of PDC: recorded ones have up to half a count (RuihanGao/BioTacSP_setup).
const LEAST_PDC_COUNTS: f64 = 0.5;

/// Mean of every channel over the frames of the last tare, and its variance over those of the last
/// ones.
///
/// Electrodes drift together, as the fluid conducts better or worse: dE = E (1 − E/4095) d ln G. So
/// each is taken in its difference to the median change of ln G over all that are not open. Two
/// real sensors that nobody touches drift by 24 and 54 counts (standard deviations of means over
/// 20 s) and by 2 about that law, 3 and 7 about an equal change of counts; they scatter about it as
/// much over 20 s as over 20 ms (MiaoLi/syntouchcontact). A PDC at rest stays within a count for
/// 20 s (I-Quotient-Robotics/syntouch_btd_decode). So between two tares nothing else is followed,
/// and no contact is too slow.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rest {
    electrodes: Option<[Channel; ELECTRODES]>,
    pdc: Option<Channel>,
    /// Frames that the means are of.
    mean_of: f64,
    /// Frames less one for each tare that the variances are of.
    variance_of: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Channel {
    mean: f64,
    variance: f64,
}

/// How far a frame is from the sensor at rest, in standard deviations of the normal distribution;
/// none for a channel that either lacks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Of the pressure's rise.
    pub pressure: Option<f64>,
    /// Of all electrodes together, whichever way they change.
    pub electrodes: Option<f64>,
}

impl Rest {
    /// Frames that the next tare should have so that evidence is what it says.
    pub fn wants(&self) -> usize {
        LEARNT.saturating_sub(self.variance_of as usize)
    }

    /// Takes in untouched frames: the means are theirs, the variances become so by and by.
    pub fn tare(&mut self, frames: &[Frame]) {
        self.mean_of = 0.0;
        frames.iter().for_each(|frame| self.learn(frame));
    }

    fn learn(&mut self, frame: &Frame) {
        let has = [frame.electrode_counts.is_some(), frame.pdc_counts.is_some()];
        // A channel that comes or goes begins anew.
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

    /// How far `frame` is from rest.
    ///
    /// A channel's difference over its standard deviation, t, is Student's with as many degrees of
    /// freedom as frames tell of the latter, and is taken to the normal z of the same probability
    /// by z² = ν ln(1 + t²/ν) ((8ν + 1)/(8ν + 3))² (Wallace 1959). The mean of z² over n electrodes
    /// is χ²/ν' with ν' = n − 1, as the median change is taken out, and goes to a normal number by
    /// its cube root (Wilson and Hilferty 1931).
    pub fn evidence(&self, frame: &Frame) -> Evidence {
        if self.mean_of == 0.0 || self.variance_of == 0.0 {
            return Evidence::default();
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
        Evidence { pressure, electrodes }
    }

    /// Variance of one more frame about the mean, in that of one frame about the truth.
    fn alone(&self) -> f64 {
        1.0 + 1.0 / self.mean_of
    }
}

impl Channel {
    /// Whether it is no electrode that is open or at the end of its range.
    fn is_sound(&self) -> bool {
        (OPEN_COUNTS..FULL_SCALE_COUNTS - 1.0).contains(&self.mean)
    }

    /// Change of an electrode's counts for a change of ln G, of the voltage divider.
    fn sensitivity_counts(&self) -> f64 {
        self.mean * (1.0 - self.mean / FULL_SCALE_COUNTS)
    }
}

/// By how much ln G changed at the electrodes that are not open, in the middle.
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
