//! What MuJoCo compiles of an environment, once for all trials.

use super::{Substeps, compile, lacking};
use crate::sim::Environment;
use crate::sim::collision::Collision;
use crate::sim::environment::Shape;
use crate::sim::mjcf;
use crate::sim::mjcf::Mode;
use mujoco_rs::wrappers::MjModel;
use palpate_input::error::Invalid;
use std::sync::Arc;

/// Shared by the trials of an experiment.
#[derive(Clone, Debug)]
pub struct Models {
    /// The arm or stage.
    pub plant: Arc<MjModel>,
    /// How the scene's time step was divided, and why; none if it was not.
    pub substeps: Option<Substeps>,
}

impl Models {
    /// With the scene's time step, or part of it where that is too long for the skin.
    ///
    /// # Errors
    /// If MuJoCo refuses the scene, no step is short enough for its skin, or the object has no
    /// inside where the scene's collision needs one.
    pub fn new(environment: &Environment) -> Result<Self, Invalid> {
        let step_s = environment.scene().solver.step_s;
        let whole = Self::at(environment, step_s)?;
        match Substeps::needed(environment, &whole.plant)? {
            None => Ok(whole),
            Some(substeps) => {
                let divided = Self::at(environment, step_s / f64::from(substeps.count))?;
                Ok(Self { substeps: Some(substeps), ..divided })
            }
        }
    }

    /// With a time step of `step_s`, whatever the skin needs.
    ///
    /// # Errors
    /// If MuJoCo refuses the scene, or the object has no inside where the scene's collision needs
    /// one.
    pub fn at(environment: &Environment, step_s: f64) -> Result<Self, Invalid> {
        check_inside(environment)?;
        let text = mjcf::scene(environment, Mode::Dynamic { step_s });
        let plant = Arc::new(compile(&text.ok_or_else(|| lacking("an object"))?)?);
        Ok(Self { plant, substeps: None })
    }
}

/// Without an inside a distance has no sign.
fn check_inside(environment: &Environment) -> Result<(), Invalid> {
    let Shape::Mesh { report, .. } = environment.shape() else { return Ok(()) };
    let edges = report.border_edges.count + report.non_manifold_edges.count;
    match environment.scene().solver.collision {
        Some(Collision::Sdf) if edges > 0 => Err(Invalid::new(format!(
            "solver.collision = \"sdf\" needs a closed mesh, but this one has {edges} edges that are \
             not shared by two triangles"
        ))),
        _ => Ok(()),
    }
}
