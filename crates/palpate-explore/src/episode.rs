//! Episode: offer, plan, execute, observe, fit. One loop for trials, real robots, studies and
//! programs of users.

use crate::backend::Fault;
use crate::belief::Belief;
use crate::evidence::{End, ErrorSource, Outcome};
use crate::planner::{Offer, StrokeOffer};
use crate::probe::Probe;
use crate::task::{Action, Target, Task};
use palpate_gp::covariance::CovarianceError;
use palpate_input::error::InputError;

/// Time of a touch of a probe that does not move, and of the first touch, s.
// heuristic: a simulated PA-10 takes five to eight.
const TOUCH_S: f64 = 6.0;

/// Relative rounding of a stroke's length.
const ROUNDING: f64 = 1e-9;

/// An exploration: a probe executes actions of a task, and a belief observes their outcomes.
pub struct Episode<'a> {
    task: Task,
    probe: Box<dyn Probe + 'a>,
    belief: Belief,
    last: Option<Target>,
    costs: TouchCosts,
}

/// Touches so far, and their cost.
#[derive(Default)]
struct TouchCosts {
    touches: u32,
    /// Way between touches, m.
    travelled_m: f64,
    /// Way along strokes, m.
    slid_m: f64,
}

impl<'a> Episode<'a> {
    /// Creates an episode without actions.
    pub fn new(task: &Task, belief: Belief, probe: impl Probe + 'a) -> Self {
        Self {
            task: task.clone(),
            probe: Box::new(probe),
            belief,
            last: None,
            costs: TouchCosts::default(),
        }
    }

    /// Belief after the last fit, with all evidence.
    pub fn belief(&self) -> &Belief {
        &self.belief
    }

    /// Returns the probe, e.g. for touches that the belief does not observe.
    pub fn probe(&mut self) -> &mut (dyn Probe + 'a) {
        &mut *self.probe
    }

    /// Returns the actions on offer beside taps, and what they cost.
    pub fn offer(&self) -> Offer {
        let touch_s = self.mean_touch_s(0.0);
        let touch = self.task.touch();
        let stroke = touch.stroke.as_ref().map(|stroke| {
            let TouchCosts { travelled_m, slid_m, .. } = self.costs;
            let moved_s = travelled_m / touch.travel_m_s + slid_m / stroke.speed_m_s;
            StrokeOffer {
                longest_m: stroke.longest_m,
                speed_m_s: stroke.speed_m_s,
                tap_s: self.mean_touch_s(moved_s),
                travel_m_s: touch.travel_m_s,
                from: self.last.clone(),
            }
        });
        Offer { looks: self.probe.looks(), touch_s, stroke }
    }

    /// Returns the mean time of a touch without looks, and without `moved_s` of all touches.
    fn mean_touch_s(&self, moved_s: f64) -> f64 {
        let (touches, looked_s) = (self.costs.touches, self.probe.looked_s());
        let time_s = self.probe.time_s().filter(|_| touches > 0);
        let mean_s = time_s.map(|time_s| (time_s - looked_s - moved_s) / f64::from(touches));
        mean_s.filter(|mean_s| *mean_s > 0.0).unwrap_or(TOUCH_S)
    }

    /// Returns the action at `target`.
    ///
    /// # Errors
    /// If the region does not contain the target, the finger cannot reach it, or it is a stroke
    /// that the task does not allow.
    pub fn action(&self, target: &Target) -> Result<Action, InputError> {
        if let Target::Look { camera } = target {
            return Ok(Action::Look { camera: *camera });
        }
        let length_m = target.slide_m();
        if length_m > 0.0 {
            let longest_m = self.task.touch().stroke.as_ref().map(|stroke| stroke.longest_m);
            let longest_m = longest_m.ok_or_else(|| {
                InputError::new("a stroke is planned, and the scene has no [touch.stroke]")
            })?;
            if length_m > longest_m * (1.0 + ROUNDING) {
                return Err(InputError::new(format!(
                    "a stroke of {length_m} m is planned; touch.stroke.longest_m is {longest_m}"
                )));
            }
        }
        let approach = self.task.approach_in_region(target)?;
        Ok(match target {
            Target::Custom { name, parameters, .. } => {
                Action::Custom { name: name.clone(), approach, parameters: parameters.clone() }
            }
            _ => Action::Touch(approach),
        })
    }

    /// Executes the `action` at `target` and adds its outcome to the belief, which changes at the
    /// next [`fit`](Self::fit).
    ///
    /// # Errors
    /// If the probe reports a fault.
    pub fn execute(&mut self, target: &Target, action: &Action) -> Result<Outcome, Fault> {
        let outcome = self.probe.execute(action)?;
        self.belief.observe(target, &outcome);
        if outcome.end == End::Looked {
            return Ok(outcome);
        }
        self.costs.touches += 1;
        if let Some(last) = &self.last {
            self.costs.travelled_m += self.task.region().travel_m(last, target);
        }
        let points = outcome.surface_points();
        if let Some(points) = points.filter(|points| points.source == Some(ErrorSource::Stroke)) {
            self.costs.slid_m += points.length_m();
        }
        self.last = Some(target.clone());
        Ok(outcome)
    }

    /// Fits the belief to all evidence.
    ///
    /// # Errors
    /// If the covariance of the evidence cannot be factored.
    pub fn fit(&mut self) -> Result<(), CovarianceError> {
        self.belief.refit()
    }

    /// Returns the belief, which ends the episode.
    pub fn into_belief(self) -> Belief {
        self.belief
    }
}
