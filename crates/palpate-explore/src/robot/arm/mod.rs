//! The arm or three-axis stage that carries the finger, as a chain of joints.

mod calibration;
pub mod chain;
mod clearance;
pub mod inertia;
pub mod model;
pub mod parts;
pub mod settings;
pub mod stage;
mod urdf;
mod urdf_checks;

pub use chain::{ArmError, Chain, Jacobian, Joint, JointType, Joints, LinkCapsule, RobotPart};
pub use clearance::{Clearance, JointSegment, Obstacle};
pub use model::ArmModel;
pub use settings::ArmSettings;
