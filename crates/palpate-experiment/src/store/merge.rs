//! Merging of a run's shards; the result is byte-identical to a run in one process.

use super::io::{RunError, io_error};
use super::provenance::InputHashes;
use super::rows;
use super::surface::{self, SURFACE};
use super::{RunFolder, TRIALS, resolved};
use palpate_input::error::InputError;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Merges the run folders `shards`, which together contain each trial of one experiment once, into
/// a new run in `out`; `commit` is the program's commit. Returns the number of trials. Rows are
/// copied one at a time.
///
/// # Errors
/// If a trial is missing, duplicate or of another experiment, `out` already has rows, or a file
/// cannot be read or written.
pub fn merge(out: &Path, shards: &[PathBuf], commit: &str) -> Result<usize, RunError> {
    let first = shards.first().ok_or_else(|| InputError::new("no shards"))?;
    super::require_run(first)?;
    let experiment = resolved::read(first, &[])?;
    let truth = surface::read(&first.join(SURFACE), &experiment)?;
    let mut content = InputHashes::default();
    // Rows in order, each with its shard and its byte range.
    let mut places = Vec::new();
    for path in shards {
        super::require_run(path)?;
        let is_same = resolved::read(path, &[])?.without_paths() == experiment.without_paths()
            && surface::read(&path.join(SURFACE), &experiment)? == truth;
        if !is_same {
            let problem = format!(
                "not the experiment of {}: settings, planners, trials or the object differ",
                first.display()
            );
            return Err(RunError::at(path, problem));
        }
        let own = InputHashes::read(path)?;
        own.check_equal(&content, path, |_| true)?;
        content.extend(own);
        rows::scan(&path.join(TRIALS), &experiment, |row, bytes| {
            let id = row.id();
            if experiment.contains_trial(&id) {
                places.push(((id, bytes), path.as_path()));
            }
        })?;
    }
    places.sort_by(|((a, _), _), ((b, _), _)| rows::order(a, b, &experiment));
    let mut pairs = places.array_windows();
    if let Some([((id, _), a), (_, b)]) = pairs.find(|[((a, _), _), ((b, _), _)]| a == b) {
        let (a, b) = (a.display(), b.display());
        let problem = format!("trial {} of {} is in both {a} and {b}", id.trial, id.planner);
        return Err(InputError::new(problem).into());
    }
    let missing = experiment.missing_trials(places.iter().map(|((id, _), _)| id));
    if let Some((trial, planner)) = missing.first() {
        let problem = format!(
            "{} of {} trials are missing, the first is trial {trial} of {planner}: repeat its shard's \
             command to continue it",
            missing.len(),
            missing.len() + places.len()
        );
        return Err(InputError::new(problem).into());
    }
    let (mut folder, there) = RunFolder::open_as(out, &experiment, &truth, content, commit, false)?;
    if !there.is_empty() {
        return Err(RunError::at(out, "already has rows; use a new folder"));
    }
    let mut line = Vec::new();
    for ((_, bytes), shard) in &places {
        line.clear();
        let path = shard.join(TRIALS);
        // One file at a time: there may be more shards than a process may open files.
        File::open(&path)
            .and_then(|mut file| rows::copy(&mut file, bytes, &mut line))
            .map_err(io_error(&path))?;
        folder.append_line(&line)?;
    }
    Ok(places.len())
}
