//! Scope of an exploration around a whole object: the ball and the finger.

use crate::robot::Finger;
use crate::robot::sensor::TipSurface;
use crate::task::touch::TouchSettings;
use crate::task::{Aim, Ball, Target, Task};
use nalgebra::Point3;
use palpate_geometry::primitives::extent;
use palpate_input::error::InputError;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A ball that contains the object, and the finger that touches it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(into = "StoredSetup", try_from = "StoredSetup")]
pub struct ExplorationSetup {
    /// The ball that contains the object.
    pub ball: Ball,
    /// Radius of the fingertip.
    pub radius_m: f64,
    /// Standard deviation of the error common to all contacts.
    pub offset_m: f64,
    task: Arc<Task>,
}

/// Stored form of a scope; it has no arm, so that all aims are within its reach.
#[derive(Serialize, Deserialize)]
struct StoredSetup {
    ball: Ball,
    offset_m: f64,
    touch: TouchSettings,
    finger: Finger,
}

impl From<ExplorationSetup> for StoredSetup {
    fn from(ExplorationSetup { ball, offset_m, task, .. }: ExplorationSetup) -> Self {
        Self { ball, offset_m, touch: task.touch().clone(), finger: task.finger().clone() }
    }
}

impl TryFrom<StoredSetup> for ExplorationSetup {
    type Error = InputError;

    fn try_from(stored: StoredSetup) -> Result<Self, InputError> {
        let StoredSetup { ball, offset_m, touch, finger } = stored;
        let task = Task::new(ball, touch, &finger)?;
        Ok(Self { offset_m, ..Self::new(ball, &task, &TipSurface::Rigid) })
    }
}

impl ExplorationSetup {
    /// Creates the scope of the `ball` of a task for a tip with this `surface`.
    pub fn new(ball: Ball, task: &Task, surface: &TipSurface) -> Self {
        let offset_m = surface.errors(task.touch().press_m).offset_m[0];
        Self { ball, radius_m: task.finger().radius_m, offset_m, task: Arc::new(task.clone()) }
    }

    /// Returns the ball around `points`, which estimates the object's size; the ball of the scope
    /// before there are two.
    pub fn ball_around<'a>(&self, points: impl Iterator<Item = &'a Point3<f64>>) -> Ball {
        let spanned = extent(points).filter(|[low, high]| low != high);
        let Some(spanned) = spanned else { return self.ball };
        let about = Ball::around_box(spanned, self.ball.lowest_m);
        let radius_m = about.radius_m.max(self.radius_m).min(self.ball.radius_m);
        Ball { radius_m, ..about }
    }

    /// Whether the finger can reach the target: an aim, or both ends of a stroke.
    pub fn contains(&self, target: &Target) -> bool {
        self.task.contains(target)
    }

    /// Whether the finger can reach the aim.
    pub fn reaches(&self, aim: &Aim) -> bool {
        self.task.is_probably_reachable(aim) && self.task.is_reachable(aim)
    }
}
