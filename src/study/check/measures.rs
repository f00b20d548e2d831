//! Measures of the regression test.

use crate::experiment::Experiment;
use crate::experiment::measure::{CENTRED_R, CHAMFER, REACHABLE_RMSE, RMSE, ROBOT_TIME};
use crate::experiment::row::{TouchRow, TrialRow};
use serde::Serialize;

/// Measure of a trial; smaller is better.
#[derive(Debug)]
pub struct CheckMeasure {
    /// Name in files.
    pub id: &'static str,
    /// Title for readers.
    pub title: &'static str,
    /// Whether the value is a logarithm (a difference of 0.05 means 5 %); otherwise it is a share
    /// of a trial's touches.
    pub is_log: bool,
    /// Computes the value from the touches after the initial ones; `None` if the trial has no
    /// value.
    pub value: fn(&TrialRow, &Experiment) -> Option<f64>,
}

/// Lower bound on path lengths, times and shares before taking the logarithm.
const LOG_FLOOR: f64 = 1e-12;

/// Smallest error that counts, m: on a flat surface a smooth belief errs by rounding, and ratios of
/// such errors say nothing.
// heuristic: a thirtieth of the repeatability of the most precise arm here, the UR5e's 0.03 mm.
pub const ERROR_FLOOR_M: f64 = 1e-6;

fn log(value: f64) -> f64 {
    value.max(LOG_FLOOR).ln()
}

/// Whether a part of the surface is out of the finger's reach; the other part is then judged.
fn is_part(row: &TrialRow) -> bool {
    let metrics = row.touches.iter().filter_map(|touch| touch.metrics.as_ref());
    metrics.into_iter().any(|it| it.reachable_rmse_m.is_some() && it.unreachable_rmse_m.is_some())
}

/// Error of a trial in metres: the RMSE over a zone, the Chamfer distance around a whole object;
/// `None` if it was not computed. It is at least [`ERROR_FLOOR_M`].
fn error_m(row: &TrialRow, touches: u32) -> Option<f64> {
    let error_m = RMSE.value(row, touches).or_else(|| CHAMFER.value(row, touches))?;
    Some(error_m.max(ERROR_FLOOR_M))
}

/// Error of a trial as [`error_m`] has it, over the reachable part of a surface that has another
/// one.
fn reachable_error_m(row: &TrialRow, touches: u32) -> Option<f64> {
    let error_m = REACHABLE_RMSE.value(row, touches).filter(|_| is_part(row))?;
    Some(error_m.max(ERROR_FLOOR_M))
}

/// Mean logarithm of an error over the touches of a trial that ended; `None` without an error.
fn mean_log(
    row: &TrialRow,
    of: &Experiment,
    error_m: fn(&TrialRow, u32) -> Option<f64>,
) -> Option<f64> {
    let whole = row.touches.len() >= of.touches as usize || row.failure.is_some();
    let logs = (of.first_fit()..=of.touches).filter_map(|n| error_m(row, n).map(log));
    let (count, sum) = logs.fold((0.0, 0.0), |(count, sum), log| (count + 1.0, sum + log));
    (whole && count > 0.0).then(|| sum / count)
}

fn share(row: &TrialRow, of: &Experiment, is_it: fn(&TouchRow) -> bool) -> Option<f64> {
    let planned = row.touches.get(of.initial_touches as usize..of.touches as usize)?;
    let count = planned.iter().filter(|touch| is_it(touch)).count();
    (!planned.is_empty()).then(|| count as f64 / planned.len() as f64)
}

/// Mean logarithm of the error of the whole surface over the touches of a trial.
pub fn mean_log_error(row: &TrialRow, of: &Experiment) -> Option<f64> {
    mean_log(row, of, error_m)
}

/// Measures of the test. The first that a trial has decides: the mean over the touches detects a
/// loss that the last touch hides, and needs the fewest trials of all measures.
pub static CHECK_MEASURES: &[CheckMeasure] = &[
    CheckMeasure::log(
        "mean_log_reachable_rmse",
        "mean log error over the touches, reachable part",
        |row, of| mean_log(row, of, reachable_error_m),
    ),
    CheckMeasure::log("mean_log_rmse", "mean log error over the touches", |row, of| {
        mean_log_error(row, of).filter(|_| !is_part(row))
    }),
    CheckMeasure::log(
        "log_reachable_rmse",
        "error after the last touch, reachable part",
        |row, of| reachable_error_m(row, of.touches).map(log),
    ),
    CheckMeasure::log("log_rmse", "error after the last touch", |row, of| {
        error_m(row, of.touches).filter(|_| !is_part(row)).map(log)
    }),
    CheckMeasure::log(
        "log_1_minus_centred_r",
        "1 − centred R after the last touch",
        |row, of| CENTRED_R.value(row, of.touches).filter(|_| !is_part(row)).map(|r| log(1.0 - r)),
    ),
    CheckMeasure::log("log_path", "lateral travel", |row, of| row.path_m(of.touches).map(log)),
    CheckMeasure::log("log_time", "robot time", |row, of| {
        ROBOT_TIME.value(row, of.touches).map(log)
    }),
    CheckMeasure::share("missed", "share of touches without contact", |row, of| {
        share(row, of, |touch| touch.contact().is_none())
    }),
    CheckMeasure::share("stalled", "share of fallback plans", |row, of| {
        share(row, of, |touch| touch.fallback.is_some())
    }),
];

impl CheckMeasure {
    const fn log(
        id: &'static str,
        title: &'static str,
        of: fn(&TrialRow, &Experiment) -> Option<f64>,
    ) -> Self {
        Self { id, title, is_log: true, value: of }
    }

    const fn share(
        id: &'static str,
        title: &'static str,
        of: fn(&TrialRow, &Experiment) -> Option<f64>,
    ) -> Self {
        Self { is_log: false, ..Self::log(id, title, of) }
    }

    /// Allowed difference for `tolerance`, a relative error.
    pub fn allowed(&self, tolerance: f64) -> f64 {
        if self.is_log { tolerance.ln_1p() } else { tolerance }
    }

    /// Converts a difference to percent of the value, or of the touches.
    pub fn percent(&self, difference: f64) -> f64 {
        100.0 * if self.is_log { difference.exp_m1() } else { difference }
    }
}

/// Verdict on a measure of a planner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// No difference in any trial.
    Identical,
    /// Significantly smaller.
    Better,
    /// Within the tolerance.
    Ok,
    /// Not decided by these trials.
    Undecided,
    /// Significantly larger.
    Worse,
    /// No trial has the measure, but the baseline does.
    Missing,
}
