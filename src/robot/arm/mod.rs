//! What carries the finger: a chain of joints, the PA-10 or a three-axis stage.

pub mod chain;
mod error;
pub mod pa10;
pub mod settings;
pub mod stage;

pub use chain::{Chain, Jacobian, Joint, Joints, Kind};
pub use error::ArmError;
pub use pa10::Links;
pub use settings::ArmSettings;
