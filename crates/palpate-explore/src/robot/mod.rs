//! Robot: the arm, the finger and its sensors.

pub mod arm;
pub mod finger;
#[allow(clippy::module_inception)]
mod robot;
pub mod sensor;

pub use finger::Finger;
pub use robot::Robot;
