//! Backend wrapper that delays commands.

use super::{Backend, Capabilities, Command, Fault, Reading};
use std::collections::VecDeque;

/// Largest delay of a command; a heuristic: far beyond the controller's stability limit.
pub const DELAY_MAX_S: f64 = 1.0;

/// A backend that delays every command by some ticks; before the first command takes effect, the
/// robot is commanded to rest.
pub struct DelayedBackend {
    inner: Box<dyn Backend>,
    ticks: usize,
    /// Pending commands, oldest first.
    waiting: VecDeque<Command>,
}

impl DelayedBackend {
    /// Wraps `inner` with a delay of `delay_s`, at most one second, rounded to whole periods.
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

impl Backend for DelayedBackend {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.empty();
        self.inner.reset(seed)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        // Invalid commands are refused on arrival, not when they take effect.
        self.inner.capabilities().accept(command)?;
        let Some(mut slot) = self.waiting.pop_front() else { return self.inner.step(command) };
        let reading = self.inner.step(&slot);
        slot.qdot.clone_from(&command.qdot);
        self.waiting.push_back(slot);
        reading
    }

    /// Brakes are not delayed.
    fn brake(&mut self) {
        self.inner.brake();
    }
}
