//! Floor 3: what is commanded and read, simulated or real.

pub mod backend;
#[cfg(feature = "mujoco")]
pub mod mujoco;
