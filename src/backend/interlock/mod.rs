//! Interlocks: reasons to stop a body that hold whatever it is told.
//!
//! An [`Interlock`] is a file here and a line in [`INTERLOCKS`]; [`Interlocked`] is a body around
//! another that asks each of them in every tick. Before a body is moved, [`check_start`] asks it
//! to stand still and looks at its sensors.

mod ahead;
mod collision;
mod depth;
mod electrodes;
mod force;
pub mod gates;
#[allow(clippy::module_inception)]
mod interlock;
mod interlocked;
mod joints;
mod settings;
mod silence;
mod site;
mod standstill;
mod table;
mod tip_speed;
mod tracking;
mod trip;
mod velocity;
mod way_back;
mod workspace;

pub use gates::{Baseline, Expected, GateError, GateSettings, check_start};
pub use interlock::{Entry, Interlock, Now};
pub use interlocked::{Interlocked, Operator};
pub use settings::{InterlockSettings, defaults};
pub use site::Site;
pub use table::INTERLOCKS;
pub use trip::Trip;
