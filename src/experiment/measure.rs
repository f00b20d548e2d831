//! What planners are compared by: numbers that a trial has after some touches.

use super::metrics::Metrics;
use super::row::{TouchRow, TrialRow};
use super::summary::path_m;
use std::fmt;

/// A number of a trial, in SI units.
pub struct Measure {
    /// Its name in files, unit last.
    pub name: &'static str,
    /// Its name in words.
    pub title: &'static str,
    /// The unit it is shown in, and how many of it make the SI unit.
    pub shown_in: (&'static str, f64),
    /// Whether more of it is better.
    pub more_is_better: bool,
    /// Its value after some touches; none where the trial has none.
    pub of: fn(&TrialRow, u32) -> Option<f64>,
}

impl fmt::Debug for Measure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name)
    }
}

const PLAIN: (&str, f64) = ("", 1.0);
const MM: (&str, f64) = ("mm", 1e3);

/// The share of the truth that an honest 95 % band holds.
const HONEST: f64 = 0.95;

/// Root mean square error.
pub const RMSE: Measure = less("rmse_m", "RMSE", MM, |row, n| Some(metrics(row, n)?.rmse_m));
/// Root mean square error in the outer tenth of the zone.
pub const EDGE_RMSE: Measure =
    less("edge_rmse_m", "RMSE in the outer tenth", MM, |row, n| metrics(row, n)?.edge_rmse_m);
/// Root mean square error where the finger can touch the surface.
pub const REACHABLE_RMSE: Measure =
    less("reachable_rmse_m", "RMSE where the finger reaches", MM, |row, n| {
        metrics(row, n)?.reachable_rmse_m
    });

/// Every measure; one line to add one.
pub static MEASURES: [Measure; 11] = [
    RMSE,
    EDGE_RMSE,
    REACHABLE_RMSE,
    less("unreachable_rmse_m", "RMSE where it does not reach", MM, |row, n| {
        metrics(row, n)?.unreachable_rmse_m
    }),
    less("max_error_m", "largest error", MM, |row, n| Some(metrics(row, n)?.max_error_m)),
    more("r", "R (Eq. 5)", |row, n| Some(metrics(row, n)?.r)),
    more("centred_r", "centred R", |row, n| Some(metrics(row, n)?.centred_r)),
    less("coverage_off", "share in the 95 % band, away from 0.95", PLAIN, |row, n| {
        Some((metrics(row, n)?.coverage? - HONEST).abs())
    }),
    less("nlpd", "NLPD", PLAIN, |row, n| metrics(row, n)?.nlpd),
    less("path_m", "lateral travel", ("m", 1.0), |row, n| {
        (row.touches.len() >= n as usize).then(|| path_m(row, n))
    }),
    less("time_s", "time of the body", ("s", 1.0), |row, n| touch(row, n)?.time_s),
];

/// What is told of a trial without being better or worse.
static FACTS: [Measure; 3] = [
    less("coverage", "share in the 95 % band", PLAIN, |row, n| metrics(row, n)?.coverage),
    less("length_scale_x_m", "length scale along x", MM, |row, n| length_scale(row, n, 0)),
    less("length_scale_z_m", "length scale along z", MM, |row, n| length_scale(row, n, 1)),
];

/// Every measure, those that planners are compared by first.
pub fn all() -> impl Iterator<Item = &'static Measure> {
    MEASURES.iter().chain(&FACTS)
}

/// A measure of which less is better.
const fn less(
    name: &'static str,
    title: &'static str,
    shown_in: (&'static str, f64),
    of: fn(&TrialRow, u32) -> Option<f64>,
) -> Measure {
    Measure { name, title, shown_in, more_is_better: false, of }
}

/// A correlation.
const fn more(
    name: &'static str,
    title: &'static str,
    of: fn(&TrialRow, u32) -> Option<f64>,
) -> Measure {
    Measure { name, title, shown_in: PLAIN, more_is_better: true, of }
}

fn touch(row: &TrialRow, count: u32) -> Option<&TouchRow> {
    row.touches.get((count as usize).checked_sub(1)?)
}

fn metrics(row: &TrialRow, count: u32) -> Option<&Metrics> {
    touch(row, count)?.metrics.as_ref()
}

fn length_scale(row: &TrialRow, count: u32, axis: usize) -> Option<f64> {
    let fit = touch(row, count)?.fit.as_ref()?;
    fit.hyperparameters.length_scales.get(axis).copied()
}
