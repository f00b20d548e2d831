//! Folder of a run's results.
//!
//! Its files are `resolved.toml` (the experiment with all defaults), `manifest.json` (the programs
//! that wrote the run), `content.json` (hashes of input files and external planners), `surface.csv`
//! (ground truth on the test grid; `surface.obj` for a whole object) and `trials.jsonl` (a row per
//! finished trial). All other files are generated from these.
//!
//! A folder contains the rows of one [identity](Experiment::row_settings). It can be opened with
//! more trials, other planners or another report: `resolved.toml` is updated, and missing trials
//! are run. Rows that are no longer listed stay in `trials.jsonl`, so a change loses no trial.
//!
//! `resolved.toml` marks a run's folder: it is written first and never removed. A folder with it
//! and without a touch, since all its trials failed before, or with only the partial files of a
//! crash, is started again.

mod io;
mod journal;
mod merge;
mod provenance;
mod resolved;
mod rows;
mod surface;

pub use io::{RunError, write_whole};
pub use journal::{JOURNAL, Journal, JournalEntry};
pub use merge::merge;
pub use provenance::MANIFEST;
pub use resolved::{RESOLVED, resolved, resolved_beside};

use self::io::{io_error, remove};
use self::provenance::{CONTENT, InputHashes};
use self::surface::{MESH, SURFACE};
use crate::experiment::Experiment;
use crate::measure::{Measure, REACHABLE_RMSE};
use crate::metrics::truth::Truth;
use crate::notice;
use crate::row::{TrialId, TrialRow, planner_rows};
use crate::simulation::Simulation;
use palpate_input::error::InputError;
use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};

const TRIALS: &str = "trials.jsonl";
/// Folder of a run's recordings.
pub const RECORDINGS: &str = "recordings";
/// Folder of a run's figures.
pub const FIGURES: &str = "figures";

/// Run folder open for writing.
pub struct RunFolder {
    path: PathBuf,
    trials: File,
    /// Entry of this program for `manifest.json`, written with the first row.
    pending_manifest: Option<serde_json::Value>,
}

/// Returns the SHA-256 of a simulation's input files and external planners, by key as in
/// `content.json`.
///
/// # Errors
/// If a file cannot be read.
pub fn input_hashes(simulation: &Simulation) -> Result<BTreeMap<String, String>, RunError> {
    Ok(InputHashes::of(simulation)?.into_hashes())
}

/// Contents of a run folder.
pub struct Run {
    /// Experiment that was run.
    pub experiment: Experiment,
    /// Ground truth on the test grid.
    pub truth: Truth,
    /// Finished trials that the experiment lists, ordered by trial and by its list of planners.
    pub rows: Vec<TrialRow>,
    /// Number of other rows, of trials or planners that are not listed.
    pub unlisted: usize,
}

impl RunFolder {
    /// Opens `path` for the rows of `simulation`, run by a program built from `commit`. It creates
    /// the folder or continues an existing run; with `fresh`, or if no trial has made a touch, it
    /// starts again.
    ///
    /// Returns the finished trials that the experiment lists. A last line cut short by a crash is
    /// dropped.
    ///
    /// # Errors
    /// If the folder contains other files or trials of other settings or planners, another process
    /// is writing it, or it cannot be written.
    pub fn open(
        path: &Path,
        simulation: &Simulation,
        commit: &str,
        fresh: bool,
    ) -> Result<(Self, Vec<TrialId>), RunError> {
        let content = InputHashes::of(simulation)?;
        let (experiment, truth) = (simulation.experiment(), simulation.truth());
        Self::open_as(path, experiment, truth, content, commit, fresh)
    }

    fn open_as(
        path: &Path,
        experiment: &Experiment,
        truth: &Truth,
        mut content: InputHashes,
        commit: &str,
        fresh: bool,
    ) -> Result<(Self, Vec<TrialId>), RunError> {
        fs::create_dir_all(path).map_err(io_error(path))?;
        let file = path.join(TRIALS);
        check_ownership(path)?;
        let trials = palpate_input::files::append(&file).map_err(io_error(&file))?;
        lock(&trials, path)?;
        let has_touches = fs::metadata(path.join(JOURNAL)).is_ok_and(|journal| journal.len() > 0);
        if fresh || !(has_touches || rows::has_touches(&trials).map_err(io_error(&file))?) {
            trials.set_len(0).map_err(io_error(&file))?;
            // Written first, as the mark of a run's folder.
            resolved::write(path, experiment)?;
            clear(path)?;
        }
        resolved::check_identity(path, experiment)?;
        let mut done = Vec::new();
        let good_bytes = rows::scan(&file, experiment, |row, _| done.push(row.id()))?;
        if trials.metadata().map_err(io_error(&file))?.len() > good_bytes {
            trials.set_len(good_bytes).map_err(io_error(&file))?;
        }
        let before = InputHashes::read(path)?;
        let has_row = |planner: &str| done.iter().any(|id| id.planner == planner);
        content.check_equal(&before, path, |planner| has_touches || has_row(planner))?;
        content.extend(before);
        surface::write_or_compare(path, experiment, truth)?;
        content.write(path)?;
        resolved::write(path, experiment)?;
        done.retain(|id| experiment.contains_trial(id));
        let unsigned = Some(provenance::manifest(commit, experiment.seed));
        Ok((Self { path: path.into(), trials, pending_manifest: unsigned }, done))
    }

    /// Appends a row and passes it to the operating system, so that a later kill cannot lose it.
    ///
    /// # Errors
    /// If the row cannot be written.
    pub fn append(&mut self, row: &TrialRow) -> Result<(), RunError> {
        let file = self.path.join(TRIALS);
        let mut line = serde_json::to_vec(row).map_err(io_error(&file))?;
        // JSON has no NaN or infinity, so such a row could not be read back.
        serde_json::from_slice::<TrialRow>(&line)
            .map_err(|error| RunError::bad_row(&file, 0, error))?;
        line.push(b'\n');
        self.append_line(&line)
    }

    fn append_line(&mut self, line: &[u8]) -> Result<(), RunError> {
        if let Some(manifest) = self.pending_manifest.take() {
            provenance::add_manifest(&self.path, manifest)?;
        }
        self.trials.write_all(line).map_err(io_error(&self.path.join(TRIALS)))
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Sorts the rows by trial and planner, so that the file's bytes do not depend on the order in
    /// which trials finished or were added. Returns the counts of the rows that the experiment
    /// lists.
    ///
    /// # Errors
    /// If the file cannot be read back or replaced.
    pub fn sort(self, experiment: &Experiment) -> Result<RowCounts, RunError> {
        let file = self.path.join(TRIALS);
        let (mut places, mut tally) = (Vec::new(), RowCounts::default());
        let mut complete: BTreeMap<String, bool> = BTreeMap::new();
        rows::scan(&file, experiment, |row, bytes| {
            let id = row.id();
            if experiment.contains_trial(&id) {
                tally.trials += 1;
                *complete.entry(row.planner).or_default() |= row.failure.is_none();
                tally.failed.extend(row.failure.map(|reason| (id.clone(), reason)));
            }
            places.push((id, bytes));
        })?;
        let incomplete = complete.into_iter().filter(|(_, is_complete)| !is_complete);
        tally.incomplete = incomplete.map(|(planner, _)| planner).collect();
        tally.failed.sort_by(|(a, _), (b, _)| rows::order(a, b, experiment));
        if !rows::is_sorted(&places, experiment) {
            places.sort_by(|(a, _), (b, _)| rows::order(a, b, experiment));
            let mut from = File::open(&file).map_err(io_error(&file))?;
            palpate_input::files::replace_by(&file, |to| {
                places.iter().try_for_each(|(_, bytes)| rows::copy(&mut from, bytes, to))
            })
            .map_err(io_error(&file))?;
        }
        Ok(tally)
    }
}

/// Counts of a run's rows that its experiment lists.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RowCounts {
    /// Number of trials.
    pub trials: usize,
    /// Failed trials, in order, with the reason.
    pub failed: Vec<(TrialId, String)>,
    /// Planners of which a trial is stored and none is complete.
    pub incomplete: Vec<String>,
}

impl Run {
    /// Reads a run folder.
    ///
    /// # Errors
    /// If `path` is not a run folder, or a file in it is damaged.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        require_run(path)?;
        let experiment = resolved::read(path, &[])?;
        let truth = surface::read(&path.join(SURFACE), &experiment)?;
        let (mut rows, mut unlisted) = (Vec::new(), 0);
        rows::scan(&path.join(TRIALS), &experiment, |row, _| {
            let id = row.id();
            match experiment.contains_trial(&id) {
                true => rows.push((id, row)),
                false => unlisted += 1,
            }
        })?;
        rows.sort_by(|(a, _), (b, _)| rows::order(a, b, &experiment));
        let rows = rows.into_iter().map(|(_, row)| row).collect();
        Ok(Self { experiment, truth, rows, unlisted })
    }

    /// Planners with at least one complete trial; nothing is said about the others.
    pub fn completed_planners(&self) -> Vec<&str> {
        let is_complete =
            |name: &&String| planner_rows(&self.rows, name).any(|row| row.failure.is_none());
        self.experiment.planners.iter().filter(is_complete).map(String::as_str).collect()
    }

    /// Error measure that ranks the planners: where a zone has places that the finger cannot reach,
    /// that of the others.
    pub fn error_measure(&self) -> &'static Measure {
        match self.truth.unreachable_share() {
            Some(_) if self.experiment.scene.whole_object.is_none() => &REACHABLE_RMSE,
            _ => self.experiment.error_measure(),
        }
    }

    /// Notices about what limits the meaning of the numbers.
    pub fn notices(&self) -> Vec<String> {
        notice::run_notices(&self.experiment, &self.truth, &self.rows)
    }
}

/// Changes the report settings of the run in `path` by `--set` assignments to `report.…` and
/// `question`.
///
/// # Errors
/// If an assignment is invalid or to another setting, or the folder contains no run, is being
/// written by another process, or cannot be written.
pub fn set_report(path: &Path, sets: &[String]) -> Result<(), RunError> {
    require_run(path)?;
    sets.iter().try_for_each(|set| resolved::check_report_setting(set))?;
    let experiment = resolved::read(path, sets)?;
    let file = path.join(TRIALS);
    let trials = File::open(&file).map_err(io_error(&file))?;
    lock(&trials, path)?;
    resolved::write(path, &experiment)
}

/// Locks the folder against other processes while `trials` is open.
fn lock(trials: &File, path: &Path) -> Result<(), RunError> {
    match trials.try_lock() {
        Err(TryLockError::WouldBlock) => {
            Err(RunError::at(path, "another run is writing this folder"))
        }
        Err(TryLockError::Error(cause)) => {
            let cause = InputError::new(format!("this file system has no file locks ({cause})"))
                .at(path.display())
                .remedy("use --out on a local file system, and move the folder afterwards");
            Err(RunError::Folder { path: path.into(), cause })
        }
        Ok(()) => Ok(()),
    }
}

fn require_run(path: &Path) -> Result<(), RunError> {
    for missing in [RESOLVED, SURFACE, TRIALS] {
        if !path.join(missing).is_file() {
            return Err(RunError::at(path, format!("not a run's folder: it has no {missing}")));
        }
    }
    Ok(())
}

/// Removes the files of an earlier run except the `resolved.toml` that marks the folder.
/// Figures are drawn again; files of other programs are kept.
fn clear(path: &Path) -> Result<(), RunError> {
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

/// Checks that a non-empty folder contains a run, or only what a crash at its start leaves: no
/// rows, and no or a partial `resolved.toml`.
fn check_ownership(path: &Path) -> Result<(), RunError> {
    let length = |name: &str| {
        let found = fs::metadata(path.join(name)).ok();
        found.filter(fs::Metadata::is_file).map(|found| found.len())
    };
    let foreign =
        || RunError::at(path, "this folder contains other files; use --out for another folder");
    if path.join(TRIALS).exists() && length(TRIALS).is_none() {
        return Err(foreign());
    }
    let has_rows = length(TRIALS).is_some_and(|length| length > 0);
    if resolved::is_ours(path) || has_rows && length(RESOLVED).is_some() {
        return Ok(());
    }
    let part = palpate_input::files::partial_path(Path::new(RESOLVED));
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
