//! What the robot is told: where to explore, how to touch, and the way of each touch.

pub mod approach;
#[allow(clippy::module_inception)]
mod task;
pub mod touch;
pub mod zone;

pub use approach::Approach;
pub use task::{Task, TaskError};
pub use zone::Zone;
