//! Strokes that a scene allows, and what a touch has cost so far.

use super::looks::TOUCH_S;
use palpate_explore::evidence::{Outcome, Source};
use palpate_explore::planner::stroke::StrokeOffer;
use palpate_explore::probe::Probe;
use palpate_explore::task::{Target, Task};

/// Strokes of a trial.
pub(super) struct Strokes<'a> {
    task: &'a Task,
    /// Touches so far, the way between them and along strokes, m.
    count: u32,
    travelled_m: f64,
    slid_m: f64,
    last: Option<Target>,
}

impl<'a> Strokes<'a> {
    pub(super) fn new(task: &'a Task) -> Self {
        Self { task, count: 0, travelled_m: 0.0, slid_m: 0.0, last: None }
    }

    /// Returns what the next stroke may be, if the scene allows strokes; `looked_s` is the time
    /// that the robot rested for a camera.
    pub(super) fn offer(&self, probe: &dyn Probe, looked_s: f64) -> Option<StrokeOffer> {
        let (touch, stroke) = (self.task.touch(), self.task.touch().stroke.as_ref()?);
        let moved_s = self.travelled_m / touch.travel_m_s + self.slid_m / stroke.speed_m_s;
        let mean_s =
            probe.time_s().map(|time_s| (time_s - looked_s - moved_s) / f64::from(self.count));
        Some(StrokeOffer {
            longest_m: stroke.longest_m,
            speed_m_s: stroke.speed_m_s,
            tap_s: mean_s.filter(|mean_s| *mean_s > 0.0 && self.count > 0).unwrap_or(TOUCH_S),
            travel_m_s: touch.travel_m_s,
            from: self.last.clone(),
        })
    }

    /// Adds a touch at `target`.
    pub(super) fn add(&mut self, target: &Target, outcome: &Outcome) {
        self.count += 1;
        if let Some(last) = &self.last {
            self.travelled_m += self.task.region().travel_m(last, target);
        }
        if let Some(points) =
            outcome.surface_points().filter(|it| it.source == Some(Source::Stroke))
        {
            self.slid_m += points.length_m();
        }
        self.last = Some(target.clone());
    }
}
