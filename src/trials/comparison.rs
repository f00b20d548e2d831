//! Each planner against a baseline, trial by trial: they share initial touches.

use super::experiment::Experiment;
use super::metrics::Metrics;
use super::row::TrialRow;
use super::statistics::{Paired, touches_to_reach};
use super::summary::{self, Point};

/// Planners that the others are measured against, those that ran.
pub const BASELINES: [&str; 2] = ["random", "active"];

/// One planner against one baseline after the last touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Which planner.
    pub planner: String,
    /// Against which.
    pub baseline: String,
    /// Difference of the root mean square errors in m.
    pub rmse: Option<Paired>,
    /// Difference of those in the outer tenth of the zone.
    pub edge_rmse: Option<Paired>,
    /// Median error of the baseline after its last touch.
    pub goal_m: f64,
    /// Touches after which the planner's median error stays at or below that.
    pub touches_to_goal: Option<u32>,
    /// The baseline's own.
    pub baseline_touches_to_goal: Option<u32>,
}

/// Every planner against every baseline.
pub fn comparisons(experiment: &Experiment, rows: &[TrialRow]) -> Vec<Comparison> {
    let curve = |planner: &str| -> Vec<(u32, f64)> {
        let points = summary::curve(experiment, rows, planner);
        points.iter().map(|point: &Point| (point.touches, point.rmse_median_m)).collect()
    };
    let curves: Vec<_> = experiment.planners.iter().map(|name| (name, curve(name))).collect();
    let of_baseline = |baseline: &str| {
        let (_, baseline_curve) = curves.iter().find(|(name, _)| *name == baseline)?;
        let goal_m = baseline_curve.last()?.1;
        let others = curves.iter().filter(|(name, points)| *name != baseline && !points.is_empty());
        let compared = others.map(|(planner, points)| {
            let against = |measure: fn(&Metrics) -> Option<f64>| {
                paired(experiment, rows, [planner, baseline], experiment.touches, measure)
            };
            Comparison {
                planner: planner.to_string(),
                baseline: baseline.into(),
                rmse: against(|metrics| Some(metrics.rmse_m)),
                edge_rmse: against(|metrics| metrics.edge_rmse_m),
                goal_m,
                touches_to_goal: touches_to_reach(points, goal_m),
                baseline_touches_to_goal: touches_to_reach(baseline_curve, goal_m),
            }
        });
        Some(compared.collect::<Vec<_>>())
    };
    BASELINES.into_iter().filter_map(of_baseline).flatten().collect()
}

/// How a measure of the first planner differs from that of the second after `touches`.
pub fn paired(
    experiment: &Experiment,
    rows: &[TrialRow],
    [planner, baseline]: [&str; 2],
    touches: u32,
    measure: impl Fn(&Metrics) -> Option<f64>,
) -> Option<Paired> {
    let values = |planner| {
        summary::of(rows, planner).filter_map(|row| {
            let last = row.touches.get((touches as usize).checked_sub(1)?)?;
            Some((row.trial, measure(last.metrics.as_ref()?)?))
        })
    };
    let theirs: std::collections::HashMap<u32, f64> = values(baseline).collect();
    let pairs: Vec<(f64, f64)> =
        values(planner).filter_map(|(trial, error)| Some((error, *theirs.get(&trial)?))).collect();
    Paired::new(&pairs, experiment.seed)
}
