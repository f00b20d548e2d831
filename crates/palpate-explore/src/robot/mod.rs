//! What is bolted on: the arm, and what a real finger has too.

pub mod arm;
pub mod finger;
#[allow(clippy::module_inception)]
mod robot;
pub mod sensor;

pub use finger::Finger;
pub use robot::Robot;
