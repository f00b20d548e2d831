//! Franka FR3 by the Franka Control Interface (FCI): joint velocities at 1 kHz, external wrench,
//! reflexes.
//!
//! [`FrankaSettings`] connect to the control box; only the feature `franka` builds the connection.
//! A `FrankaArm` is that connection, and a `FrankaBackend` the
//! [`Backend`](palpate_explore::backend::Backend) over it. A thread answers each state of the robot
//! within its millisecond: its velocities approach the last command within the joints'
//! accelerations, and zero when commands cease. The client limits acceleration and jerk to those of
//! the robot. Without answers the control box stops the arm.

#[cfg(feature = "franka")]
mod arm;
mod settings;

#[cfg(feature = "franka")]
pub use arm::{FrankaArm, FrankaBackend};
pub use settings::FrankaSettings;
