//! MJCF of an arm: written from its model, and read by MuJoCo.

#[cfg(feature = "mujoco")]
mod joint;
#[cfg(feature = "mujoco")]
mod read;
mod write;

#[cfg(feature = "mujoco")]
pub use read::arm_parts;
pub use write::arm;

pub(crate) use write::list;
