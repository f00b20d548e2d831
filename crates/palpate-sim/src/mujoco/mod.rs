//! MuJoCo bindings: compilation of models, and the plant that steps one.

mod dynamic;
mod joint_servo;
mod models;
#[cfg(feature = "render")]
pub mod picture;
mod plant;
#[cfg(feature = "viewer")]
pub mod window;

pub use dynamic::DynamicBackend;
pub use models::{CompiledModels, StepLimit, Substeps};
pub use plant::Plant;

use crate::mujoco_log::quiet;
use mujoco_rs::wrappers::MjModel;
use palpate_input::error::InputError;

/// Returns the error of a model that lacks a `part` of a robot with a finger.
fn lacking(part: &str) -> InputError {
    InputError::new(format!("the MuJoCo model lacks {part}"))
}

/// Returns the version of the linked library.
pub fn version() -> &'static str {
    mujoco_rs::mujoco_version()
}

/// Message of MuJoCo when it reports an errno left by its own allocation as an error of a number.
/// (glibc sets ENOMEM if the heap of the main arena cannot grow, and allocates elsewhere) Another
/// thread has another arena.
const SPURIOUS: &str = "unknown error in attribute";

/// Compiles a model; with an implicit integrator, its servos become those of a [`Plant`].
///
/// # Errors
/// If MuJoCo refuses it.
pub fn compile(mjcf: &str) -> Result<MjModel, InputError> {
    quiet();
    let read = || MjModel::from_xml_string(mjcf);
    let mut model = read()
        .or_else(|cause| match cause.to_string().contains(SPURIOUS) {
            true => std::thread::scope(|scope| scope.spawn(read).join().unwrap_or(Err(cause))),
            false => Err(cause),
        })
        .map_err(|cause| InputError::new(format!("MuJoCo refuses the scene: {cause}")))?;
    joint_servo::embed(&mut model);
    Ok(model)
}
