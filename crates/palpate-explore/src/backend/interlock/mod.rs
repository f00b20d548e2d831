//! Interlocks: conditions that stop the robot independently of the commands.
//!
//! An [`Interlock`] is an [`InterlockEntry`] of [`INTERLOCKS`]; [`InterlockedBackend`] is a backend
//! that wraps another and evaluates all of them in every tick. Before the robot moves,
//! [`check_start`] commands it to rest and checks its sensors.

mod collision;
mod force;
#[allow(clippy::module_inception)]
mod interlock;
mod interlocked;
mod limits;
mod sensors;
mod settings;
pub mod start_checks;
mod tracking;
mod workspace;

pub use interlock::{Interlock, InterlockEntry, RobotState, SafetyContext};
pub use interlocked::InterlockedBackend;
pub use settings::{InterlockSettings, defaults};
pub use start_checks::{StartCheckSettings, check_start};

/// All interlocks in the order in which they act: those that limit a command come before those that
/// check the result.
pub const INTERLOCKS: &[InterlockEntry] = &[
    limits::TIP_SPEED,
    limits::JOINT_POSITION,
    workspace::WORKSPACE,
    workspace::DEPTH,
    collision::CLEARANCE,
    force::FORCE,
    sensors::SENSOR_TIMEOUT,
    sensors::ELECTRODE,
    tracking::STUCK_JOINT,
    tracking::VELOCITY,
    tracking::POSITION,
];
