//! Messages of the lab's topics, in the layout of ROS 2; `serde` fields in the order of their
//! definitions, so that a CDR serializer writes what every other implementation reads.
//!
//! ROS 1 messages differ in their header only, which therefore is a parameter.

mod definition;
mod diagnostics;
mod header;
mod joints;
mod tactile;
mod trigger;
mod wrench;

pub use definition::{Definition, Described};
pub use diagnostics::{DiagnosticArray, DiagnosticStatus, KeyValue, Level};
pub use header::{Duration, Header, Time};
pub use joints::{Float64MultiArray, JointState, JointTrajectory, JointTrajectoryPoint};
pub use tactile::{BioTacData, BioTacHand, BioTacTime, Biotac, BiotacAll};
pub use trigger::{TriggerRequest, TriggerResponse};
pub use wrench::{Vector3, Wrench, WrenchStamped};
