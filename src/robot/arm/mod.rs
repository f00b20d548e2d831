//! The arm or the three-axis stage that carries the finger, as a chain of joints.

pub mod capsule;
pub mod chain;
mod error;
pub mod model;
pub mod settings;
pub mod stage;

pub use chain::{Chain, Jacobian, Joint, Joints, Kind};
pub use error::ArmError;
pub use model::ArmModel;
pub use settings::ArmSettings;
