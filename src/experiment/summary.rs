//! Curves over touches: what many trials of one planner have in common.

use super::experiment::Experiment;
use super::metrics::Metrics;
use super::row::{TouchRow, TrialRow};
use super::statistics::{mean, mean_and_error, median};
use crate::explore::planner::Stall;
use serde::Serialize;

/// One planner after one number of touches, over its trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Which planner.
    pub planner: String,
    /// After how many touches.
    pub touches: u32,
    /// Trials that got this far.
    pub trials: usize,
    /// Mean of Eq. 5.
    pub r_mean: f64,
    /// Standard error of that mean; none of a single trial.
    pub r_se: Option<f64>,
    /// Mean of the centred correlation.
    pub centred_r_mean: f64,
    /// Standard error of that mean.
    pub centred_r_se: Option<f64>,
    /// Mean root mean square error.
    pub rmse_mean_m: f64,
    /// Standard error of that mean.
    pub rmse_se_m: Option<f64>,
    /// Median root mean square error.
    pub rmse_median_m: f64,
    /// Median root mean square error in the outer tenth of the zone.
    pub edge_rmse_median_m: Option<f64>,
    /// Median root mean square error where the finger can touch the surface.
    pub reachable_rmse_median_m: Option<f64>,
    /// Median root mean square error where it cannot.
    pub unreachable_rmse_median_m: Option<f64>,
    /// Median largest error.
    pub max_error_median_m: Option<f64>,
    /// Mean share of the truth inside the 95 % band.
    pub coverage_mean: Option<f64>,
    /// Mean negative log predictive density.
    pub nlpd_mean: Option<f64>,
    /// Mean lateral travel from target to target since the first.
    pub path_mean_m: f64,
    /// Mean time of the body; none where a touch is no motion.
    pub time_mean_s: Option<f64>,
}

/// What happened to one planner's trials besides their errors.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Events {
    /// Trials begun.
    pub trials: usize,
    /// Trials that ended early.
    pub failures: usize,
    /// Touches that met nothing.
    pub misses: usize,
    /// Touches broken off: too much force, or no place in what the finger felt.
    pub overloads: usize,
    /// Plans that fell back because the belief was sure of the best place.
    pub collapsed: usize,
    /// Plans that fell back because they repeated a target.
    pub repeated: usize,
}

/// The curve of one planner, from its first fit to its last touch.
pub fn curve(experiment: &Experiment, rows: &[TrialRow], planner: &str) -> Vec<CurvePoint> {
    (experiment.initial_touches..=experiment.touches)
        .filter_map(|touches| {
            let trials: Vec<(&TrialRow, &Metrics)> = of(rows, planner)
                .filter_map(|row| {
                    Some((row, row.touches.get(touches as usize - 1)?.metrics.as_ref()?))
                })
                .collect();
            let pick = |get: fn(&Metrics) -> f64| -> Vec<f64> {
                trials.iter().map(|(_, metrics)| get(metrics)).collect()
            };
            let pick_some = |get: fn(&Metrics) -> Option<f64>| -> Vec<f64> {
                trials.iter().filter_map(|(_, metrics)| get(metrics)).collect()
            };
            let mean_of = |values: Vec<f64>| (!values.is_empty()).then(|| mean(&values));
            let paths: Vec<f64> = trials.iter().map(|(row, _)| path_m(row, touches)).collect();
            let times =
                trials.iter().filter_map(|(row, _)| row.touches[touches as usize - 1].time_s);
            let rmse = pick(|metrics| metrics.rmse_m);
            let (r_mean, r_se) = mean_and_error(&pick(|metrics| metrics.r));
            let (centred_r_mean, centred_r_se) = mean_and_error(&pick(|metrics| metrics.centred_r));
            let (rmse_mean_m, rmse_se_m) = mean_and_error(&rmse);
            Some(CurvePoint {
                planner: planner.into(),
                touches,
                trials: trials.len(),
                r_mean,
                r_se,
                centred_r_mean,
                centred_r_se,
                rmse_mean_m,
                rmse_se_m,
                rmse_median_m: median(&rmse)?,
                edge_rmse_median_m: median(&pick_some(|metrics| metrics.edge_rmse_m)),
                reachable_rmse_median_m: median(&pick_some(|metrics| metrics.reachable_rmse_m)),
                unreachable_rmse_median_m: median(&pick_some(|metrics| metrics.unreachable_rmse_m)),
                max_error_median_m: median(&pick(|metrics| metrics.max_error_m)),
                coverage_mean: mean_of(pick_some(|metrics| metrics.coverage)),
                nlpd_mean: mean_of(pick_some(|metrics| metrics.nlpd)),
                path_mean_m: mean(&paths),
                time_mean_s: mean_of(times.collect()),
            })
        })
        .collect()
}

/// Lateral travel of the finger over its first `touches` targets, in straight lines.
pub fn path_m(row: &TrialRow, touches: u32) -> f64 {
    let targets = row.touches.iter().take(touches as usize).map(|touch| &touch.target);
    let steps = targets.clone().zip(targets.skip(1));
    let lengths = steps.map(|(from, to)| {
        let squares = from.iter().zip(to).map(|(from, to)| (to - from).powi(2));
        squares.sum::<f64>().sqrt()
    });
    lengths.sum()
}

/// What happened to one planner's trials.
pub fn events(rows: &[TrialRow], planner: &str) -> Events {
    let mut events = Events::default();
    for row in of(rows, planner) {
        let count = |condition: fn(&TouchRow) -> bool| {
            row.touches.iter().filter(|touch| condition(touch)).count()
        };
        events.trials += 1;
        events.failures += usize::from(row.failure.is_some());
        events.misses += count(|touch| touch.contact.is_none() && !touch.overload);
        events.overloads += count(|touch| touch.overload);
        events.collapsed += count(|touch| touch.stall == Some(Stall::Collapsed));
        events.repeated += count(|touch| touch.stall == Some(Stall::Repeated));
    }
    events
}

/// The rows of one planner.
pub fn of<'a>(rows: &'a [TrialRow], planner: &'a str) -> impl Iterator<Item = &'a TrialRow> {
    rows.iter().filter(move |row| row.planner == planner)
}
