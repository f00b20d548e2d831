//! The lines of `trials.jsonl`.

use super::error::{StoreError, io_error};
use crate::experiment::experiment::Experiment;
use crate::experiment::row::TrialRow;
use std::collections::HashSet;
use std::fs;
use std::path::Path;

/// Rows of a results file and the number of bytes they fill; a last line without its end was cut
/// short and is left out.
///
/// # Errors
/// If a line is not a row, or none that `experiment` can have, or the same trial again.
pub(super) fn read(
    path: &Path,
    experiment: &Experiment,
) -> Result<(Vec<TrialRow>, u64), StoreError> {
    let bytes = fs::read(path).map_err(io_error(path))?;
    let (mut rows, mut good) = (Vec::new(), 0);
    let mut seen = HashSet::new();
    let lines = bytes.split_inclusive(|&byte| byte == b'\n').filter(|line| line.ends_with(b"\n"));
    for (i, line) in lines.enumerate() {
        let bad = |message| StoreError::BadRow { path: path.into(), line: i + 1, message };
        let row: TrialRow = serde_json::from_slice(line).map_err(|error| bad(error.to_string()))?;
        belongs(&row, experiment).map_err(bad)?;
        if !seen.insert((row.trial, row.planner.clone())) {
            return Err(bad(format!("trial {} of {} stands there twice", row.trial, row.planner)));
        }
        rows.push(row);
        good += line.len();
    }
    Ok((rows, good as u64))
}

/// Whether a row can be one of the experiment's, whichever trials and planners it lists; if not,
/// why.
fn belongs(row: &TrialRow, experiment: &Experiment) -> Result<(), String> {
    if row.failure.is_none() && row.touches.len() != experiment.touches as usize {
        let (found, wanted) = (row.touches.len(), experiment.touches);
        return Err(format!("{found} touches of {wanted}, and no reason why"));
    }
    Ok(())
}

/// Puts rows in order of trial, and of the experiment's planners, those not listed last.
pub(super) fn sort(rows: &mut [TrialRow], experiment: &Experiment) {
    rows.sort_by(|a, b| key(a, experiment).cmp(&key(b, experiment)));
}

/// Whether the rows that the experiment lists stand in order; the others may stand anywhere.
pub(super) fn is_sorted(rows: &[TrialRow], experiment: &Experiment) -> bool {
    let listed = rows.iter().filter(|row| experiment.lists(row));
    listed.map(|row| key(row, experiment)).is_sorted()
}

fn key<'a>(row: &'a TrialRow, experiment: &Experiment) -> (u32, usize, &'a str) {
    let listed = experiment.planners.iter().position(|planner| *planner == row.planner);
    (row.trial, listed.unwrap_or(experiment.planners.len()), &row.planner)
}
