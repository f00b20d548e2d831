//! What is explored, and with what: all that a belief over space and its planners are told.

use crate::robot::Finger;
use crate::task::{Aim, Ball, Task};
use std::sync::Arc;

/// A ball in which there is an object, and the finger that touches it.
#[derive(Clone, Debug)]
pub struct Scope {
    /// Where the object is.
    pub ball: Ball,
    /// Radius of the fingertip.
    pub radius_m: f64,
    task: Arc<Task>,
}

impl Scope {
    /// Of a task around a whole object; none of one with a zone.
    pub fn of(task: &Task, finger: &Finger) -> Option<Self> {
        let ball = task.ball()?.clone();
        Some(Self { ball, radius_m: finger.radius_m, task: Arc::new(task.clone()) })
    }

    /// Whether the finger can be brought to what is aimed at.
    pub fn reaches(&self, aim: &Aim) -> bool {
        self.task.may_reach(aim) && self.task.reaches(aim)
    }
}
