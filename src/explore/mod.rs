//! What the robot does, on the bench as in simulation: touch, believe, plan.

pub mod belief;
pub mod control;
mod free_space;
pub mod planner;
pub mod probe;
