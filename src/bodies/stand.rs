//! What the trials of an experiment share: the world, and what is compiled from it once.

use super::backend::{Backend, Fault};
use super::delay::Delayed;
use super::kinematic::Kinematic;
#[cfg(feature = "mujoco")]
use super::mujoco;
use super::sense::Shell;
use crate::world::World;
use crate::world::scene::Body;
use std::sync::Arc;
use thiserror::Error;

/// A world with everything ready to put bodies into it.
#[derive(Clone)]
pub struct Stand {
    world: Arc<World>,
    #[cfg(feature = "mujoco")]
    models: Option<mujoco::Models>,
}

/// A world that no body can be put into.
#[derive(Debug, Error)]
pub enum StandError {
    /// Its physics cannot be simulated.
    #[cfg(feature = "mujoco")]
    #[error(transparent)]
    Model(#[from] mujoco::ModelError),
    /// This build lacks what the scene's body needs.
    #[error("body = \"{body}\" needs a build with the feature `mujoco`")]
    NotBuilt {
        /// The body.
        body: &'static str,
    },
}

impl Stand {
    /// Compiles what the scene's body needs.
    ///
    /// # Errors
    /// If it cannot be simulated as the scene asks.
    pub fn new(world: Arc<World>) -> Result<Self, StandError> {
        #[cfg(feature = "mujoco")]
        {
            let moved = world.scene().body == Body::Dynamic;
            let models = if moved { Some(mujoco::Models::new(&world)?) } else { None };
            Ok(Self { world, models })
        }
        #[cfg(not(feature = "mujoco"))]
        match world.scene().body {
            Body::Dynamic => Err(StandError::NotBuilt { body: Body::Dynamic.name() }),
            _ => Ok(Self { world }),
        }
    }

    /// The world.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// What is simulated otherwise than the scene asks, and why.
    pub fn notice(&self) -> Option<String> {
        #[cfg(feature = "mujoco")]
        if let Some(models) = &self.models {
            return models.substeps.map(|substeps| substeps.to_string());
        }
        None
    }

    /// A skin of finite elements, at rest; none if the scene's finger has none.
    ///
    /// # Errors
    /// If there is no memory for its state.
    pub fn shell(&self) -> Result<Option<Box<dyn Shell>>, Fault> {
        #[cfg(feature = "mujoco")]
        if let Some(models) = &self.models {
            return models.shell(&self.world).map_err(|_| unusable());
        }
        Ok(None)
    }

    /// The simulated body that the scene asks for, at its start; none where a touch is no motion.
    ///
    /// # Errors
    /// If there is no memory for its state.
    pub fn body(&self) -> Result<Option<Box<dyn Backend>>, Fault> {
        let body: Box<dyn Backend> = match self.world.scene().body {
            Body::Function | Body::Cast => return Ok(None),
            Body::Kinematic => Box::new(Kinematic::new(&self.world).ok_or_else(unusable)?),
            #[cfg(feature = "mujoco")]
            Body::Dynamic => {
                let models = self.models.as_ref().ok_or_else(unusable)?;
                Box::new(mujoco::Dynamic::new(&self.world, models).ok_or_else(unusable)?)
            }
            #[cfg(not(feature = "mujoco"))]
            Body::Dynamic => return Err(unusable()),
        };
        let timing = self.world.scene().effects.timing.as_ref();
        Ok(Some(match timing.map_or(0.0, |timing| timing.control_delay_s) {
            delay_s if delay_s > 0.0 => Box::new(Delayed::new(body, delay_s)),
            _ => body,
        }))
    }
}

fn unusable() -> Fault {
    Fault::Lost { time_s: 0.0 }
}
