//! Floor 3: what is commanded and read, simulated or real.

pub mod backend;
pub mod delay;
pub mod faults;
pub mod kinematic;
pub mod limits;
#[cfg(feature = "mujoco")]
pub mod mujoco;
pub mod recorder;
pub mod sense;
pub mod stand;
pub mod watched;
