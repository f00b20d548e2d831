//! One line of `trials.jsonl`: everything a trial did.

use crate::experiment::measure::metrics::Metrics;
use crate::experiment::measure::outline::Outline;
use crate::experiment::measure::shape::ShapeMetrics;
use palpate_explore::backend::Fault;
use palpate_explore::planner::Stall;
use palpate_explore::task::Target;
use palpate_gp::fit::Fit;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which of an experiment's trials.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct TrialId {
    /// Its number.
    pub trial: u32,
    /// Its planner.
    pub planner: String,
}

/// One trial of one planner. Holds no wall time, so that it is the same bytes on every run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialRow {
    /// Which trial; trials of the same number share initial touches.
    pub trial: u32,
    /// Which planner.
    pub planner: String,
    /// Why it ended before its last touch, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Its touches in order.
    pub touches: Vec<TouchRow>,
    /// Touches after the last, of which the belief learned nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub verification: Vec<VerificationRow>,
}

/// One touch and the belief after it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TouchRow {
    /// Where the finger was sent. Rows of version 0.1 hold its numbers without a name.
    pub target: Target,
    /// The point of contact (x, y, z) in `W`; none for a miss or a touch broken off.
    pub contact: Option<[f64; 3]>,
    /// Whether the touch was broken off: too much force, or no place in what the finger felt.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub overload: bool,
    /// The contact's normal in `W`; written where the belief observes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// The centre of the fingertip's hemisphere in `W` where the approach ended; written of misses,
    /// and of contacts where the belief takes in what they swept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip: Option<[f64; 3]>,
    /// Time of the body at the touch's end, since its start; left out where a touch is no motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Standard deviation that the planner saw at the target when it chose it, if it looked:
    /// the posterior's, given also that unreached targets are no news.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planned_sd_m: Option<f64>,
    /// Why the planner's own rule could not decide.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stall: Option<Stall>,
    /// The fit after this touch; none before the last initial touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fit>,
    /// Jitter the covariance needed, relative to its diagonal; left out when none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub jitter: f64,
    /// The belief after this touch against the truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metrics: Option<Metrics>,
    /// Where a surface is believed to be against the truth; left out where the object fills its
    /// zone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outline: Option<Outline>,
    /// The believed closed surface against the true one; left out where a zone is explored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeMetrics>,
}

/// A touch after a trial's last one, of which the belief learns nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VerificationRow {
    /// Where the finger was sent, as in the trial's touches.
    pub target: Target,
    /// Which of the trial's touches it repeats, counted from 1; none of a touch at a new place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub again: Option<u32>,
    /// Height that the belief expected at the target, before the touch was made. Around an object
    /// the distance from the point aimed at back to where the way was expected to meet the surface;
    /// 0 where nothing was expected on it.
    pub predicted_m: f64,
    /// Standard deviation of that, of a touch: σ² + noise².
    pub predicted_sd_m: f64,
    /// The point of contact (x, y, z) in `W`; none for a miss or a touch broken off.
    pub contact: Option<[f64; 3]>,
    /// Whether the touch was broken off.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub overload: bool,
    /// The contact's height above what the same belief expected at the contact's own place, which
    /// differs from the target; around an object its distance outside of the believed surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_m: Option<f64>,
    /// Standard deviation of that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sd_m: Option<f64>,
    /// The contact's height above that of the touch it repeats, less what the belief says that the
    /// surface rises from one place of contact to the other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference_m: Option<f64>,
}

impl TrialRow {
    /// Which trial it is.
    pub fn id(&self) -> TrialId {
        TrialId { trial: self.trial, planner: self.planner.clone() }
    }

    /// A trial without a touch, which `failure` ended if it is given.
    pub(in crate::experiment) fn ended(trial: u32, planner: &str, failure: Option<String>) -> Self {
        let (touches, verification) = (Vec::new(), Vec::new());
        Self { trial, planner: planner.into(), failure, touches, verification }
    }

    /// A trial that a fault ended before its first touch.
    pub(in crate::experiment) fn unstarted(trial: u32, planner: &str, fault: &Fault) -> Self {
        Self::ended(trial, planner, Some(format!("before the first touch: {fault}")))
    }

    /// Travel of the finger over its first `touches` touches, in straight lines: from place to
    /// place of a zone; around an object from contact to contact, or the point aimed at where
    /// nothing was met. None of a trial with fewer.
    pub fn path_m(&self, touches: u32) -> Option<f64> {
        let places = self.touches.get(..touches as usize)?.iter().map(TouchRow::place);
        let steps = places.clone().zip(places.skip(1));
        let lengths = steps.map(|(from, to)| {
            let squares = from.iter().zip(to).map(|(from, to)| (to - from).powi(2));
            squares.sum::<f64>().sqrt()
        });
        Some(lengths.sum())
    }
}

impl TouchRow {
    /// Where the finger was, as far as [travel](TrialRow::path_m) is concerned.
    fn place(&self) -> &[f64] {
        match (&self.target, &self.contact) {
            (Target::Place(place), _) => place,
            (Target::Aim(_), Some(contact)) => contact,
            (Target::Aim(aim), None) => aim.p_w.coords.as_slice(),
        }
    }
}

/// The rows of one planner.
pub fn of_planner<'a>(
    rows: &'a [TrialRow],
    planner: &'a str,
) -> impl Iterator<Item = &'a TrialRow> {
    rows.iter().filter(move |row| row.planner == planner)
}

fn is_zero(jitter: &f64) -> bool {
    *jitter == 0.0
}
