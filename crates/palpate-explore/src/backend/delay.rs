//! Commands that take effect late, around any body.

use super::{Backend, Capabilities, Command, Fault, Reading};
use std::collections::VecDeque;

/// Longest delay of a command; chosen, far beyond what the controller stands.
pub const DELAY_MAX_S: f64 = 1.0;

/// A body that hears every command some ticks after it was given; until the first arrives it is
/// told to stand still.
pub struct Delayed {
    inner: Box<dyn Backend>,
    ticks: usize,
    /// Commands on their way, oldest first.
    waiting: VecDeque<Command>,
}

impl Delayed {
    /// `delay_s`, at most a second, is rounded to whole periods of the body.
    pub fn new(inner: Box<dyn Backend>, delay_s: f64) -> Self {
        let ticks = (delay_s.clamp(0.0, DELAY_MAX_S) / inner.capabilities().period_s).round();
        let mut body = Self { inner, ticks: ticks as usize, waiting: VecDeque::new() };
        body.empty();
        body
    }

    fn empty(&mut self) {
        let still = Command { qdot: vec![0.0; self.capabilities().joints.len()] };
        self.waiting.clear();
        self.waiting.resize(self.ticks, still);
    }
}

impl Backend for Delayed {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.empty();
        self.inner.reset(seed)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        // Refused when given, not when it takes effect.
        self.inner.capabilities().accept(command)?;
        let Some(mut slot) = self.waiting.pop_front() else { return self.inner.step(command) };
        let reading = self.inner.step(&slot);
        slot.qdot.clone_from(&command.qdot);
        self.waiting.push_back(slot);
        reading
    }

    /// Brakes need nobody's command.
    fn brake(&mut self) {
        self.inner.brake();
    }
}
