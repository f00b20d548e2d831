//! Stored baseline of a regression test: a file of JSON lines, a header and a line per trial.

use super::measures::CHECK_MEASURES;
use crate::experiment::row::TrialRow;
use crate::experiment::{Experiment, Simulation};
use palpate_geometry::import::is_mesh_file;
use palpate_input::error::InputError;
use palpate_input::files;
use palpate_input::format::hex;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Remedy of a baseline that does not fit.
const WRITE: &str = "write a new baseline with --accept REASON";

/// First line of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Name of the experiment.
    pub experiment: String,
    /// Version of Palpate that wrote the file.
    pub palpate: String,
    /// Reason for this baseline, given by its author.
    pub why: String,
    /// Planners that differ from the previous file, with the difference.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub differs: Vec<String>,
    /// SHA-256 of all settings that decide a row, and of the object's file.
    pub settings: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Initial touches per trial.
    pub initial_touches: u32,
    /// Touches per trial.
    pub touches: u32,
    /// Test points along each side of the zone.
    pub grid: u32,
    /// Trials per planner.
    pub trials: u32,
    /// Names of the planners.
    pub planners: Vec<String>,
}

/// Results of a trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrialLine {
    /// Number of the trial.
    pub trial: u32,
    /// Name of the planner.
    pub planner: String,
    /// First half of the SHA-256 of the trial's row.
    pub row: String,
    /// Reason of a failure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Values of the measures, by [`CheckMeasure::id`](super::measures::CheckMeasure::id).
    pub values: BTreeMap<String, f64>,
}

/// A stored baseline.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredBaseline {
    /// First line of the file.
    pub header: Header,
    /// One line per trial.
    pub lines: Vec<TrialLine>,
}

impl TrialLine {
    /// Creates the line of a finished trial of `experiment`.
    pub fn of(row: &TrialRow, experiment: &Experiment) -> Self {
        let values = CHECK_MEASURES
            .iter()
            .filter_map(|judged| Some((judged.id.to_owned(), (judged.value)(row, experiment)?)))
            .collect();
        Self {
            trial: row.trial,
            planner: row.planner.clone(),
            row: hash(row),
            failure: row.failure.clone(),
            values,
        }
    }
}

/// Returns half of the SHA-256 of a row's line in `trials.jsonl`, which is enough to avoid
/// collisions.
fn hash(row: &TrialRow) -> String {
    let line = serde_json::to_vec(row).unwrap_or_default();
    let mut text = hex(Sha256::digest(line));
    text.truncate(32);
    text
}

/// Returns the SHA-256 of the settings that decide the rows of `experiment`. Paths of files do not
/// count; the contents of the files do, and those of the meshes in a folder.
pub fn settings_hash(experiment: &Experiment) -> String {
    let settings = experiment.row_settings();
    let text = serde_json::to_vec(&settings.without_paths()).unwrap_or_default();
    let mut hash = Sha256::new().chain_update(text);
    for (_, path) in settings.paths() {
        let entries = std::fs::read_dir(&path).into_iter().flatten().flatten();
        let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        files.retain(|file| is_mesh_file(file));
        files.sort();
        files.push(path);
        files.iter().for_each(|file| hash.update(std::fs::read(file).unwrap_or_default()));
    }
    hex(hash.finalize())
}

impl StoredBaseline {
    /// Creates the baseline of all trials of an experiment, with its reason.
    pub fn new(simulation: &Simulation, rows: &[TrialRow], why: &str) -> Self {
        let experiment = simulation.experiment();
        let header = Header {
            experiment: experiment.name.clone(),
            palpate: env!("CARGO_PKG_VERSION").into(),
            why: why.into(),
            differs: Vec::new(),
            settings: settings_hash(experiment),
            seed: experiment.seed,
            initial_touches: experiment.initial_touches,
            touches: experiment.touches,
            grid: experiment.grid,
            trials: experiment.trials,
            planners: experiment.planners.clone(),
        };
        let lines = rows.iter().map(|row| TrialLine::of(row, experiment)).collect();
        Self { header, lines }
    }

    /// Removes all planners other than `names`.
    pub fn keep_planners(&mut self, names: &[String]) {
        self.header.planners.retain(|name| names.contains(name));
    }

    /// Reads a baseline file.
    ///
    /// # Errors
    /// If the file cannot be read, or a line is invalid.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let unread = |error: std::io::Error| match error.kind() {
            ErrorKind::NotFound => {
                InputError::new("no such baseline").remedy(WRITE).at(path.display())
            }
            _ => InputError::io(path, error),
        };
        let text = files::text(path, files::TEXT_MAX).map_err(unread)?;
        let bad = |i: usize| {
            let place = format!("{}:{}", path.display(), i + 1);
            move |error: serde_json::Error| InputError::new(error.to_string()).at(place)
        };
        let mut lines = text.lines().enumerate();
        let empty = || InputError::new("the file is empty").remedy(WRITE).at(path.display());
        let (_, first) = lines.next().ok_or_else(empty)?;
        let header = serde_json::from_str(first).map_err(bad(0))?;
        let lines = lines.map(|(i, line)| serde_json::from_str(line).map_err(bad(i)));
        Ok(Self { header, lines: lines.collect::<Result<_, _>>()? })
    }

    /// Returns the text of the file.
    ///
    /// # Errors
    /// If a value is NaN or infinite.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        let mut text = serde_json::to_string(&self.header)? + "\n";
        for line in &self.lines {
            text += &serde_json::to_string(line)?;
            text.push('\n');
        }
        Ok(text)
    }

    /// Checks that its trials pair with those of `experiment`.
    ///
    /// # Errors
    /// The first setting that differs.
    pub fn check_pairs(&self, path: &Path, experiment: &Experiment) -> Result<(), InputError> {
        let header = &self.header;
        for (field, found, wanted) in [
            ("seed", header.seed, experiment.seed),
            ("initial_touches", header.initial_touches.into(), experiment.initial_touches.into()),
            ("touches", header.touches.into(), experiment.touches.into()),
            ("grid", header.grid.into(), experiment.grid.into()),
        ] {
            if found != wanted {
                let problem = format!(
                    "`{field}` is {found} in the baseline and {wanted} in the experiment, so trials do not pair"
                );
                return Err(InputError::new(problem).at(path.display()).remedy(WRITE));
            }
        }
        Ok(())
    }

    /// Finds the line of a trial.
    pub fn line(&self, trial: u32, planner: &str) -> Option<&TrialLine> {
        self.lines.iter().find(|line| line.trial == trial && line.planner == planner)
    }
}
