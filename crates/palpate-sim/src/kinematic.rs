//! Kinematic backend: an arm or stage that moves exactly as commanded and carries the soft finger.

use super::simulated_finger::SimulatedFinger;
use crate::Environment;
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, Reading, Wrench};
use palpate_explore::robot::arm::{Chain, Joints};
use palpate_explore::robot::finger::TipMotion;
use std::sync::Arc;

/// Backend without masses or servos: joint positions are the integral of the commanded velocities.
pub struct KinematicBackend {
    chain: Chain,
    capabilities: Capabilities,
    finger: SimulatedFinger,
    q: Joints,
    tick: u64,
    reading: Reading,
}

impl KinematicBackend {
    /// Creates the backend at the chain's home.
    ///
    /// # Errors
    /// If the environment has no object or no soft finger.
    pub fn new(environment: &Arc<Environment>) -> Result<Self, Fault> {
        let chain = environment.chain().ok_or_else(|| Fault::lacks("an object"))?;
        let finger = SimulatedFinger::new(Arc::clone(environment), 0);
        let finger = finger.ok_or_else(|| Fault::lacks("a soft finger"))?;
        let capabilities = Capabilities::simulated(&chain, environment.scene().period_s());
        let q = chain.home;
        let mut body =
            Self { chain, capabilities, finger, q, tick: 0, reading: Reading::default() };
        body.reset(0)?;
        Ok(body)
    }

    fn report(&mut self, load: &Wrench, qdot: &Joints) {
        let joints = self.chain.joints.len();
        let copy = |to: &mut Vec<f64>, from: &Joints| {
            to.clear();
            to.extend(from.iter().take(joints));
        };
        self.reading.time_s = self.tick as f64 * self.capabilities.period_s;
        copy(&mut self.reading.q, &self.q);
        copy(&mut self.reading.qdot, qdot);
        copy(&mut self.reading.applied.qdot, qdot);
        self.finger.write_reading(load, self.capabilities.period_s, &mut self.reading);
    }
}

impl Backend for KinematicBackend {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.finger.reset(seed);
        self.q = self.chain.home;
        self.tick = 0;
        self.report(&Wrench::default(), &Joints::zeros());
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let wanted = self.capabilities.accept(command)?;
        let period_s = self.capabilities.period_s;
        let mut qdot = wanted;
        for (joint, qdot) in self.chain.joints.iter().zip(qdot.iter_mut()) {
            *qdot = qdot.clamp(-joint.qdot_limit, joint.qdot_limit);
        }
        let q = self.chain.clamp(&(self.q + qdot * period_s));
        let qdot = (q - self.q) / period_s;
        let (x_wt, jacobian) = self.chain.jacobian(&q);
        let motion = TipMotion::moving(x_wt, &(jacobian * qdot));
        let load = self.finger.step(&motion, period_s)?;
        self.q = q;
        self.tick += 1;
        self.report(&load, &qdot);
        Ok(&self.reading)
    }
}
