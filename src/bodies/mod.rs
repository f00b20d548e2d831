//! Floor 3: what is commanded and read, simulated or real.

pub mod backend;
pub mod faults;
pub mod kinematic;
#[cfg(feature = "mujoco")]
pub mod mujoco;
pub mod sense;
