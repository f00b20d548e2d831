//! When a BioTac samples which channel, and when its frames arrive.

use super::effect::{Effect, Needs};
use super::switch::Switch;
use crate::backend::delay::DELAY_MAX_S;
use crate::config::{Checked, Rules};
use crate::robot::finger::frame::ELECTRODES;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A delay of commands that is more than a control tick of any body (chosen).
const LONG_DELAY_S: f64 = 0.02;

/// Table `[timing]`: channels are sampled one after the other, frames arrive in batches, commands
/// late. Without it a frame is sampled at once, every 10 ms, and arrives then, and a command holds
/// from the tick on in which it is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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

impl Effect for TimingEffect {
    type State = ();

    const NEEDS: Needs = Needs::Frames;

    fn start(&self) {}

    /// All of it, and a delay of commands alone: with frames as near to those without timing as a
    /// table can say it, each by itself.
    fn switches() -> Vec<Switch<Option<Self>>> {
        let is_on =
            |timing: &Option<Self>| timing.as_ref().is_some_and(|t| t.control_delay_s > 0.0);
        let set = |timing: &mut Option<Self>, on| match (timing, on) {
            (Some(timing), true) => timing.control_delay_s = LONG_DELAY_S,
            (Some(timing), false) => timing.control_delay_s = 0.0,
            (timing, true) => {
                *timing = Some(Self { batch_frames: 1, control_delay_s: LONG_DELAY_S });
            }
            (None, false) => {}
        };
        vec![Switch::table(), Switch::new("control_delay_s", is_on, set)]
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
