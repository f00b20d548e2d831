//! The folder a run's results lie in.
//!
//! `resolved.toml` (the experiment with every default written out), `manifest.json` (what ran it, a
//! program each), `content.json` (hashes of mesh, scan and of planners written outside of Palpate),
//! `surface.csv` (the truth on the test grid; of a whole object `surface.obj`), `trials.jsonl` (a
//! row per finished trial). Everything else in it is drawn from these.
//!
//! A folder holds the rows of one [identity](Experiment::identity). It may be opened with more
//! trials, other planners or another report: `resolved.toml` then says so, and what is missing is
//! run. Rows that are no longer listed stay in `trials.jsonl`, so no change loses a trial.
//!
//! `resolved.toml` is the mark of a run's folder: it is written first and never removed. A folder
//! that has it and no row yet, or at most the pieces of it that a crash leaves, is begun anew.

mod content;
mod error;
mod file;
mod journal;
mod manifest;
mod merge;
mod resolved;
mod rows;
mod surface;

pub use content::{CONTENT, Content};
pub use error::StoreError;
pub use file::write_whole;
pub use journal::{Entry, JOURNAL, Journal};
pub use manifest::{MANIFEST, Manifest};
pub use merge::{MergeError, Shards};
pub use resolved::{RESOLVED, resolved, resolved_beside};

use self::error::io_error;
use self::file::remove;
use self::rows::Place;
use self::surface::{MESH, SURFACE};
use crate::experiment::experiment::Experiment;
use crate::experiment::trial::row::{TrialId, TrialRow};
use crate::experiment::truth::Truth;
use crate::files;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const TRIALS: &str = "trials.jsonl";
/// Folder of a run's recordings.
pub const RECORDINGS: &str = "recordings";
/// Folder of a run's figures.
pub const FIGURES: &str = "figures";

/// A run folder that rows are being added to.
pub struct RunFolder {
    path: PathBuf,
    trials: File,
    /// What is about to add its first row.
    unsigned: Option<Manifest>,
}

/// A run folder read back.
pub struct Run {
    /// What was run.
    pub experiment: Experiment,
    /// The truth on its test grid.
    pub truth: Truth,
    /// The finished trials of those that the experiment lists, by trial and in its order of
    /// planners.
    pub rows: Vec<TrialRow>,
    /// How many other rows the folder has, of trials or planners that are not listed.
    pub unlisted: usize,
}

impl RunFolder {
    /// Opens `path` for `experiment`: makes it, or continues what was begun there, or, if
    /// `fresh` or if that has no row yet, throws it away.
    ///
    /// Returns the trials that are already there of those that the experiment lists. A last line
    /// cut short by a crash is dropped.
    ///
    /// # Errors
    /// If the folder holds something else or trials made of other `content`, is being written, or
    /// cannot be.
    pub fn open(
        path: &Path,
        experiment: &Experiment,
        truth: &Truth,
        content: &Content,
        fresh: bool,
    ) -> Result<(Self, Vec<TrialId>), StoreError> {
        fs::create_dir_all(path).map_err(io_error(path))?;
        let file = path.join(TRIALS);
        refuse_foreign(path)?;
        let trials = files::append(&file).map_err(io_error(&file))?;
        lock(&trials, path)?;
        let has_touches = fs::metadata(path.join(JOURNAL)).is_ok_and(|journal| journal.len() > 0);
        if fresh || !(has_touches || rows::has_some(&trials).map_err(io_error(&file))?) {
            trials.set_len(0).map_err(io_error(&file))?;
            // First of all, as the mark of a run's folder.
            resolved::write(path, experiment)?;
            clear(path)?;
        }
        resolved::same_run(path, experiment)?;
        let mut done = Vec::new();
        let good_bytes = rows::scan(&file, experiment, |row, _| done.push(row.id()))?;
        if trials.metadata().map_err(io_error(&file))?.len() > good_bytes {
            trials.set_len(good_bytes).map_err(io_error(&file))?;
        }
        let mut now = content.clone();
        let before = Content::read(path)?;
        let has_row = |planner: &str| done.iter().any(|id| id.planner == planner);
        now.require_same(&before, path, |planner| has_touches || has_row(planner))?;
        now.extend(before);
        surface::write_or_compare(path, experiment, truth)?;
        now.write(path)?;
        resolved::write(path, experiment)?;
        done.retain(|id| experiment.lists(id));
        let unsigned = Some(Manifest::of(experiment));
        Ok((Self { path: path.into(), trials, unsigned }, done))
    }

    /// Adds a row and hands it to the operating system, so that a later kill cannot lose it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn append(&mut self, row: &TrialRow) -> Result<(), StoreError> {
        let file = self.path.join(TRIALS);
        let mut line = serde_json::to_vec(row).map_err(io::Error::from).map_err(io_error(&file))?;
        // A number that is not finite has no JSON: such a row could not be read back.
        if let Err(error) = serde_json::from_slice::<TrialRow>(&line) {
            return Err(StoreError::BadRow { path: file, line: 0, message: error.to_string() });
        }
        line.push(b'\n');
        self.append_line(&line)
    }

    fn append_line(&mut self, line: &[u8]) -> Result<(), StoreError> {
        if let Some(manifest) = self.unsigned.take() {
            manifest::sign(&self.path.join(MANIFEST), &manifest)?;
        }
        self.trials.write_all(line).map_err(io_error(&self.path.join(TRIALS)))
    }

    /// The touches and faults of a real arm.
    ///
    /// # Errors
    /// If they cannot be read or written.
    pub fn journal(&self) -> Result<Journal, StoreError> {
        Journal::open(&self.path)
    }

    /// Puts the rows in order of trial and planner: the same bytes whoever finished first, and
    /// however often trials and planners were added. What the rows are that the experiment lists.
    ///
    /// # Errors
    /// If the file cannot be read back or replaced.
    pub fn sort(self, experiment: &Experiment) -> Result<Tally, StoreError> {
        let file = self.path.join(TRIALS);
        let (mut places, mut tally) = (Vec::new(), Tally::default());
        rows::scan(&file, experiment, |row, bytes| {
            let id = row.id();
            if experiment.lists(&id) {
                tally.add(row, experiment);
            }
            places.push(Place { id, bytes });
        })?;
        if !rows::is_sorted(&places, experiment) {
            places.sort_by(|a, b| rows::order(&a.id, &b.id, experiment));
            let mut from = File::open(&file).map_err(io_error(&file))?;
            files::replace_by(&file, |to| {
                places.iter().try_for_each(|place| rows::copy(&mut from, &place.bytes, to))
            })
            .map_err(io_error(&file))?;
        }
        Ok(tally)
    }
}

/// What rows came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// How many there are.
    pub trials: usize,
    /// How many of them failed.
    pub failed: usize,
    /// The first that did, and why.
    pub first: Option<(TrialId, String)>,
}

impl Tally {
    fn add(&mut self, row: TrialRow, experiment: &Experiment) {
        self.trials += 1;
        let id = row.id();
        if let Some(reason) = row.failure {
            self.failed += 1;
            let is_before = |first: &TrialId| rows::order(&id, first, experiment).is_lt();
            if self.first.as_ref().is_none_or(|(first, _)| is_before(first)) {
                self.first = Some((id, reason));
            }
        }
    }
}

impl Run {
    /// Reads a run folder back.
    ///
    /// # Errors
    /// If it is not one, or a file in it is damaged.
    pub fn read(path: &Path) -> Result<Self, StoreError> {
        require_run(path)?;
        let experiment = resolved::read(path, &[])?;
        let truth = surface::read(&path.join(SURFACE), &experiment)?;
        let (mut rows, mut unlisted) = (Vec::new(), 0);
        rows::scan(&path.join(TRIALS), &experiment, |row, _| {
            let id = row.id();
            match experiment.lists(&id) {
                true => rows.push((id, row)),
                false => unlisted += 1,
            }
        })?;
        rows.sort_by(|(a, _), (b, _)| rows::order(a, b, &experiment));
        let rows = rows.into_iter().map(|(_, row)| row).collect();
        Ok(Self { experiment, truth, rows, unlisted })
    }
}

/// Changes what the report of the run in `path` shows by `--set` assignments to `report.…` and
/// `question`.
///
/// # Errors
/// If an assignment is to something else or wrong, or the folder holds no run, is being written,
/// or cannot be.
pub fn set_report(path: &Path, sets: &[String]) -> Result<(), StoreError> {
    require_run(path)?;
    sets.iter().try_for_each(|set| resolved::only_shown(set))?;
    let experiment = resolved::read(path, sets)?;
    let file = path.join(TRIALS);
    let trials = File::open(&file).map_err(io_error(&file))?;
    lock(&trials, path)?;
    resolved::write(path, &experiment)
}

/// Keeps every other process from writing the folder while `trials` is open.
fn lock(trials: &File, path: &Path) -> Result<(), StoreError> {
    match trials.try_lock() {
        Err(TryLockError::WouldBlock) => Err(StoreError::Busy { path: path.into() }),
        Err(TryLockError::Error(cause)) => Err(StoreError::Io { path: path.join(TRIALS), cause }),
        Ok(()) => Ok(()),
    }
}

fn require_run(path: &Path) -> Result<(), StoreError> {
    for missing in [RESOLVED, SURFACE, TRIALS] {
        if !path.join(missing).is_file() {
            return Err(StoreError::NotARun { path: path.into(), missing });
        }
    }
    Ok(())
}

/// Removes what an earlier run wrote but its mark. Figures are drawn again; others' files beside
/// them are not ours to remove.
fn clear(path: &Path) -> Result<(), StoreError> {
    for recording in fs::read_dir(path.join(RECORDINGS)).into_iter().flatten().flatten() {
        let recording = recording.path();
        if recording.extension().is_some_and(|extension| extension == "mcap") {
            remove(&recording)?;
        }
    }
    let tables = ["report.html", "summary.csv", "comparison.csv", "equal_error.csv"];
    let own = [MANIFEST, CONTENT, SURFACE, MESH, JOURNAL];
    tables.iter().chain(&own).try_for_each(|name| remove(&path.join(name)))
}

/// A folder that is not empty must hold a run, or at most what a crash leaves of a beginning: no
/// rows, and of `resolved.toml` nothing or a part.
fn refuse_foreign(path: &Path) -> Result<(), StoreError> {
    let length = |name: &str| {
        let found = fs::metadata(path.join(name)).ok();
        found.filter(fs::Metadata::is_file).map(|found| found.len())
    };
    let foreign = || StoreError::Foreign { path: path.into() };
    if path.join(TRIALS).exists() && length(TRIALS).is_none() {
        return Err(foreign());
    }
    let has_rows = length(TRIALS).is_some_and(|length| length > 0);
    if resolved::is_ours(path) || has_rows && length(RESOLVED).is_some() {
        return Ok(());
    }
    let part = files::partial(Path::new(RESOLVED));
    for entry in fs::read_dir(path).map_err(io_error(path))? {
        let name = entry.map_err(io_error(path))?.file_name();
        let is_empty = name.to_str().and_then(length) == Some(0);
        let is_left = *part == *name || is_empty && (name == TRIALS || name == RESOLVED);
        if !is_left {
            return Err(foreign());
        }
    }
    Ok(())
}
