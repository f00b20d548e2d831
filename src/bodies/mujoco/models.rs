//! What MuJoCo compiles of a world, once for all trials.

use super::{Flex, ModelError, Substeps, compile};
use crate::bodies::sense::Shell;
use crate::world::World;
use crate::world::collision::Collision;
use crate::world::mjcf::{self, Mode};
use crate::world::world::Shape;
use mujoco_rs::wrappers::MjModel;
use std::sync::Arc;

/// Shared by the trials of an experiment.
#[derive(Clone, Debug)]
pub struct Models {
    /// The arm or stage.
    pub plant: Arc<MjModel>,
    /// The skin of `[effects.flex]`.
    pub flex: Option<Arc<MjModel>>,
    /// How the scene's time step was divided, and why; none if it was not.
    pub substeps: Option<Substeps>,
}

impl Models {
    /// With the scene's time step, or part of it where that is too long for the skin.
    ///
    /// # Errors
    /// If MuJoCo refuses the world, no step is short enough for its skin, or the object has no inside
    /// where the scene's collision needs one.
    pub fn new(world: &World) -> Result<Self, ModelError> {
        let step_s = world.scene().solver.step_s;
        let whole = Self::at(world, step_s)?;
        match Substeps::needed(world, &whole.plant)? {
            None => Ok(whole),
            Some(substeps) => {
                let divided = Self::at(world, step_s / f64::from(substeps.count))?;
                Ok(Self { substeps: Some(substeps), ..divided })
            }
        }
    }

    /// With a time step of `step_s`, whatever the skin needs.
    ///
    /// # Errors
    /// If MuJoCo refuses the world, or the object has no inside where the scene's collision needs
    /// one.
    pub fn at(world: &World, step_s: f64) -> Result<Self, ModelError> {
        check_inside(world)?;
        let text = mjcf::scene(world, Mode::Dynamic { step_s });
        let plant = Arc::new(compile(&text.ok_or(ModelError::Lacks { part: "an object" })?)?);
        Ok(Self { plant, flex: Flex::model(world)?, substeps: None })
    }

    /// The skin of `[effects.flex]`, at rest; none if the world has none.
    ///
    /// # Errors
    /// If memory is short.
    pub fn shell(&self, world: &Arc<World>) -> Result<Option<Box<dyn Shell>>, ModelError> {
        let Some(model) = &self.flex else { return Ok(None) };
        Ok(Some(Box::new(Flex::new(Arc::clone(world), Arc::clone(model))?)))
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
