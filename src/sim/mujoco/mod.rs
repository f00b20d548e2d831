//! MuJoCo bindings: compilation of models, and the plant that steps one.

mod dynamic;
mod joint_servo;
mod models;
#[cfg(feature = "render")]
pub mod picture;
mod plant;
#[cfg(feature = "viewer")]
pub mod window;

pub use dynamic::Dynamic;
pub use models::{Models, StepLimit, Substeps};
pub use plant::Plant;

use mujoco_rs::wrappers::MjModel;
use mujoco_rs::wrappers::mj_logging::{log_config, set_log_config};
use palpate_input::error::Invalid;
use std::sync::Once;

/// Returns the error of a model that lacks a `part` of a robot with a finger.
fn lacking(part: &str) -> Invalid {
    Invalid::new(format!("the MuJoCo model lacks {part}"))
}

/// Returns the version of the linked library.
pub fn version() -> &'static str {
    mujoco_rs::mujoco_version()
}

/// Compiles a model; with an implicit integrator, its servos become those of a [`Plant`].
///
/// # Errors
/// If MuJoCo refuses it.
pub fn compile(mjcf: &str) -> Result<MjModel, Invalid> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        // A diverging trial is a fault in its row, not a line in MUJOCO_LOG.TXT.
        let quiet = log_config().with_logto_console(false).with_logto_file(false);
        // SAFETY: no thread can use MuJoCo yet, because every model is compiled here.
        unsafe { set_log_config(quiet) };
    });
    // MuJoCo takes an errno that an allocation left behind for the error of a number that it read;
    // seen with a mesh among many threads. A second attempt shows whether it was one.
    let spurious = "unknown error in attribute";
    let mut model = MjModel::from_xml_string(mjcf)
        .or_else(|cause| match cause.to_string().contains(spurious) {
            true => MjModel::from_xml_string(mjcf),
            false => Err(cause),
        })
        .map_err(|cause| Invalid::new(format!("MuJoCo refuses the scene: {cause}")))?;
    joint_servo::embed(&mut model);
    Ok(model)
}
