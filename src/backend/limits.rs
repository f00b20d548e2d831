//! The last line before a body moves: limits, and a watchdog.

use super::{Backend, Capabilities, Command, Fault, Reading};
use crate::robot::arm::Chain;

/// Ticks without progress of the body's time after which it counts as lost: three cycles, as the
/// PA-10's own watchdog has it (`hydro`, Orca robotics).
const SILENT_TICKS: u32 = 3;

/// What a limit may be exceeded by before it is applied: rounding, so that a command within the
/// limits passes unchanged.
const ROUNDING: f64 = 1e-9;

/// Holds every joint of a body, one by one, to its limits of speed and acceleration and lets it
/// brake before its limit of position. After a fault it moves no more until it is reset.
///
/// The controller keeps these limits along the tip's direction; this body keeps them whatever
/// it is told.
pub struct Limited {
    inner: Box<dyn Backend>,
    chain: Chain,
    /// What was commanded last.
    command: Command,
    q: Vec<f64>,
    time_s: f64,
    silent_ticks: u32,
    fault: Option<Fault>,
}

impl Limited {
    /// `inner` moves the joints of `chain`.
    ///
    /// # Errors
    /// [`Fault::Joints`] if their numbers of joints differ.
    pub fn new(inner: Box<dyn Backend>, chain: Chain) -> Result<Self, Fault> {
        inner.capabilities().fit(&chain)?;
        let command = Command { qdot: vec![0.0; chain.joints.len()] };
        let q = chain.start().to_vec();
        Ok(Self { inner, chain, command, q, time_s: 0.0, silent_ticks: 0, fault: None })
    }

    fn limit(&mut self, wanted: &Command) {
        let period_s = self.inner.capabilities().period_s;
        let joints = self.chain.joints.iter().zip(self.q.iter().zip(&wanted.qdot));
        for ((joint, (&q, &wanted)), now) in joints.zip(&mut self.command.qdot) {
            let step = joint.qddot_limit * period_s;
            let allowed = joint.fastest(q, wanted, period_s) * (1.0 + ROUNDING);
            let slow = wanted.clamp(-allowed, allowed);
            *now = match (slow - *now).abs() <= step * (1.0 + ROUNDING) {
                true => slow,
                false => *now + step.copysign(slow - *now),
            };
        }
    }
}

impl Backend for Limited {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        let reading = self.inner.reset(seed)?;
        self.q.clone_from(&reading.q);
        self.time_s = reading.time_s;
        self.command.qdot.fill(0.0);
        (self.silent_ticks, self.fault) = (0, None);
        Ok(reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        self.inner.capabilities().accept(command)?;
        self.limit(command);
        let reading = match self.inner.step(&self.command) {
            Ok(reading) => reading,
            Err(fault) => {
                self.fault = Some(fault.clone());
                return Err(fault);
            }
        };
        self.silent_ticks = if reading.time_s > self.time_s { 0 } else { self.silent_ticks + 1 };
        if let Err(fault) = reading.check() {
            self.fault = Some(fault);
        } else if reading.q.len() != self.q.len() {
            self.fault = Some(Fault::Joints { expected: self.q.len(), found: reading.q.len() });
        } else if self.silent_ticks >= SILENT_TICKS {
            self.fault = Some(Fault::Lost { time_s: self.time_s });
        }
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        self.time_s = reading.time_s;
        self.q.clone_from(&reading.q);
        Ok(reading)
    }
}
