//! What the robot is told: where to explore, how to touch, and the way of each touch.

pub mod approach;
pub mod around;
#[allow(clippy::module_inception)]
mod task;
pub mod touch;
mod ways;
pub mod zone;

pub use approach::{Approach, KeepOut};
pub use around::{Aim, Around, Ball, RADIUS_M};
pub use task::{Task, TaskError};
pub use ways::{DIRECTIONS, Reach};
pub use zone::Zone;
