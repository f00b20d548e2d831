//! Simulated arm behind ROS topics, in real time, for tests of an explorer before it commands the
//! real arm.
//!
//! [`arm_computer`] is the layer between network and servos, [`failure`] the injected failures,
//! [`serve`](mod@serve) the loop.

pub mod arm_computer;
mod controller_manager;
pub mod failure;
pub mod serve;
pub mod ur_computer;
pub mod ur_trajectory;
