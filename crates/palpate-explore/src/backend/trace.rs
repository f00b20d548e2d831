//! Trace of a backend's motion during a touch.

use crate::backend::{Backend, Capabilities, Command, Fault, Reading};
use crate::robot::arm::Chain;
use crate::robot::finger::TipMotion;
use std::sync::{Arc, Mutex, PoisonError};

/// One control tick.
#[derive(Clone, Debug)]
pub struct Tick {
    /// Time since reset, s.
    pub time_s: f64,
    /// Pose and velocity of the fingertip.
    pub motion: TipMotion,
}

/// The ticks of a backend so far, shared with its readers.
#[derive(Clone, Debug, Default)]
pub struct Ticks(Arc<Mutex<Vec<Tick>>>);

impl Ticks {
    /// Returns the ticks since the last call.
    pub fn take(&self) -> Vec<Tick> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn push(&self, tick: Tick) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(tick);
    }
}

/// A backend that records its ticks.
pub struct TracedBackend {
    inner: Box<dyn Backend>,
    chain: Chain,
    ticks: Ticks,
}

impl TracedBackend {
    /// Wraps `inner`, which moves `chain`.
    pub fn new(inner: Box<dyn Backend>, chain: Chain) -> (Self, Ticks) {
        let ticks = Ticks::default();
        (Self { inner, chain, ticks: ticks.clone() }, ticks)
    }
}

impl Backend for TracedBackend {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.inner.reset(seed)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let reading = self.inner.step(command)?;
        let joints = self.chain.joints_from(&reading.q).zip(self.chain.joints_from(&reading.qdot));
        if let Some((q, qdot)) = joints {
            let (x_wt, jacobian) = self.chain.jacobian(&q);
            let motion = TipMotion::moving(x_wt, &(jacobian * qdot));
            self.ticks.push(Tick { time_s: reading.time_s, motion });
        }
        Ok(reading)
    }
}
