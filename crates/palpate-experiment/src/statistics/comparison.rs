//! Paired comparison of each planner with a baseline: trials of the same number share initial
//! touches.

use crate::experiment::Experiment;
use crate::measure::{Direction, MEASURES, Measure};
use crate::row::{TrialRow, planner_rows};
use crate::statistics::PairedDifference;
use std::collections::HashMap;

/// One measure of one planner relative to one baseline after the last touch.
#[derive(Debug)]
pub struct PairedComparison<'a> {
    /// Name of the planner.
    pub planner: &'a str,
    /// Name of the baseline.
    pub baseline: &'a str,
    /// Compared measure.
    pub measure: &'static Measure,
    /// Paired difference.
    pub paired: PairedDifference,
}

/// Compares every planner with every baseline in every measure that both have and that has a
/// direction.
pub fn comparisons<'a>(experiment: &'a Experiment, rows: &[TrialRow]) -> Vec<PairedComparison<'a>> {
    let mut found = Vec::new();
    for (planner, baseline) in pairs(experiment) {
        for measure in MEASURES.iter().filter(|measure| measure.direction != Direction::Undirected)
        {
            let paired = paired(experiment, rows, [planner, baseline], experiment.touches, measure);
            found.extend(paired.map(|paired| PairedComparison {
                planner,
                baseline,
                measure,
                paired,
            }));
        }
    }
    found
}

/// Returns every planner with every other planner that is a baseline, ordered by baseline.
pub fn pairs(experiment: &Experiment) -> impl Iterator<Item = (&str, &str)> {
    experiment.baselines().into_iter().flat_map(|baseline| {
        let others = experiment.planners.iter().filter(move |planner| *planner != baseline);
        others.map(move |planner| (planner.as_str(), baseline))
    })
}

/// Paired difference of a measure between the first planner and the second after `touches`.
pub fn paired(
    experiment: &Experiment,
    rows: &[TrialRow],
    [planner, baseline]: [&str; 2],
    touches: u32,
    measure: &Measure,
) -> Option<PairedDifference> {
    let values = |planner| {
        planner_rows(rows, planner)
            .filter_map(|row| Some((row.trial, measure.value(row, touches)?)))
    };
    let theirs: HashMap<u32, f64> = values(baseline).collect();
    let pairs: Vec<(f64, f64)> =
        values(planner).filter_map(|(trial, value)| Some((value, *theirs.get(&trial)?))).collect();
    let mut paired = PairedDifference::new(&pairs, experiment.seed)?;
    if measure.direction == Direction::Maximise {
        paired.won = 1.0 - paired.won;
    }
    Some(paired)
}
