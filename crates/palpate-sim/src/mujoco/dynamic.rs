//! Dynamic backend: an arm or stage with masses, servos and friction that carries the finger.

use super::{CompiledModels, Plant};
use crate::Environment;
use crate::simulated_finger::SimulatedFinger;
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, Reading, Sample, Wrench};
use palpate_explore::robot::arm::Chain;
use palpate_explore::robot::finger::TipMotion;
use std::sync::Arc;

// heuristic: a state has diverged this far beyond a joint's limits, rad or m (the stops are 0.05
// rad beyond, and are compliant), or this many times faster than its limit.
const LIMIT_EXCESS_MAX: f64 = 0.2;
const SPEED_RATIO_MAX: f64 = 5.0;

/// Backend of a [`Plant`] whose fingertip has a skin, if the scene has one.
pub struct DynamicBackend {
    chain: Chain,
    capabilities: Capabilities,
    plant: Plant,
    /// Soft finger; `None` for a finger without skin, which collides in MuJoCo.
    finger: Option<SimulatedFinger>,
    wrench: Wrench,
    steps: u32,
    tick: u64,
    reading: Reading,
}

impl DynamicBackend {
    /// Creates the backend at the chain's home.
    ///
    /// # Errors
    /// If the environment has no object.
    pub fn new(environment: &Arc<Environment>, models: &CompiledModels) -> Result<Self, Fault> {
        let chain = environment.chain().ok_or_else(|| Fault::lacks("an object"))?;
        let period_s = environment.scene().period_s();
        let mut body = Self {
            capabilities: Capabilities::simulated(&chain, period_s),
            plant: Plant::new(Arc::clone(&models.plant))?,
            finger: SimulatedFinger::new(Arc::clone(environment), 0),
            wrench: Wrench::default(),
            steps: (period_s / models.plant.opt().timestep).round() as u32,
            tick: 0,
            reading: Reading::default(),
            chain,
        };
        body.reset(0)?;
        Ok(body)
    }

    fn check(&self) -> Result<(), Fault> {
        let (q, qdot) = (self.plant.q(), self.plant.qdot());
        let plausible = self.chain.joints.iter().zip(q.iter().zip(qdot)).all(|(joint, (q, v))| {
            let [low, high] = joint.q_limits;
            (low - LIMIT_EXCESS_MAX..=high + LIMIT_EXCESS_MAX).contains(q)
                && v.abs() <= SPEED_RATIO_MAX * joint.qdot_limit
        });
        if plausible {
            return Ok(());
        }
        let state = q.iter().chain(qdot).copied().collect();
        Err(Fault::Diverged { time_s: self.plant.time_s(), state })
    }

    fn report(&mut self) {
        let Self { plant, reading, .. } = self;
        reading.time_s = self.tick as f64 * self.capabilities.period_s;
        reading.q.clear();
        reading.q.extend_from_slice(plant.q());
        reading.qdot.clear();
        reading.qdot.extend_from_slice(plant.qdot());
        match &mut self.finger {
            Some(finger) => {
                finger.write_reading(&plant.mount_wrench(), self.capabilities.period_s, reading)
            }
            None => {
                reading.samples.clear();
                reading.samples.extend(plant.contact().map(Sample::Ideal));
            }
        }
    }
}

impl Backend for DynamicBackend {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        let joints = self.chain.joints.len();
        self.plant.reset(self.chain.start())?;
        if let Some(finger) = &mut self.finger {
            finger.reset(seed);
        }
        (self.wrench, self.tick) = (Wrench::default(), 0);
        self.reading.applied.qdot.clear();
        self.reading.applied.qdot.resize(joints, 0.0);
        self.report();
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.capabilities.accept(command)?;
        // The servos get the command, clamped to the joints' speed limits.
        let within = command.qdot.iter().zip(&self.chain.joints);
        self.reading.applied.qdot.clear();
        self.reading
            .applied
            .qdot
            .extend(within.map(|(&qdot, joint)| qdot.clamp(-joint.qdot_limit, joint.qdot_limit)));
        let step_s = self.plant.step_s();
        for _ in 0..self.steps {
            // The skin's force at the start of the step is constant during it.
            self.plant.step(&self.reading.applied.qdot, &self.wrench)?;
            if let Some(finger) = &mut self.finger {
                let motion = TipMotion::moving(self.plant.tip(), &self.plant.tip_twist());
                self.wrench = finger.step(&motion, step_s)?;
            }
        }
        self.check()?;
        self.tick += 1;
        self.report();
        Ok(&self.reading)
    }

    fn brake(&mut self) {
        self.plant.brake();
    }
}
