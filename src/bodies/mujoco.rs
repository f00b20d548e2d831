//! MuJoCo as a library: compiling models.

use mujoco_rs::error::MjModelError;
use mujoco_rs::wrappers::MjModel;
use thiserror::Error;

/// MuJoCo refused a model.
#[derive(Debug, Error)]
#[error("MuJoCo refuses the scene: {cause}")]
pub struct CompileError {
    /// What it says.
    pub cause: MjModelError,
}

/// Version of the linked library.
pub fn version() -> &'static str {
    mujoco_rs::mujoco_version()
}

/// Compiles a model.
///
/// # Errors
/// If MuJoCo refuses it.
pub fn compile(mjcf: &str) -> Result<MjModel, CompileError> {
    MjModel::from_xml_string(mjcf).map_err(|cause| CompileError { cause })
}
