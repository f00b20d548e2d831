//! The lines of `trials.jsonl`.

use super::error::{StoreError, io_error};
use crate::experiment::experiment::Experiment;
use crate::experiment::row::{TouchRow, TrialId, TrialRow};
use crate::{files, words};
use std::cmp::Ordering;
use std::collections::HashSet;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;

/// Whether a results file has a whole line.
pub(super) fn has_some(trials: &File) -> io::Result<bool> {
    let mut line = Vec::new();
    BufReader::new(trials).read_until(b'\n', &mut line)?;
    Ok(line.ends_with(b"\n"))
}

/// Where a trial's row stands in its file.
pub(super) struct Place {
    pub id: TrialId,
    pub bytes: Range<u64>,
}

/// Reads a results file row by row, none of which stays in memory, and hands each with the bytes
/// that it fills to `each`; how many bytes all of them fill. A last line without its end was cut
/// short and is left out.
///
/// # Errors
/// If a line is not a row, or none that `experiment` can have, or the same trial again.
pub(super) fn scan(
    path: &Path,
    experiment: &Experiment,
    mut each: impl FnMut(TrialRow, Range<u64>),
) -> Result<u64, StoreError> {
    let mut file = BufReader::new(files::open(path).map_err(io_error(path))?);
    let (mut seen, mut line) = (HashSet::new(), Vec::new());
    let (mut number, mut good) = (0, 0);
    loop {
        line.clear();
        let length = file.read_until(b'\n', &mut line).map_err(io_error(path))? as u64;
        if !line.ends_with(b"\n") {
            return Ok(good);
        }
        number += 1;
        let bad = |message| StoreError::BadRow { path: path.into(), line: number, message };
        let row: TrialRow =
            serde_json::from_slice(&line).map_err(|error| bad(in_its_line(&error)))?;
        belongs(&row, experiment).map_err(bad)?;
        if !seen.insert(row.id()) {
            return Err(bad(format!("trial {} of {} stands there twice", row.trial, row.planner)));
        }
        each(row, good..good + length);
        good += length;
    }
}

/// Where the rows of a results file stand.
///
/// # Errors
/// As [`scan`].
pub(super) fn places(path: &Path, experiment: &Experiment) -> Result<Vec<Place>, StoreError> {
    let mut places = Vec::new();
    scan(path, experiment, |row, bytes| places.push(Place { id: row.id(), bytes }))?;
    Ok(places)
}

/// Copies the row at `bytes` of `from`.
pub(super) fn copy(from: &mut File, bytes: &Range<u64>, to: &mut impl Write) -> io::Result<()> {
    from.seek(SeekFrom::Start(bytes.start))?;
    io::copy(&mut from.take(bytes.end - bytes.start), to).map(|_| ())
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
    // A target, and the lengths of a fit.
    let dimensions = match experiment.scene.around {
        None => [experiment.scene.zone.dimension(); 2],
        Some(_) => [6, 3],
    };
    row.touches.iter().zip(1..).try_for_each(|(touch, count)| {
        fits(touch, dimensions).map_err(|message| format!("touch {count}: {message}"))
    })
}

/// Whether a touch has a target of as many coordinates, with a fit of as many lengths that a belief
/// can be made of; if not, why.
fn fits(touch: &TouchRow, [coordinates, dimension]: [usize; 2]) -> Result<(), String> {
    let target = touch.target.len();
    if target != coordinates {
        return Err(format!("a target of {target} coordinates where {coordinates} are needed"));
    }
    let Some(fit) = &touch.fit else { return Ok(()) };
    let found = &fit.hyperparameters;
    let lengths = found.length_scales.len();
    if lengths != dimension {
        return Err(format!("a fit of {lengths} length scales where {dimension} are needed"));
    }
    let positive = found.length_scales.iter().chain([&found.signal_sd]).all(|&size| size > 0.0);
    if !positive || found.noise_sd < 0.0 || found.slope_noise_sd < 0.0 {
        return Err("a fit with a size that is not positive".into());
    }
    Ok(())
}

/// The order of rows: by trial, and the experiment's planners, those not listed last.
pub(super) fn order(a: &TrialId, b: &TrialId, experiment: &Experiment) -> Ordering {
    let listed = |id: &TrialId| {
        let found = experiment.planners.iter().position(|planner| *planner == id.planner);
        found.unwrap_or(experiment.planners.len())
    };
    let by_planner = || listed(a).cmp(&listed(b)).then_with(|| a.planner.cmp(&b.planner));
    a.trial.cmp(&b.trial).then_with(by_planner)
}

/// Whether the rows that the experiment lists stand in order; the others may stand anywhere.
pub(super) fn is_sorted(places: &[Place], experiment: &Experiment) -> bool {
    let listed = places.iter().map(|place| &place.id).filter(|id| experiment.lists(id));
    listed.is_sorted_by(|a, b| order(a, b, experiment).is_le())
}
