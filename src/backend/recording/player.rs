//! A body that plays a recording.

use super::recorded::{Recorded, Ticks};
use crate::backend::{Backend, Capabilities, Command, Fault, Reading};

/// A body that returns what was read, as long as it is told what was told: every bit of every
/// command is compared.
pub struct Player {
    recorded: Recorded,
    ticks: Ticks,
    reading: Reading,
}

impl Player {
    /// Plays `recorded`.
    pub fn new(recorded: Recorded) -> Self {
        let ticks = recorded.ticks();
        Self { recorded, ticks, reading: Reading::default() }
    }
}

impl Backend for Player {
    fn capabilities(&self) -> &Capabilities {
        &self.recorded.about.capabilities
    }

    /// Goes back to the first reset with that seed.
    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.ticks = self.recorded.ticks();
        let mut resets = self.ticks.by_ref().filter(|tick| tick.is_reset());
        let reset = resets.find(|tick| tick.seed == seed).ok_or(Fault::NeverReset { seed })?;
        reset.write_to(&mut self.reading);
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let time_s = self.reading.time_s;
        let tick = self.ticks.next().filter(|tick| !tick.is_reset());
        let tick = tick.ok_or(Fault::RecordingEnds { time_s })?;
        compare(&tick.command, &command.qdot).map_err(|(joint, recorded, now)| Fault::Differs {
            tick: tick.tick,
            time_s,
            joint,
            recorded,
            now,
        })?;
        if !tick.fault.is_empty() {
            return Err(Fault::Recorded { message: tick.fault.into_owned() });
        }
        tick.write_to(&mut self.reading);
        Ok(&self.reading)
    }
}

/// The first joint whose bits differ, with both values; one that only one of them has is not a
/// number in the other.
fn compare(recorded: &[f64], now: &[f64]) -> Result<(), (usize, f64, f64)> {
    let value = |list: &[f64], joint| list.get(joint).copied().unwrap_or(f64::NAN);
    for joint in 0..recorded.len().max(now.len()) {
        let pair = (value(recorded, joint), value(now, joint));
        let both = joint < recorded.len().min(now.len());
        if !both || pair.0.to_bits() != pair.1.to_bits() {
            return Err((joint, pair.0, pair.1));
        }
    }
    Ok(())
}
