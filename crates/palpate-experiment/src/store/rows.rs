//! Lines of `trials.jsonl`.

use super::io::{RunError, io_error};
use crate::experiment::Experiment;
use crate::measure::{FAR_M, MEASURES};
use crate::row::{TouchRow, TrialId, TrialRow};
use palpate_input::format::counted;
use palpate_input::{files, format};
use std::cmp::Ordering;
use std::collections::HashSet;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;

/// Whether a results file has a row of a trial that made a touch; one that cannot be read counts as
/// such.
pub(super) fn has_touches(trials: &File) -> io::Result<bool> {
    let (mut lines, mut line) = (BufReader::new(trials), Vec::new());
    loop {
        line.clear();
        lines.read_until(b'\n', &mut line)?;
        if !line.ends_with(b"\n") {
            return Ok(false);
        }
        let row = serde_json::from_slice::<TrialRow>(&line);
        if row.map_or(true, |row| !row.touches.is_empty() || row.failure.is_none()) {
            return Ok(true);
        }
    }
}

/// Reads a results file row by row and passes each row with its byte range to `each`, without
/// keeping it. Returns the number of bytes of complete lines; an incomplete last line is ignored.
///
/// # Errors
/// If a line is not a row, does not fit `experiment`, or repeats a trial.
pub(super) fn scan(
    path: &Path,
    experiment: &Experiment,
    mut each: impl FnMut(TrialRow, Range<u64>),
) -> Result<u64, RunError> {
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
        let bad = |message: String| RunError::bad_row(path, number, message);
        let row: TrialRow =
            serde_json::from_slice(&line).map_err(|error| bad(line_error(&error)))?;
        check_row(&row, experiment).map_err(bad)?;
        if !seen.insert(row.id()) {
            return Err(bad(format!("duplicate trial {} of {}", row.trial, row.planner)));
        }
        each(row, good..good + length);
        good += length;
    }
}

/// Copies the row at `bytes` of `from`.
pub(super) fn copy(from: &mut File, bytes: &Range<u64>, to: &mut impl Write) -> io::Result<()> {
    from.seek(SeekFrom::Start(bytes.start))?;
    io::copy(&mut from.take(bytes.end - bytes.start), to).map(|_| ())
}

/// Describes the error in a line; the parser's own line number is always 1.
fn line_error(error: &serde_json::Error) -> String {
    format!("column {}: {}", error.column(), format::json(error))
}

/// Checks that a row fits the experiment, regardless of the trials and planners that it lists.
///
/// # Errors
/// The reason why it does not fit.
fn check_row(row: &TrialRow, experiment: &Experiment) -> Result<(), String> {
    let (found, wanted) = (row.touches.len(), experiment.touches as usize);
    if row.failure.is_none() && !row.stopped && found != wanted {
        return Err(format!("{} of {wanted}, but no failure is recorded", counted(found, "touch")));
    }
    if found > wanted {
        return Err(format!("{} of {wanted}", counted(found, "touch")));
    }
    // Coordinates of a target, and length scales of a fit.
    let dimensions = experiment.scene.zone.as_ref().map_or([AIM, 3], |zone| [zone.dimension(); 2]);
    row.touches.iter().zip(1..).try_for_each(|(touch, count)| {
        check_touch(touch, dimensions).map_err(|message| format!("touch {count}: {message}"))
    })
}

/// Number of coordinates of an aim's point and direction.
const AIM: usize = 6;

/// Checks the number of coordinates of a touch's target, and the fit's length scales and values.
///
/// # Errors
/// The reason why the touch does not fit.
fn check_touch(touch: &TouchRow, [coordinates, dimension]: [usize; 2]) -> Result<(), String> {
    let target = match touch.target.place() {
        Some(place) => place.len(),
        None => AIM,
    };
    if target != coordinates {
        return Err(format!("a target has {target} coordinates; needed are {coordinates}"));
    }
    if let Some((name, value, [low, high])) = out_of_range(touch) {
        return Err(format!("{name} is {value:?}; allowed is {low:?} to {high:?}"));
    }
    let Some(fit) = &touch.fit else { return Ok(()) };
    let found = &fit.hyperparameters;
    let lengths = found.length_scales.len();
    if lengths != dimension {
        return Err(format!("a fit has {lengths} length scales; needed are {dimension}"));
    }
    let positive = found.length_scales.iter().chain([&found.signal_sd]).all(|&size| size > 0.0);
    if !positive || found.noise_sd < 0.0 || found.slope_noise_sd < 0.0 {
        return Err("a fit has a scale that is not positive".into());
    }
    Ok(())
}

/// Returns the first value of a touch that is out of range, with its name and the range.
fn out_of_range(touch: &TouchRow) -> Option<(&'static str, f64, [f64; 2])> {
    let coordinate = |value: f64| ("a coordinate", value, [-FAR_M, FAR_M]);
    let points = touch.outcome.points().iter().map(|point| point.p_wc.coords);
    let tip = touch.outcome.free().map(|free| free.p_wt.coords);
    let places = points.chain(tip).flat_map(<[f64; 3]>::from);
    let coordinates = touch.target.numbers().into_iter().chain(places).map(coordinate);
    let measured = MEASURES.iter().filter_map(|measure| {
        Some((measure.id, measure.value_after_touch(touch)?, measure.unit.range))
    });
    coordinates.chain(measured).find(|(_, value, [low, high])| !(low..=high).contains(&value))
}

/// Order of rows: by trial, then by the experiment's list of planners, unlisted planners last.
pub(super) fn order(a: &TrialId, b: &TrialId, experiment: &Experiment) -> Ordering {
    let listed = |id: &TrialId| {
        let found = experiment.planners.iter().position(|planner| *planner == id.planner);
        found.unwrap_or(experiment.planners.len())
    };
    let by_planner = || listed(a).cmp(&listed(b)).then_with(|| a.planner.cmp(&b.planner));
    a.trial.cmp(&b.trial).then_with(by_planner)
}

/// Whether the rows that the experiment lists are in order; other rows may be anywhere.
pub(super) fn is_sorted(places: &[(TrialId, Range<u64>)], experiment: &Experiment) -> bool {
    let listed = places.iter().map(|(id, _)| id).filter(|id| experiment.contains_trial(id));
    listed.is_sorted_by(|a, b| order(a, b, experiment).is_le())
}
