//! Registration by touch: pose of the finger on its mount and of a known body, or of an object with
//! a known mesh.
//!
//! [`RegistrationDesign`] selects the most informative touches of a ball or a plate; [`register`]
//! makes them with any probe and fits the poses. [`icp`] registers a cloud of contacts to a mesh.
//! [`ToolWeight`] fits the weight that hangs on a force/torque sensor.

pub mod design;
pub mod hand_eye;
pub mod icp;
mod known_body;
mod register;
mod tool_weight;
mod wrench_fit;

pub use design::RegistrationDesign;
pub use hand_eye::{HandEyeEstimate, HandEyeFit, RegistrationTouch};
pub use known_body::{CalibrationBody, FingerOutline};
pub use register::{RegistrationResult, conclude, register};
pub use tool_weight::ToolWeight;
pub use wrench_fit::WrenchErrors;
