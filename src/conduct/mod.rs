//! Floor 4: one touch, the belief after it, and where to touch next.

pub mod belief;
pub mod control;
mod free_space;
pub mod planner;
pub mod probe;
pub mod reach;
