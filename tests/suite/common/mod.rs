//! What several tests need.

pub mod around;
pub mod counting;
pub mod fake;
pub mod hub;
#[cfg(feature = "mujoco")]
pub mod lab;
#[cfg(feature = "mujoco")]
#[allow(dead_code)] // The bench of finite elements uses the rest.
pub mod presses;
pub mod program;
pub mod quiet;
pub mod rig;
pub mod runs;
pub mod shapes;
pub mod shipped;
pub mod solids;
