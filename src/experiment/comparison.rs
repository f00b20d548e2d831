//! Each planner against a baseline, trial by trial: they share initial touches.

use super::experiment::Experiment;
use super::measure::{MEASURES, Measure};
use super::row::TrialRow;
use super::statistics::Paired;
use super::summary;
use std::collections::HashMap;

/// Planners that the others are measured against, those that ran.
pub const BASELINES: [&str; 2] = ["random", "active"];

/// One measure of one planner against one baseline after the last touch.
#[derive(Debug)]
pub struct Comparison<'a> {
    /// Which planner.
    pub planner: &'a str,
    /// Against which.
    pub baseline: &'static str,
    /// What is compared.
    pub measure: &'static Measure,
    /// How it differs.
    pub paired: Paired,
}

/// Every planner against every baseline in every measure that both have.
pub fn comparisons<'a>(experiment: &'a Experiment, rows: &[TrialRow]) -> Vec<Comparison<'a>> {
    let mut found = Vec::new();
    for (planner, baseline) in pairs(experiment) {
        for measure in &MEASURES {
            let paired = paired(experiment, rows, [planner, baseline], experiment.touches, measure);
            found.extend(paired.map(|paired| Comparison { planner, baseline, measure, paired }));
        }
    }
    found
}

/// Every planner with every baseline that ran, baseline by baseline.
pub fn pairs(experiment: &Experiment) -> impl Iterator<Item = (&str, &'static str)> {
    let ran = |baseline: &&str| experiment.planners.iter().any(|planner| planner == baseline);
    BASELINES.into_iter().filter(ran).flat_map(|baseline| {
        let others = experiment.planners.iter().filter(move |planner| *planner != baseline);
        others.map(move |planner| (planner.as_str(), baseline))
    })
}

/// How a measure of the first planner differs from that of the second after `touches`.
pub fn paired(
    experiment: &Experiment,
    rows: &[TrialRow],
    [planner, baseline]: [&str; 2],
    touches: u32,
    measure: &Measure,
) -> Option<Paired> {
    let values = |planner| {
        summary::of(rows, planner).filter_map(|row| Some((row.trial, (measure.of)(row, touches)?)))
    };
    let theirs: HashMap<u32, f64> = values(baseline).collect();
    let pairs: Vec<(f64, f64)> =
        values(planner).filter_map(|(trial, value)| Some((value, *theirs.get(&trial)?))).collect();
    let mut paired = Paired::new(&pairs, experiment.seed)?;
    if measure.more_is_better {
        paired.won = 1.0 - paired.won;
    }
    Some(paired)
}
