//! What a planner is judged by when it is held against what it was: one line to add one.

use crate::experiment::Experiment;
use crate::experiment::measure::{CENTRED_R, CHAMFER, RMSE};
use crate::experiment::trial::row::{TouchRow, TrialRow};
use serde::Serialize;

/// A number of a trial, less of which is better.
#[derive(Debug)]
pub struct Judged {
    /// Its name in files.
    pub id: &'static str,
    /// Its name in words.
    pub title: &'static str,
    /// Whether it is a logarithm, in which a difference of 0.05 is five percent; otherwise it is a
    /// share of a trial's touches, in which that is five in a hundred.
    pub is_log: bool,
    /// Its value over the touches after the initial ones, to the last; none where the trial has
    /// none.
    pub of: fn(&TrialRow, &Experiment) -> Option<f64>,
}

/// Errors and ways are not taken to be less; of zero there is no logarithm.
const LEAST: f64 = 1e-12;

fn log(value: f64) -> f64 {
    value.max(LEAST).ln()
}

/// The error that trials are judged by, in metres: over a zone the RMSE, around a whole object the
/// Chamfer distance; none where it was not taken.
fn error_m(row: &TrialRow, touches: u32) -> Option<f64> {
    RMSE.of(row, touches).or_else(|| CHAMFER.of(row, touches))
}

fn share(row: &TrialRow, of: &Experiment, is_it: fn(&TouchRow) -> bool) -> Option<f64> {
    let planned = row.touches.get(of.initial_touches as usize..of.touches as usize)?;
    let count = planned.iter().filter(|touch| is_it(touch)).count();
    (!planned.is_empty()).then(|| count as f64 / planned.len() as f64)
}

/// The mean over the touches sees a loss that the last touch hides, and of all measures needs the
/// fewest trials; so it is the first, which decides.
pub static JUDGED: &[Judged] = &[
    Judged::log("mean_log_rmse", "mean log error over the touches", |row, of| {
        let after = of.initial_touches.max(1)..=of.touches;
        let whole = row.touches.len() >= of.touches as usize;
        let logs = after.filter_map(|n| error_m(row, n).map(log));
        let (count, sum) = logs.fold((0.0, 0.0), |(count, sum), log| (count + 1.0, sum + log));
        (whole && count > 0.0).then(|| sum / count)
    }),
    Judged::log("log_rmse", "error after the last touch", |row, of| {
        error_m(row, of.touches).map(log)
    }),
    Judged::log("log_1_minus_centred_r", "1 − centred R after the last touch", |row, of| {
        CENTRED_R.of(row, of.touches).map(|r| log(1.0 - r))
    }),
    Judged::log("log_path", "lateral travel", |row, of| row.path_m(of.touches).map(log)),
    Judged::share("missed", "share of touches that met nothing", |row, of| {
        share(row, of, |touch| touch.contact.is_none())
    }),
    Judged::share("stalled", "share of plans that fell back", |row, of| {
        share(row, of, |touch| touch.stall.is_some())
    }),
];

impl Judged {
    const fn log(
        id: &'static str,
        title: &'static str,
        of: fn(&TrialRow, &Experiment) -> Option<f64>,
    ) -> Self {
        Self { id, title, is_log: true, of }
    }

    const fn share(
        id: &'static str,
        title: &'static str,
        of: fn(&TrialRow, &Experiment) -> Option<f64>,
    ) -> Self {
        Self { is_log: false, ..Self::log(id, title, of) }
    }

    /// The difference that `tolerance`, a share of the error, allows.
    pub fn allowed(&self, tolerance: f64) -> f64 {
        if self.is_log { tolerance.ln_1p() } else { tolerance }
    }

    /// A difference in percent: of the value, or of the touches.
    pub fn percent(&self, difference: f64) -> f64 {
        100.0 * if self.is_log { difference.exp_m1() } else { difference }
    }
}

/// What is said of one measure of one planner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// No difference in any trial.
    Identical,
    /// Less of what should be little.
    Better,
    /// Not more than is tolerated.
    Ok,
    /// These trials cannot tell.
    Undecided,
    /// More of it.
    Worse,
    /// No trial has it, of which the baseline has some.
    Missing,
}
