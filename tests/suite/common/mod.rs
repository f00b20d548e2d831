//! Shared test utilities.

pub mod around;
pub mod counting;
#[cfg(feature = "mujoco")]
pub mod driver;
pub mod fake;
pub mod fault_injector;
pub mod hub;
#[cfg(feature = "mujoco")]
pub mod lab;
pub mod outcomes;
pub mod program;
pub mod quiet;
pub mod rig;
pub mod runs;
pub mod shapes;
pub mod shipped;
pub mod six;
pub mod skip;
pub mod solids;
pub mod tap;
pub mod touched;
pub mod viewer;
