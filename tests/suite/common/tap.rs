//! Readings of a body during touches.

use palpate::backend::{Backend, Capabilities, Command, Fault, Reading};
use palpate::robot::sensor::Sample;
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

/// Returns the force of each reading of a simulated finger without a sensor, N; 0 without contact.
pub fn forces_n(readings: &[Reading]) -> Vec<f64> {
    let force_n = |reading: &Reading| {
        reading.samples.iter().find_map(|sample| match sample {
            Sample::Ideal(contact) => Some(contact.force_n),
            _ => None,
        })
    };
    readings.iter().map(|reading| force_n(reading).unwrap_or(0.0)).collect()
}
