//! What is explored, and with what: all that a belief over space and its planners are told.

use crate::robot::Finger;
use crate::task::{Aim, Ball, Task};
use nalgebra::Point3;
use palpate_geometry::primitives::extent;
use std::sync::Arc;

/// How far the surface that a soft finger finds is off as a whole: of the twelve objects for
/// choosing, 36 trials of 60 touches, by 0.1 to 0.8 mm outwards, 0.3 mm in the median.
const SOFT_OFFSET_M: f64 = 3e-4;

/// A ball in which there is an object, and the finger that touches it.
#[derive(Clone, Debug)]
pub struct Scope {
    /// Where the object is.
    pub ball: Ball,
    /// Radius of the fingertip.
    pub radius_m: f64,
    /// Standard deviation of an error that all its contacts have in common.
    pub offset_m: f64,
    task: Arc<Task>,
}

impl Scope {
    /// The `ball` of a task around a whole object, touched by `finger`, which may be soft.
    pub fn new(ball: Ball, task: &Task, (finger, is_soft): (&Finger, bool)) -> Self {
        let offset_m = if is_soft { SOFT_OFFSET_M } else { 0.0 };
        Self { ball, radius_m: finger.radius_m, offset_m, task: Arc::new(task.clone()) }
    }

    /// The ball about `contacts`, which says how large the object is when the one it is sought in
    /// does not; that one before there are two.
    pub fn met<'a>(&self, contacts: impl Iterator<Item = &'a Point3<f64>>) -> Ball {
        let spanned = extent(contacts).filter(|[low, high]| low != high);
        let Some(spanned) = spanned else { return self.ball };
        let about = Ball::about(spanned, self.ball.lowest_m);
        let radius_m = about.radius_m.max(self.radius_m).min(self.ball.radius_m);
        Ball { radius_m, ..about }
    }

    /// Whether the finger can be brought to what is aimed at.
    pub fn reaches(&self, aim: &Aim) -> bool {
        self.task.may_reach(aim) && self.task.reaches(aim)
    }
}
