//! Each planner against a baseline, trial by trial: they share initial touches.

use crate::experiment::experiment::Experiment;
use crate::experiment::measure::{Direction, MEASURES, Measure};
use crate::experiment::statistics::Paired;
use crate::experiment::trial::row::{TrialRow, of_planner};
use std::collections::HashMap;

/// One measure of one planner against one baseline after the last touch.
#[derive(Debug)]
pub struct Comparison<'a> {
    /// Which planner.
    pub planner: &'a str,
    /// Against which.
    pub baseline: &'a str,
    /// What is compared.
    pub measure: &'static Measure,
    /// How it differs.
    pub paired: Paired,
}

/// Every planner against every baseline in every measure that both have and that can be better.
pub fn comparisons<'a>(experiment: &'a Experiment, rows: &[TrialRow]) -> Vec<Comparison<'a>> {
    let mut found = Vec::new();
    for (planner, baseline) in pairs(experiment) {
        for measure in MEASURES.iter().filter(|measure| measure.direction != Direction::Neither) {
            let paired = paired(experiment, rows, [planner, baseline], experiment.touches, measure);
            found.extend(paired.map(|paired| Comparison { planner, baseline, measure, paired }));
        }
    }
    found
}

/// Every planner with every baseline but itself, baseline by baseline.
pub fn pairs(experiment: &Experiment) -> impl Iterator<Item = (&str, &str)> {
    experiment.baselines().into_iter().flat_map(|baseline| {
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
        of_planner(rows, planner).filter_map(|row| Some((row.trial, measure.of(row, touches)?)))
    };
    let theirs: HashMap<u32, f64> = values(baseline).collect();
    let pairs: Vec<(f64, f64)> =
        values(planner).filter_map(|(trial, value)| Some((value, *theirs.get(&trial)?))).collect();
    let mut paired = Paired::new(&pairs, experiment.seed)?;
    if measure.direction == Direction::More {
        paired.won = 1.0 - paired.won;
    }
    Some(paired)
}
