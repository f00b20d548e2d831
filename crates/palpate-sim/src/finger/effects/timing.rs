//! Sampling times of a BioTac's channels, and arrival times of its frames.

use super::constants::effect;
use super::effect::{Effect, EffectSwitch, Requirement};
use palpate_explore::backend::delay::DELAY_MAX_S;
use palpate_explore::robot::finger::frame::ELECTRODES;
use palpate_input::config::Rules;

// heuristic: a command delay longer than a control tick of any simulator.
const LONG_DELAY_S: f64 = 0.02;

effect! {
    /// Table `[timing]`: channels are sampled one after the other, frames arrive in batches,
    /// commands act late. Without it, all channels of a frame are sampled at once, every 10 ms, and
    /// the frame arrives immediately; a command acts from the tick in which it is given.
    TimingEffect in "timing"
    settings checked by check_timing {
        /// Delay from a command to its effect, rounded to whole control periods.
        control_delay_s: f64 = 0.002,
    }
    constants {
        /// Number of frames that arrive together, when the last of them is complete.
        batch_frames: usize;
    }
}

fn check_timing(timing: &TimingEffect, rules: &mut Rules) {
    rules.number("control_delay_s", timing.control_delay_s, 0.0..=DELAY_MAX_S);
    rules.number("batch_frames", timing.batch_frames as f64, 1.0..=100.0);
}

impl Effect for TimingEffect {
    type State = ();

    const REQUIRES: Requirement = Requirement::Frames;

    /// Returns two switches: the whole effect, and the command delay alone.
    fn switches() -> Vec<EffectSwitch<Option<Self>>> {
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
        vec![EffectSwitch::table(), EffectSwitch::new("control_delay_s", is_on, set)]
    }
}

/// Channel sampled in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Electrode; E1 is 0.
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

/// Returns the channel of a slot, 0 to 43.
pub fn channel(slot: usize) -> Channel {
    match slot / 2 {
        pair if slot % 2 == 1 => Channel::Pac(pair),
        pair if pair < ELECTRODES => Channel::Electrode(pair),
        19 => Channel::Pdc,
        20 => Channel::Tac,
        _ => Channel::Tdc,
    }
}
