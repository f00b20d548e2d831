//! Writes down every command and reading, around any body.

use super::{Backend, Capabilities, Command, Fault, Reading};
use serde::Serialize;
use std::io::Write;

/// A body whose readings are written as JSON, one line each: for a reset
/// `{"reset": seed, "capabilities": …, "reading": …}`, for a tick `{"command": …, "reading": …}`,
/// and `{"command": …, "fault": text}` where it ends.
pub struct Recorder<W> {
    inner: Box<dyn Backend>,
    out: W,
    line: Vec<u8>,
    time_s: f64,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
struct Reset<'a> {
    reset: u64,
    capabilities: &'a Capabilities,
    reading: &'a Reading,
}

#[derive(Serialize)]
struct Tick<'a> {
    command: &'a Command,
    #[serde(skip_serializing_if = "Option::is_none")]
    reading: Option<&'a Reading>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<String>,
}

impl<W: Write + Send> Recorder<W> {
    /// Writes to `out`, which should be buffered.
    pub fn new(inner: Box<dyn Backend>, out: W) -> Self {
        Self { inner, out, line: Vec::new(), time_s: 0.0 }
    }
}

/// Appends `entry` through `line`, which is kept from tick to tick.
fn write(out: &mut impl Write, line: &mut Vec<u8>, entry: &impl Serialize) -> std::io::Result<()> {
    line.clear();
    serde_json::to_writer(&mut *line, entry)?;
    line.push(b'\n');
    out.write_all(line)
}

impl<W: Write + Send> Backend for Recorder<W> {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        let capabilities = self.inner.capabilities().clone();
        let reading = self.inner.reset(seed)?;
        self.time_s = reading.time_s;
        let entry = Reset { reset: seed, capabilities: &capabilities, reading };
        match write(&mut self.out, &mut self.line, &entry) {
            Ok(()) => Ok(reading),
            Err(error) => Err(lost(self.time_s, &error)),
        }
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let result = self.inner.step(command);
        let (reading, fault) = (result.as_ref().ok().copied(), result.as_ref().err());
        let entry = Tick { command, reading, fault: fault.map(Fault::to_string) };
        if let Err(error) = write(&mut self.out, &mut self.line, &entry) {
            return Err(lost(self.time_s, &error));
        }
        if let Ok(reading) = result {
            self.time_s = reading.time_s;
        }
        result
    }
}

fn lost(time_s: f64, error: &std::io::Error) -> Fault {
    Fault::Unrecorded { time_s, message: error.to_string() }
}
