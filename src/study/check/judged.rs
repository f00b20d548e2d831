//! What a planner is judged by when it is held against what it was: one line to add one.

use crate::experiment::measure::{CENTRED_R, CHAMFER, RMSE};
use crate::experiment::trial::row::{TouchRow, TrialRow};

/// A number of a trial, less of which is better.
#[derive(Debug)]
pub struct Judged {
    /// Its name in files.
    pub id: &'static str,
    /// Its name in words.
    pub title: &'static str,
    /// In what it is taken.
    pub scale: Scale,
    /// Its value; none where the trial has none.
    pub of: fn(&TrialRow, Span) -> Option<f64>,
}

/// In what differences are taken and tolerated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Logarithms: a difference of 0.05 is five percent.
    Log,
    /// Shares of a trial's touches: a difference of 0.05 is five in a hundred.
    Share,
}

/// Which touches of a trial count: after the initial ones, to the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// Initial touches, the same for all planners.
    pub initial: u32,
    /// Touches in all.
    pub touches: u32,
}

/// Errors and ways are not taken to be less; of zero there is no logarithm.
const LEAST: f64 = 1e-12;

fn log(value: f64) -> f64 {
    value.max(LEAST).ln()
}

/// The error that trials are judged by, in metres: over a zone the RMSE, around a whole object the
/// Chamfer distance; none where it was not taken.
fn error_m(row: &TrialRow, touches: u32) -> Option<f64> {
    (RMSE.of)(row, touches).or_else(|| (CHAMFER.of)(row, touches))
}

fn share(row: &TrialRow, span: Span, is_it: fn(&TouchRow) -> bool) -> Option<f64> {
    let planned = row.touches.get(span.initial as usize..span.touches as usize)?;
    let count = planned.iter().filter(|touch| is_it(touch)).count();
    (!planned.is_empty()).then(|| count as f64 / planned.len() as f64)
}

/// The mean over the touches sees a loss that the last touch hides, and of all measures needs the
/// fewest trials; so it is the first, which decides.
pub static JUDGED: &[Judged] = &[
    Judged {
        id: "mean_log_rmse",
        title: "mean log error over the touches",
        scale: Scale::Log,
        of: |row, span| {
            let after = span.initial.max(1)..=span.touches;
            let whole = row.touches.len() >= span.touches as usize;
            let logs = after.filter_map(|n| error_m(row, n).map(log));
            let (count, sum) = logs.fold((0.0, 0.0), |(count, sum), log| (count + 1.0, sum + log));
            (whole && count > 0.0).then(|| sum / count)
        },
    },
    Judged {
        id: "log_rmse",
        title: "error after the last touch",
        scale: Scale::Log,
        of: |row, span| error_m(row, span.touches).map(log),
    },
    Judged {
        id: "log_1_minus_centred_r",
        title: "1 − centred R after the last touch",
        scale: Scale::Log,
        of: |row, span| (CENTRED_R.of)(row, span.touches).map(|r| log(1.0 - r)),
    },
    Judged {
        id: "log_path",
        title: "lateral travel",
        scale: Scale::Log,
        of: |row, span| row.path_m(span.touches).map(log),
    },
    Judged {
        id: "missed",
        title: "share of touches that met nothing",
        scale: Scale::Share,
        of: |row, span| share(row, span, |touch| touch.contact.is_none()),
    },
    Judged {
        id: "stalled",
        title: "share of plans that fell back",
        scale: Scale::Share,
        of: |row, span| share(row, span, |touch| touch.stall.is_some()),
    },
];

impl Judged {
    /// The difference that `tolerance`, a share of the error, allows.
    pub fn allowed(&self, tolerance: f64) -> f64 {
        match self.scale {
            Scale::Log => tolerance.ln_1p(),
            Scale::Share => tolerance,
        }
    }

    /// A difference in percent: of the value, or of the touches.
    pub fn percent(&self, difference: f64) -> f64 {
        match self.scale {
            Scale::Log => 100.0 * difference.exp_m1(),
            Scale::Share => 100.0 * difference,
        }
    }
}
