//! An arm or stage with masses, servos and friction, carrying the finger.

use super::{Flex, ModelError, Plant, compile};
use crate::bodies::backend::{Backend, Capabilities, Command, Fault, Reading, Wrench};
use crate::bodies::sense::Sense;
use crate::things::arm::Chain;
use crate::things::finger::{Motion, stiffness};
use crate::world::World;
use crate::world::collision::Collision;
use crate::world::mjcf::{self, Mode};
use crate::world::world::{APPROACH_W, Shape};
use mujoco_rs::wrappers::MjModel;
use std::sync::Arc;

/// A state counts as diverged this far beyond a joint's limits, rad or m (the stops stand 0.05 rad
/// beyond, and give), or this many times faster than its limit; chosen.
const BEYOND: f64 = 0.2;
const FASTER: f64 = 5.0;

/// A [`Plant`] whose fingertip carries the skin, if the scene has one.
pub struct Dynamic {
    chain: Chain,
    capabilities: Capabilities,
    plant: Plant,
    /// None for a finger without skin, which MuJoCo lets collide.
    sense: Option<Sense>,
    wrench: Wrench,
    steps: u32,
    tick: u64,
    reading: Reading,
}

/// What MuJoCo compiles of a world, once for all trials.
#[derive(Clone)]
pub struct Models {
    /// The arm or stage.
    pub plant: Arc<MjModel>,
    /// The skin of `[effects.flex]`.
    pub flex: Option<Arc<MjModel>>,
}

impl Dynamic {
    /// The world's models.
    ///
    /// # Errors
    /// If MuJoCo refuses it, the scene's time step is too long for its skin, or the object has no
    /// inside where the scene's collision needs one.
    pub fn models(world: &World) -> Result<Models, ModelError> {
        let step_s = world.scene().solver.step_s;
        check_inside(world)?;
        let text = mjcf::scene(world, Mode::Dynamic { step_s });
        let plant = Arc::new(compile(&text.ok_or(ModelError::Lacks { part: "an object" })?)?);
        check_step(world, &plant, step_s)?;
        Ok(Models { plant, flex: Flex::model(world)? })
    }

    /// At the chain's home; none without memory or in a world of another body.
    pub fn new(world: &Arc<World>, models: &Models) -> Option<Self> {
        let chain = world.chain()?;
        let scene = world.scene();
        let period_s = scene.period_s();
        let mut sense = Sense::new(Arc::clone(world), 0);
        if let (Some(sense), Some(model)) = (&mut sense, &models.flex) {
            sense.wear(Box::new(Flex::new(Arc::clone(world), Arc::clone(model)).ok()?));
        }
        let mut body = Self {
            capabilities: Capabilities::of(&chain, period_s),
            plant: Plant::new(Arc::clone(&models.plant)).ok()?,
            sense,
            wrench: Wrench::default(),
            steps: scene.solver.steps(period_s)?,
            tick: 0,
            reading: Reading::default(),
            chain,
        };
        body.reset(0).ok()?;
        Some(body)
    }

    /// What the servos are told: `command` within the joints' speeds.
    fn apply(&mut self, command: &Command) {
        let applied = &mut self.reading.applied.qdot;
        applied.clear();
        applied.extend(
            command
                .qdot
                .iter()
                .zip(&self.chain.joints)
                .map(|(&qdot, joint)| qdot.clamp(-joint.qdot_limit, joint.qdot_limit)),
        );
    }

    /// One step of plant and skin: the skin's force is that at the start of the step.
    fn advance(&mut self) -> Result<(), Fault> {
        let step_s = self.plant.step_s();
        self.plant.step(&self.reading.applied.qdot, &self.wrench)?;
        let Some(sense) = &mut self.sense else { return Ok(()) };
        let motion = Motion::moving(self.plant.tip(), &self.plant.tip_twist());
        self.wrench = sense.step(&motion, step_s)?;
        Ok(())
    }

    fn check(&self) -> Result<(), Fault> {
        let (q, qdot) = (self.plant.q(), self.plant.qdot());
        let plausible = self.chain.joints.iter().zip(q.iter().zip(qdot)).all(|(joint, (q, v))| {
            let [low, high] = joint.q_limits;
            (low - BEYOND..=high + BEYOND).contains(q) && v.abs() <= FASTER * joint.qdot_limit
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
        match &mut self.sense {
            Some(sense) => sense.report(&plant.mount(), self.capabilities.period_s, reading),
            None => reading.ideal = plant.contact(),
        }
    }
}

impl Backend for Dynamic {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        let joints = self.chain.joints.len();
        self.plant.reset(self.chain.start())?;
        if let Some(sense) = &mut self.sense {
            sense.reset(seed);
        }
        (self.wrench, self.tick) = (Wrench::default(), 0);
        self.reading.applied.qdot.clear();
        self.reading.applied.qdot.resize(joints, 0.0);
        self.report();
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.capabilities.accept(command)?;
        self.apply(command);
        for _ in 0..self.steps {
            self.advance()?;
        }
        self.check()?;
        self.tick += 1;
        self.report();
        Ok(&self.reading)
    }
}

/// Without an inside a distance has no sign.
fn check_inside(world: &World) -> Result<(), ModelError> {
    let Shape::Mesh { report, .. } = world.shape() else { return Ok(()) };
    let edges = report.border_edges.count + report.non_manifold_edges.count;
    match world.scene().solver.collision {
        Some(Collision::Sdf) if edges > 0 => Err(ModelError::Open { edges }),
        _ => Ok(()),
    }
}

/// A force that is explicit in the position of a mass m is stable in steps below `2 √(m / k)`; half
/// of that is accepted, because a hollow object presses more skin at once than the flat plate
/// on which k is measured.
fn check_step(world: &World, model: &Arc<MjModel>, step_s: f64) -> Result<(), ModelError> {
    let scene = world.scene();
    let (Some(skin), Some(chain)) = (world.fingertip().and_then(|tip| tip.skin()), world.chain())
    else {
        return Ok(());
    };
    let mut plant = Plant::new(Arc::clone(model))?;
    plant.reset(chain.start()).map_err(|_| ModelError::Lacks { part: "a home" })?;
    let mass_kg = plant.tip_mass_kg();
    let towards_t = scene.finger.attitude_w().inverse_transform_vector(&APPROACH_W);
    let force_n = scene.touch.force_limit_n;
    let stiffness_n_m = stiffness::largest_n_m(skin, &towards_t, force_n);
    let limit_s = (mass_kg / stiffness_n_m).sqrt();
    match step_s <= limit_s {
        true => Ok(()),
        false => Err(ModelError::Stiff { step_s, force_n, stiffness_n_m, mass_kg, limit_s }),
    }
}
