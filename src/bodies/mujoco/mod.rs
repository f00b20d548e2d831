//! MuJoCo as a library: compiling models, the plant that steps one, and the shell of a skin.

mod dynamic;
mod flex;
#[cfg(feature = "render")]
pub mod picture;
mod plant;
mod servo;
mod touch;

pub use dynamic::{Dynamic, Models};
pub use flex::Flex;
pub use plant::Plant;

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
    /// The skin is too stiff for the time step.
    #[error(
        "solver.step_s = {step_s} is too long: up to {force_n} N (touch.force_limit_n) the skin is as stiff \
         as {stiffness_n_m:.0} N/m and the fingertip as light as {mass_kg:.3} kg, which needs \
         at most {limit_s:.2e} s"
    )]
    Stiff {
        /// The scene's step.
        step_s: f64,
        /// Largest force of a touch.
        force_n: f64,
        /// Largest stiffness of the skin up to that force.
        stiffness_n_m: f64,
        /// Smallest mass that the fingertip moves with.
        mass_kg: f64,
        /// The longest step that is accepted.
        limit_s: f64,
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

/// Version of the linked library.
pub fn version() -> &'static str {
    mujoco_rs::mujoco_version()
}

/// Compiles a model.
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
    MjModel::from_xml_string(mjcf).map_err(|cause| ModelError::Refused { cause })
}
