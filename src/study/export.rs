//! Choice of the belief that is exported: a trial of a planner, after some touches.

use crate::experiment::row::{TrialRow, planner_rows};
use crate::experiment::store::Run;
use anyhow::{bail, ensure};

/// Choice of a belief of a run.
pub struct ExportSpec<'a> {
    /// Planner.
    pub planner: &'a str,
    /// Trial; `None` for the median trial by final error.
    pub trial: Option<u32>,
    /// Number of touches; `None` for all.
    pub touches: Option<u32>,
}

/// Returns the finished trials of a planner with their final errors, the smallest error first;
/// empty without ground truth.
pub fn ranked<'a>(run: &'a Run, planner: &'a str) -> Vec<(&'a TrialRow, f64)> {
    let experiment = &run.experiment;
    let finished = planner_rows(&run.rows, planner).filter(|row| row.failure.is_none());
    let error = |row| experiment.error_measure().value(row, experiment.touches);
    let mut ranked: Vec<(&TrialRow, f64)> =
        finished.filter_map(|row| Some((row, error(row)?))).collect();
    ranked.sort_by(|(_, a), (_, b)| a.total_cmp(b));
    ranked
}

/// Returns the index of the median in a list of this length; of the two middle ones the first.
pub fn median_index(count: usize) -> usize {
    count.saturating_sub(1) / 2
}

/// Returns the chosen trial, and the number of its touches.
///
/// # Errors
/// If the run lacks the planner, the trial or the touch count.
pub fn select(run: &Run, spec: &ExportSpec) -> anyhow::Result<(u32, u32)> {
    let planner = spec.planner;
    let planners = &run.experiment.planners;
    ensure!(
        planners.iter().any(|known| known == planner),
        "--planner {planner}: this run has {}",
        planners.join(", ")
    );
    let mut rows = planner_rows(&run.rows, planner);
    let ranked = ranked(run, planner);
    let median = ranked.get(median_index(ranked.len())).map(|(row, _)| *row);
    let row = match spec.trial {
        None => median.or_else(|| rows.next()),
        Some(trial) => rows.find(|row| row.trial == trial),
    };
    let Some(row) = row else {
        let asked = spec.trial.map_or("--trial".into(), |trial| format!("--trial {trial}"));
        // Rows are ordered by trial.
        let mut trials = planner_rows(&run.rows, planner).map(|row| row.trial);
        match (trials.next(), trials.last()) {
            (Some(first), last) => {
                let last = last.unwrap_or(first);
                bail!("{asked}: {planner} has finished trials {first} to {last}")
            }
            _ => bail!("{asked}: {planner} has finished no trial"),
        }
    };
    let (first, last) = (run.experiment.first_fit(), row.touches.len() as u32);
    let touches = spec.touches.unwrap_or(last);
    ensure!(
        (first..=last).contains(&touches),
        "--touches {touches}: trial {} of {planner} has beliefs after {first} to {last} touches",
        row.trial
    );
    Ok((row.trial, touches))
}
