//! What several tests need.

pub mod counting;
#[cfg(feature = "mujoco")]
pub mod presses;
pub mod runs;
pub mod shapes;
