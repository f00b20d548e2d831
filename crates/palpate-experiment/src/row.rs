//! Row of a trial: one line of `trials.jsonl`.

use crate::metrics::Metrics;
use crate::metrics::recognition::RecognitionMetrics;
use crate::metrics::shape::ShapeMetrics;
use crate::metrics::silhouette::SilhouetteMetrics;
use nalgebra::Point3;
use palpate_explore::backend::Fault;
use palpate_explore::evidence::{End, Outcome};
use palpate_explore::planner::{Fallback, Plan};
use palpate_explore::recognition::Likeness;
use palpate_explore::task::Target;
use palpate_explore::view::RigidError;
use palpate_gp::fit::Fit;
use palpate_sim::camera::TrueError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Identifier of a trial of an experiment.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct TrialId {
    /// Number of the trial.
    pub trial: u32,
    /// Name of the planner.
    pub planner: String,
}

/// One trial of one planner. It contains no wall time, so that every run writes the same bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialRow {
    /// Number of the trial; trials of the same number share initial touches.
    pub trial: u32,
    /// Name of the planner.
    pub planner: String,
    /// Reason of an early end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Whether `[stop]` ended it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stopped: bool,
    /// Views of a camera.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<ViewRow>,
    /// Touches in order.
    pub touches: Vec<TouchRow>,
    /// Held-out touches, made after `touches`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub verification: Vec<VerificationRow>,
}

/// One action of a trial.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Target of the action.
    pub target: &'a Target,
    /// Outcome of the action.
    pub outcome: &'a Outcome,
    /// Fit after it, if there was one.
    pub fit: Option<&'a Fit>,
    /// Shapes that the belief is about after it, with `gp.prior = "library"`.
    pub likeness: Option<&'a Likeness>,
}

/// One view of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ViewRow {
    /// Number of touches made before it.
    #[serde(default, skip_serializing_if = "is_first")]
    pub after: u32,
    /// Camera that looked.
    pub target: Target,
    /// Surface that it shows, thinned.
    pub outcome: Outcome,
    /// Fit after it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fit>,
    /// Error of the camera's pose after the last touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<RigidError>,
    /// True error of a simulated camera's pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub true_error: Option<TrueError>,
}

/// One touch and the belief after it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TouchRow {
    /// Target of the touch.
    pub target: Target,
    /// Outcome of the touch, with its evidence.
    pub outcome: Outcome,
    /// Standard deviation at the target when planned, given unreached targets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planned_sd_m: Option<f64>,
    /// Reason why the planner used its fallback.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fallback: Option<Fallback>,
    /// Fit after this touch; none before the last initial touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fit>,
    /// Shapes that the belief is about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likeness: Option<Likeness>,
    /// Jitter of the covariance, relative to its diagonal.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub jitter: f64,
    /// Bound of the RMSE within reach (95 %); with `stop.rmse_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rmse_bound_m: Option<f64>,
    /// Errors of the belief after this touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metrics: Option<Metrics>,
    /// Errors of the estimated silhouette; omitted where the object fills its zone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub silhouette: Option<SilhouetteMetrics>,
    /// Errors of the estimated closed surface; omitted for a zone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeMetrics>,
    /// Hypotheses about the object; omitted without a library.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recognition: Option<RecognitionMetrics>,
}

/// A held-out touch, made after all `touches` of a trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VerificationRow {
    /// Target of the touch, as in the trial's touches.
    pub target: Target,
    /// Number of the repeated touch, from 1; none for a touch at a new place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats: Option<u32>,
    /// Predicted height at the target; around an object, predicted distance of contact before the
    /// aimed point, 0 without a prediction.
    pub predicted_m: f64,
    /// Standard deviation of the prediction, noise included: sqrt(σ² + noise²).
    pub predicted_sd_m: f64,
    /// Contact point (x, y, z) in `W`; none for a miss or an aborted touch.
    pub contact: Option<[f64; 3]>,
    /// Whether the touch was aborted.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub overload: bool,
    /// Contact height minus the prediction at the contact's place; around an object, distance
    /// outside the estimated surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_m: Option<f64>,
    /// Standard deviation of `error_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sd_m: Option<f64>,
    /// Ends of the 95 % band of `error_m`; omitted around an object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band_m: Option<[f64; 2]>,
    /// Contact height minus the repeated touch's, corrected for the predicted slope between the two
    /// places.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference_m: Option<f64>,
}

impl TrialRow {
    /// Returns the trial's number and planner.
    pub fn id(&self) -> TrialId {
        TrialId { trial: self.trial, planner: self.planner.clone() }
    }

    /// Creates a trial without touches, with the `failure` that ended it, if given.
    pub fn without_touches(trial: u32, planner: &str, failure: Option<String>) -> Self {
        let (views, touches, verification) = Default::default();
        let planner = planner.into();
        Self { trial, planner, failure, stopped: false, views, touches, verification }
    }

    /// Creates a trial that a fault ended before its first touch.
    pub(crate) fn not_started(trial: u32, planner: &str, fault: &Fault) -> Self {
        Self::without_touches(trial, planner, Some(format!("before the first touch: {fault}")))
    }

    /// Whether the trial failed, or stopped by its rule, before this number of touches. Its last
    /// belief then counts to the end.
    pub fn ended_before(&self, touches: u32) -> bool {
        (self.failure.is_some() || self.stopped) && self.touches.len() < touches as usize
    }

    /// Returns all actions up to touch `touches`, in order.
    pub fn steps(&self, touches: u32) -> impl Iterator<Item = Step<'_>> {
        let touched = self.touches.iter().take(touches as usize).zip(0..);
        touched.flat_map(|(touch, before)| {
            let views = self.views.iter().filter(move |view| view.after == before);
            let views = views.map(|ViewRow { target, outcome, fit, .. }| Step {
                target,
                outcome,
                fit: fit.as_ref(),
                likeness: None,
            });
            let TouchRow { target, outcome, fit, likeness, .. } = touch;
            let (fit, likeness) = (fit.as_ref(), likeness.as_ref());
            views.chain([Step { target, outcome, fit, likeness }])
        })
    }

    /// Travel of the finger over its first `touches` touches, along straight lines: between places
    /// of a zone; around an object between contacts, or the aimed points of touches without
    /// contact. `None` for a trial with fewer touches that has not ended.
    pub fn path_m(&self, touches: u32) -> Option<f64> {
        let made = match self.ended_before(touches) {
            true => &self.touches[..],
            false => self.touches.get(..touches as usize)?,
        };
        let places = made.iter().flat_map(TouchRow::places);
        let steps = places.clone().zip(places.skip(1));
        let lengths = steps.map(|(from, to)| {
            let squares = from.iter().zip(to).map(|(from, to)| (to - from).powi(2));
            squares.sum::<f64>().sqrt()
        });
        // The sum of no lengths is −0.
        Some(lengths.sum::<f64>() + 0.0)
    }
}

impl ViewRow {
    /// Returns the deviations of the found pose from the true one, if that is known.
    pub fn pose_deviations(&self) -> Option<Vec<f64>> {
        Some(self.true_error.as_ref()?.deviations(self.error.as_ref()?))
    }
}

impl TouchRow {
    /// Creates the row of a touch before the fit.
    pub(super) fn new(plan: Plan, outcome: Outcome) -> Self {
        Self {
            target: plan.target,
            // What a sensor located is in the evidence.
            outcome: Outcome { sensed: None, ..outcome },
            planned_sd_m: plan.sd_m,
            fallback: plan.fallback,
            fit: None,
            likeness: None,
            jitter: 0.0,
            rmse_bound_m: None,
            metrics: None,
            silhouette: None,
            shape: None,
            recognition: None,
        }
    }

    /// Whether the finger met nothing, and was not stopped by the force limit.
    pub fn is_miss(&self) -> bool {
        self.outcome.end == End::Miss
    }

    /// Point of contact in `W`, m; `None` for a miss or an aborted touch.
    pub fn contact(&self) -> Option<Point3<f64>> {
        self.outcome.contact().map(|contact| contact.p_wc)
    }

    /// Whether the finger slid along the surface.
    pub fn is_stroke(&self) -> bool {
        self.contact().is_some() && self.target.slide_m() > 0.0
    }

    /// Returns the points along a stroke with contact, in `W`, m.
    pub fn slid_w(&self) -> Option<Vec<Point3<f64>>> {
        let points = self.outcome.points();
        let is_line = self.is_stroke() && points.len() > 1;
        is_line.then(|| points.iter().map(|point| point.p_wc).collect())
    }

    /// Positions of the finger for [travel](TrialRow::path_m): one, or both ends of a stroke.
    fn places(&self) -> impl Iterator<Item = &[f64]> + Clone {
        let points = self.outcome.points();
        let place = self.target.place().or_else(|| {
            let aimed = self.target.aim().map(|aim| aim.p_w.coords.as_slice());
            points.first().map(|contact| contact.p_wc.coords.as_slice()).or(aimed)
        });
        let last = || points.last().map(|point| point.p_wc.coords.as_slice());
        let end = (self.target.slide_m() > 0.0).then(|| self.target.end().or_else(last)).flatten();
        place.into_iter().chain(end)
    }
}

/// Returns the rows of one planner.
pub fn planner_rows<'a>(
    rows: &'a [TrialRow],
    planner: &'a str,
) -> impl Iterator<Item = &'a TrialRow> {
    rows.iter().filter(move |row| row.planner == planner)
}

fn is_first(after: &u32) -> bool {
    *after == 0
}

fn is_zero(jitter: &f64) -> bool {
    *jitter == 0.0
}
