//! Backends: robots that accept commands and return readings, simulated, recorded or real.
//!
//! [`Backend`] is the trait, one control tick at a time. `delay`, `interlock`, `trace` and
//! `live_view` are backends that wrap another. [`Arm`](arm::Arm) is a connected arm.

pub mod arm;
#[allow(clippy::module_inception)]
mod backend;
pub mod delay;
mod fault;
pub mod interlock;
pub mod live_view;
pub mod pace;
pub mod trace;

pub use crate::robot::sensor::{IdealContact, Sample, Wrench};
pub use backend::{Backend, Capabilities, Command, Reading};
pub use fault::{Fault, LinkFault, Trip};
