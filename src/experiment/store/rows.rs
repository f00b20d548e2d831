//! The lines of `trials.jsonl`.

use super::error::{StoreError, io_error};
use crate::experiment::experiment::Experiment;
use crate::experiment::row::{TouchRow, TrialRow};
use crate::{files, words};
use std::collections::HashSet;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;

/// Whether a results file has a whole line.
pub(super) fn has_some(trials: &File) -> io::Result<bool> {
    let mut line = Vec::new();
    BufReader::new(trials).read_until(b'\n', &mut line)?;
    Ok(line.ends_with(b"\n"))
}

/// Rows of a results file and the number of bytes they fill; a last line without its end was cut
/// short and is left out.
///
/// # Errors
/// If a line is not a row, or none that `experiment` can have, or the same trial again.
pub(super) fn read(
    path: &Path,
    experiment: &Experiment,
) -> Result<(Vec<TrialRow>, u64), StoreError> {
    let bytes = files::bytes(path, u64::MAX).map_err(io_error(path))?;
    let (mut rows, mut good) = (Vec::new(), 0);
    let mut seen = HashSet::new();
    let lines = bytes.split_inclusive(|&byte| byte == b'\n').filter(|line| line.ends_with(b"\n"));
    for (i, line) in lines.enumerate() {
        let bad = |message| StoreError::BadRow { path: path.into(), line: i + 1, message };
        let row: TrialRow =
            serde_json::from_slice(line).map_err(|error| bad(in_its_line(&error)))?;
        belongs(&row, experiment).map_err(bad)?;
        if !seen.insert((row.trial, row.planner.clone())) {
            return Err(bad(format!("trial {} of {} stands there twice", row.trial, row.planner)));
        }
        rows.push(row);
        good += line.len();
    }
    Ok((rows, good as u64))
}

/// What is wrong with a line: the parser knows no other.
fn in_its_line(error: &serde_json::Error) -> String {
    format!("column {}: {}", error.column(), words::json(error))
}

/// Whether a row can be one of the experiment's, whichever trials and planners it lists; if not,
/// why.
fn belongs(row: &TrialRow, experiment: &Experiment) -> Result<(), String> {
    let (found, wanted) = (row.touches.len(), experiment.touches as usize);
    if row.failure.is_none() && found != wanted {
        return Err(format!("{found} touches of {wanted}, and no reason why"));
    }
    if found > wanted {
        return Err(format!("{found} touches of {wanted}"));
    }
    let dimension = experiment.scene.zone.dimension();
    row.touches.iter().zip(1..).try_for_each(|(touch, count)| {
        fits(touch, dimension).map_err(|message| format!("touch {count}: {message}"))
    })
}

/// Whether a touch is one in a zone of `dimension`, with a fit that a belief can be made of; if
/// not, why.
fn fits(touch: &TouchRow, dimension: usize) -> Result<(), String> {
    let target = touch.target.len();
    if target != dimension {
        return Err(format!("a target of {target} coordinates in a zone of {dimension}"));
    }
    let Some(fit) = &touch.fit else { return Ok(()) };
    let found = &fit.hyperparameters;
    let lengths = found.length_scales.len();
    if lengths != dimension {
        return Err(format!("a fit of {lengths} length scales in a zone of {dimension}"));
    }
    let positive = found.length_scales.iter().chain([&found.signal_sd]).all(|&size| size > 0.0);
    if !positive || found.noise_sd < 0.0 || found.slope_noise_sd < 0.0 {
        return Err("a fit with a size that is not positive".into());
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
