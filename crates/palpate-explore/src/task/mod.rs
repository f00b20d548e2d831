//! Task of the robot: where to explore, how to touch, and the approach of each touch.

mod action;
pub mod approach;
pub mod stroke;
mod target;
#[allow(clippy::module_inception)]
mod task;
pub mod touch;
pub mod zone;

pub use action::Action;
pub use approach::{Approach, Ball, RADIUS_M, WholeObject};
pub(crate) use target::any_orthogonal;
pub use target::{Aim, Target};
pub use task::{DIRECTIONS, Region, Task};
pub use zone::Zone;
