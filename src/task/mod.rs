//! What the robot is told: where to explore and how to touch.

pub mod touch;
pub mod zone;

pub use zone::Zone;
