//! Curves over touches: what many trials of one planner have in common.

use super::experiment::Experiment;
use super::metrics::Metrics;
use super::row::{TouchRow, TrialRow};
use crate::conduct::planner::Stall;
use serde::Serialize;

/// One planner after one number of touches, over its trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
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
    /// Plans that fell back because the belief was sure everywhere.
    pub collapsed: usize,
    /// Plans that fell back because they repeated a target.
    pub repeated: usize,
}

/// A mean with its standard error, which a single value does not have.
pub fn mean_and_error(values: &[f64]) -> (f64, Option<f64>) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let error = (values.len() > 1).then(|| (squares / (count - 1.0) / count).sqrt());
    (mean, error)
}

/// The middle value, or the mean of the two middle ones; none of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = *sorted.get((sorted.len() - 1) / 2)?;
    Some(0.5 * (lower + upper))
}

/// The curve of one planner, from its first fit to its last touch.
pub fn curve(experiment: &Experiment, rows: &[TrialRow], planner: &str) -> Vec<Point> {
    (experiment.initial_touches..=experiment.touches)
        .filter_map(|touches| {
            let metrics: Vec<&Metrics> = of(rows, planner)
                .filter_map(|row| row.touches.get(touches as usize - 1)?.metrics.as_ref())
                .collect();
            let pick = |get: fn(&Metrics) -> f64| -> Vec<f64> {
                metrics.iter().map(|metrics| get(metrics)).collect()
            };
            let edges: Vec<f64> =
                metrics.iter().filter_map(|metrics| metrics.edge_rmse_m).collect();
            let rmse = pick(|metrics| metrics.rmse_m);
            let (r_mean, r_se) = mean_and_error(&pick(|metrics| metrics.r));
            let (centred_r_mean, centred_r_se) = mean_and_error(&pick(|metrics| metrics.centred_r));
            let (rmse_mean_m, rmse_se_m) = mean_and_error(&rmse);
            Some(Point {
                planner: planner.into(),
                touches,
                trials: metrics.len(),
                r_mean,
                r_se,
                centred_r_mean,
                centred_r_se,
                rmse_mean_m,
                rmse_se_m,
                rmse_median_m: median(&rmse)?,
                edge_rmse_median_m: median(&edges),
            })
        })
        .collect()
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
        events.misses += count(|touch| touch.contact.is_none());
        events.collapsed += count(|touch| touch.stall == Some(Stall::Collapsed));
        events.repeated += count(|touch| touch.stall == Some(Stall::Repeated));
    }
    events
}

/// The rows of one planner.
pub fn of<'a>(rows: &'a [TrialRow], planner: &'a str) -> impl Iterator<Item = &'a TrialRow> {
    rows.iter().filter(move |row| row.planner == planner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_error_and_median_are_the_textbooks() {
        let (mean, error) = mean_and_error(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(mean, 2.5);
        assert!((error.unwrap() - (5.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-15);
        assert_eq!(mean_and_error(&[3.0]), (3.0, None));
        assert_eq!(median(&[4.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(&[]), None);
    }
}
