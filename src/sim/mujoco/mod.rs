//! MuJoCo as a library: compiling models, the plant that steps one, and the shell of a skin.

mod contact;
mod dynamic;
mod implicit_gain;
mod joint_servo;
mod models;
#[cfg(feature = "render")]
pub mod picture;
mod plant;
mod shell;
mod substeps;
#[cfg(feature = "viewer")]
pub mod window;

pub use dynamic::Dynamic;
pub use models::Models;
pub use plant::Plant;
pub use shell::FlexShell;
pub use substeps::{StepLimit, Substeps};

use crate::backend::Fault;
use crate::error::Invalid;
use mujoco_rs::error::MjModelError;
use mujoco_rs::wrappers::MjModel;
use mujoco_rs::wrappers::mj_logging::{log_config, set_log_config};
use std::sync::Once;
use thiserror::Error;

/// A model that cannot be used.
#[derive(Debug, Error)]
pub enum ModelError {
    /// MuJoCo refused it.
    #[error("MuJoCo refuses the scene: {cause}")]
    Refused {
        /// What it says.
        cause: MjModelError,
    },
    /// It is not a robot with a finger.
    #[error("the MuJoCo model lacks {part}")]
    Lacks {
        /// What is missing.
        part: &'static str,
    },
    /// The skin is too stiff for any time step.
    #[error("solver.step_s = {step_s} is too long, and cannot be divided so finely: {limit}")]
    Stiff {
        /// The scene's step.
        step_s: f64,
        /// What limits it.
        limit: StepLimit,
    },
    /// The object has no inside.
    #[error(
        "solver.collision = \"sdf\" needs a closed mesh, but this one has {edges} edges that are not \
         shared by two triangles"
    )]
    Open {
        /// Border and non-manifold edges.
        edges: usize,
    },
    /// There is no memory for its state.
    #[error("no memory for the state of the MuJoCo model")]
    Memory,
}

impl From<ModelError> for Fault {
    /// What is left to go wrong once a scene was compiled.
    fn from(error: ModelError) -> Self {
        match error {
            ModelError::Lacks { part } => Self::lacks(part),
            ModelError::Memory => Invalid::new("no memory for the state of the body").into(),
            _ => Self::lacks("a model that MuJoCo steps"),
        }
    }
}

/// Version of the linked library.
pub fn version() -> &'static str {
    mujoco_rs::mujoco_version()
}

/// Compiles a model; servos of an implicit integrator become a [`Plant`]'s own.
///
/// # Errors
/// If MuJoCo refuses it.
pub fn compile(mjcf: &str) -> Result<MjModel, ModelError> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        // A diverging trial is a fault in its row, not a line in MUJOCO_LOG.TXT.
        let quiet = log_config().with_logto_console(false).with_logto_file(false);
        // SAFETY: no thread can use MuJoCo yet, because every model is compiled here.
        unsafe { set_log_config(quiet) };
    });
    let mut model =
        MjModel::from_xml_string(mjcf).map_err(|cause| ModelError::Refused { cause })?;
    implicit_gain::embed(&mut model);
    Ok(model)
}
