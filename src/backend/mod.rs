//! Bodies that are commanded and read, simulated, recorded or real, and wrappers around them.

#[allow(clippy::module_inception)]
pub mod backend;
pub mod delay;
pub mod fault_injector;
pub mod limits;
pub mod recorder;
pub mod trace;
pub mod watched;
