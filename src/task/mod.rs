//! What the robot is told: where to explore, how to touch, and the way of each touch.

pub mod approach;
pub mod around;
mod reach;
mod region;
mod target;
#[allow(clippy::module_inception)]
mod task;
pub mod touch;
pub mod zone;

pub use approach::{Approach, KeepOut};
pub use around::{Around, Ball, RADIUS_M};
pub use reach::{DIRECTIONS, Reach};
pub use region::Region;
pub use target::{Aim, Target};
pub use task::{Task, TaskError};
pub use zone::Zone;
