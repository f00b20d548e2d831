//! Interlocks: reasons to stop a body that hold whatever it is told.
//!
//! An [`Interlock`] is a file here and a line in [`INTERLOCKS`]; [`Interlocked`] is a body around
//! another that asks each of them in every tick. Before a body is moved, [`check_start`] asks it
//! to stand still and looks at its sensors.

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
mod standstill;
mod tip_speed;
mod tracking;
mod velocity;
mod workspace;

pub use gates::{Baseline, GateSettings, check_start};
pub use interlock::{Entry, Interlock, Now, Site};
pub use interlocked::{Interlocked, Operator};
pub use settings::{InterlockSettings, defaults};

/// In the order in which they act: those that shorten a command come before those that judge what
/// is left of it. A new one is a file and a line.
pub const INTERLOCKS: &[Entry] = &[
    tip_speed::ENTRY,
    joints::ENTRY,
    workspace::ENTRY,
    depth::ENTRY,
    collision::ENTRY,
    force::ENTRY,
    silence::ENTRY,
    electrodes::ENTRY,
    standstill::ENTRY,
    velocity::ENTRY,
    tracking::ENTRY,
];
