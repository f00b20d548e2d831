//! Simulator shared by the trials of an experiment: the environment with its compiled models; it
//! makes backends and probes.

use super::kinematic::KinematicBackend;
#[cfg(feature = "mujoco")]
use super::mujoco;
use super::notice;
use super::probe::noisy_probe;
use crate::Environment;
use crate::scene::SimulatorKind;
use palpate_explore::backend::delay::DelayedBackend;
use palpate_explore::backend::interlock::InterlockSettings;
use palpate_explore::backend::{Backend, Fault};
use palpate_explore::probe::Probe;
use palpate_explore::probe::interlocks::with_interlocks;
use palpate_explore::probe::servo::{Servo, check_directions, check_reach};
use palpate_geometry::distance::OrientedBox;
use palpate_input::error::InputError;
use std::sync::Arc;

/// Environment with its compiled models, ready to create backends.
#[derive(Clone)]
pub struct Simulator {
    environment: Arc<Environment>,
    #[cfg(feature = "mujoco")]
    models: Option<mujoco::CompiledModels>,
}

impl Simulator {
    /// Compiles the models that the scene's simulator needs.
    ///
    /// # Errors
    /// If the scene cannot be simulated.
    pub fn new(environment: Arc<Environment>) -> Result<Self, InputError> {
        #[cfg(feature = "mujoco")]
        {
            let moved = environment.scene().simulator == SimulatorKind::Dynamic;
            let models =
                if moved { Some(mujoco::CompiledModels::new(&environment)?) } else { None };
            Ok(Self { environment, models })
        }
        #[cfg(not(feature = "mujoco"))]
        match environment.scene().simulator {
            SimulatorKind::Dynamic => Err(InputError::new(
                "simulator = \"dynamic\" needs a build with the feature `mujoco`",
            )),
            _ => Ok(Self { environment }),
        }
    }

    /// The environment.
    pub fn environment(&self) -> &Arc<Environment> {
        &self.environment
    }

    /// Returns warnings about likely configuration mistakes, and differences between the scene and
    /// the simulation.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = self.environment.notices().to_vec();
        let chain = self.environment.chain();
        let scene = self.environment.scene();
        notices.extend(chain.as_ref().and_then(|chain| notice::vague_contacts(scene, chain)));
        let foot_w = chain.map(|chain| match scene.arm {
            Some(_) => chain.base.translation.vector.into(),
            None => chain.forward(&chain.home).translation.vector.into(),
        });
        let sides = foot_w
            .and_then(|foot_w| notice::unreachable_directions(self.environment.task(), &foot_w));
        notices.extend(sides);
        #[cfg(feature = "mujoco")]
        if let Some(substeps) = self.models.as_ref().and_then(|models| models.substeps.as_ref()) {
            notices.push(substeps.to_string());
        }
        notices
    }

    /// Checks that the scene's arm or stage can reach all of its zone, or that a finger can reach a
    /// whole object.
    ///
    /// # Errors
    /// If a part of the zone, or the whole object, is out of reach.
    pub fn check_reach(&self) -> Result<(), InputError> {
        let environment = &self.environment;
        match (environment.scene().simulator, environment.robot()) {
            (SimulatorKind::Kinematic | SimulatorKind::Dynamic, Some(robot)) => {
                check_reach(&robot, environment.task())
            }
            _ => check_directions(environment.task()),
        }
    }

    /// Returns the probe of the scene's simulator; `seed` determines all random numbers of its
    /// sensors.
    ///
    /// # Errors
    /// If the robot cannot be brought to its start.
    pub fn probe(&self, seed: u64) -> Result<Box<dyn Probe>, Fault> {
        Ok(match self.body()? {
            Some(body) => Box::new(self.servo(body, seed)?),
            None => noisy_probe(Arc::clone(&self.environment), seed),
        })
    }

    /// Returns the servo that drives `body` (the scene's own or a wrapper of it) through touches,
    /// within the default interlocks. The interlocks include table and object if the scene lets
    /// them collide.
    ///
    /// # Errors
    /// If the robot cannot be brought to its start.
    pub fn servo(&self, body: Box<dyn Backend>, seed: u64) -> Result<Servo, Fault> {
        self.servo_within(body, seed, &InterlockSettings::default())
    }

    /// Returns a servo like [`servo`](Self::servo), within the given limits.
    ///
    /// # Errors
    /// The errors of [`servo`](Self::servo).
    pub fn servo_within(
        &self,
        body: Box<dyn Backend>,
        seed: u64,
        limits: &InterlockSettings,
    ) -> Result<Servo, Fault> {
        let robot = self.environment.robot().ok_or_else(|| Fault::lacks("an object"))?;
        let task = self.environment.task();
        let mut limits = limits.clone();
        let mut object = None;
        if let Some(collision) = &self.environment.scene().effects.collision {
            limits.lowest_m.get_or_insert(collision.table_m);
            object = self.environment.mesh().map(|mesh| OrientedBox::from_corners(mesh.bounds()));
        }
        let body = with_interlocks(body, &robot, task, object, &limits)?;
        Servo::new(robot, task.touch().clone(), Box::new(body), seed)
    }

    /// Returns the simulated backend of the scene, at its start; `None` if a touch involves no
    /// motion.
    ///
    /// # Errors
    /// If there is no memory for its state.
    pub fn body(&self) -> Result<Option<Box<dyn Backend>>, Fault> {
        let body: Box<dyn Backend> = match self.environment.scene().simulator {
            SimulatorKind::Analytic | SimulatorKind::Swept => return Ok(None),
            SimulatorKind::Kinematic => Box::new(KinematicBackend::new(&self.environment)?),
            #[cfg(feature = "mujoco")]
            SimulatorKind::Dynamic => {
                let lacking = || Fault::lacks("a compiled model");
                let models = self.models.as_ref().ok_or_else(lacking)?;
                Box::new(mujoco::DynamicBackend::new(&self.environment, models)?)
            }
            #[cfg(not(feature = "mujoco"))]
            SimulatorKind::Dynamic => return Err(Fault::lacks("the feature `mujoco`")),
        };
        let timing = self.environment.scene().effects.timing.as_ref();
        Ok(Some(match timing.map_or(0.0, |timing| timing.control_delay_s) {
            delay_s if delay_s > 0.0 => Box::new(DelayedBackend::new(body, delay_s)),
            _ => body,
        }))
    }
}
