//! Readings of a body during touches.

use palpate::backend::{Backend, Capabilities, Command, Fault, Reading};
use std::sync::{Arc, Mutex};

/// Wrapper that keeps every reading of a body.
pub struct Tap {
    /// Body that moves.
    pub inner: Box<dyn Backend>,
    /// Its readings so far.
    pub readings: Arc<Mutex<Vec<Reading>>>,
}

impl Backend for Tap {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.inner.reset(seed)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let reading = self.inner.step(command)?;
        self.readings.lock().unwrap().push(reading.clone());
        Ok(reading)
    }
}
