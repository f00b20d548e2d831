//! When a BioTac samples which channel, and when its frames arrive.

use crate::backend::delay::DELAY_MAX_S;
use crate::config::{Checked, Rules};
use crate::robot::finger::frame::ELECTRODES;
use serde::{Deserialize, Serialize};

/// Table `[timing]`: channels are sampled one after the other, frames arrive in batches, commands
/// late. Without it a frame is sampled at once, every 10 ms, and arrives then, and a command holds
/// from the tick on in which it is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TimingEffect {
    /// Frames that arrive together, when the last of them is complete.
    pub batch_frames: usize,
    /// From a command to its effect, rounded to whole control periods.
    pub control_delay_s: f64,
}

impl Default for TimingEffect {
    /// Batch: SynTouch C library manual, 5 frames, 50 ms. Delay: chosen, a cycle of the PA-10's
    /// servo driver.
    fn default() -> Self {
        Self { batch_frames: 5, control_delay_s: 0.002 }
    }
}

impl Checked for TimingEffect {
    fn check(&self, rules: &mut Rules) {
        rules.require(
            "batch_frames",
            self.batch_frames,
            (1..=100).contains(&self.batch_frames),
            || "1 to 100".into(),
        );
        rules.number("control_delay_s", self.control_delay_s, 0.0..=DELAY_MAX_S);
    }
}

/// What a slot samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// An electrode; E1 is 0.
    Electrode(usize),
    /// Dynamic pressure; the first in a frame is 0.
    Pac(usize),
    /// Static pressure.
    Pdc,
    /// Change of temperature.
    Tac,
    /// Temperature.
    Tdc,
}

/// The channel of a slot, 0 to 43.
pub fn channel(slot: usize) -> Channel {
    match slot / 2 {
        pair if slot % 2 == 1 => Channel::Pac(pair),
        pair if pair < ELECTRODES => Channel::Electrode(pair),
        19 => Channel::Pdc,
        20 => Channel::Tac,
        _ => Channel::Tdc,
    }
}
