//! What planners were: a file of JSON lines, a header and then a line for each trial.

use super::judged::JUDGED;
use crate::experiment::trial::row::TrialRow;
use crate::experiment::{Experiment, Simulation};
use palpate_input::error::Invalid;
use palpate_input::files;
use palpate_input::words::hex;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The first line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Name of the experiment.
    pub experiment: String,
    /// Version of Palpate that made it.
    pub palpate: String,
    /// Why it is as it is: what whoever made it said.
    pub why: String,
    /// Planners that differ from the file before, and how.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub differs: Vec<String>,
    /// SHA-256 of every setting that decides a row, and of the object's file.
    pub settings: String,
    /// Root of all randomness.
    pub seed: u64,
    /// Initial touches of a trial.
    pub initial_touches: u32,
    /// Touches of a trial.
    pub touches: u32,
    /// Test places along each side of the zone.
    pub grid: u32,
    /// Trials of each planner.
    pub trials: u32,
    /// Planners.
    pub planners: Vec<String>,
    /// Instructions of a trial that version 0.1 counted, ignored.
    #[serde(default, skip_serializing)]
    cost: IgnoredAny,
}

/// A trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Its number.
    pub trial: u32,
    /// Its planner.
    pub planner: String,
    /// SHA-256 of its row, the first half.
    pub row: String,
    /// Why it failed, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// What it is judged by, by [`Judged::id`](super::judged::Judged::id).
    pub values: BTreeMap<String, f64>,
}

/// The file.
#[derive(Clone, Debug, PartialEq)]
pub struct Baseline {
    /// Its first line.
    pub header: Header,
    /// A line for each trial.
    pub lines: Vec<Line>,
}

impl Line {
    /// The line of a finished trial of `experiment`.
    pub fn of(row: &TrialRow, experiment: &Experiment) -> Self {
        let values = JUDGED
            .iter()
            .filter_map(|judged| Some((judged.id.to_owned(), (judged.of)(row, experiment)?)))
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

/// Half of the SHA-256 of a row's line in `trials.jsonl`: enough that no two are taken for the
/// same.
fn hash(row: &TrialRow) -> String {
    let line = serde_json::to_vec(row).unwrap_or_default();
    let mut text = hex(Sha256::digest(line));
    text.truncate(32);
    text
}

/// SHA-256 of what decides the rows of `experiment`. Where its files lie does not count, but what
/// the object's holds.
pub fn settings(experiment: &Experiment) -> String {
    let mut identity = experiment.identity();
    let mut object = Vec::new();
    if let Some(it) = &mut identity.scene.object {
        object = std::fs::read(&it.mesh).unwrap_or_default();
        it.mesh = PathBuf::new();
    }
    let text = serde_json::to_vec(&identity).unwrap_or_default();
    hex(Sha256::new().chain_update(text).chain_update(object).finalize())
}

impl Baseline {
    /// Of all trials of an experiment, made for this reason.
    pub fn new(simulation: &Simulation, rows: &[TrialRow], why: &str) -> Self {
        let experiment = simulation.experiment();
        let header = Header {
            experiment: experiment.name.clone(),
            palpate: env!("CARGO_PKG_VERSION").into(),
            why: why.into(),
            differs: Vec::new(),
            settings: settings(experiment),
            seed: experiment.seed,
            initial_touches: experiment.initial_touches,
            touches: experiment.touches,
            grid: experiment.grid,
            trials: experiment.trials,
            planners: experiment.planners.clone(),
            cost: IgnoredAny,
        };
        let lines = rows.iter().map(|row| Line::of(row, experiment)).collect();
        Self { header, lines }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, or a line is not what it should be.
    pub fn read(path: &Path) -> Result<Self, Invalid> {
        let text = files::text(path, files::TEXT_MAX).map_err(|error| Invalid::io(path, error))?;
        let bad = |i: usize| {
            let place = format!("{}:{}", path.display(), i + 1);
            move |error: serde_json::Error| Invalid::new(error.to_string()).at(place)
        };
        let mut lines = text.lines().enumerate();
        let empty = || Invalid::new("it is empty").at(path.display());
        let (_, first) = lines.next().ok_or_else(empty)?;
        let header = serde_json::from_str(first).map_err(bad(0))?;
        let lines = lines.map(|(i, line)| serde_json::from_str(line).map_err(bad(i)));
        Ok(Self { header, lines: lines.collect::<Result<_, _>>()? })
    }

    /// As it is written.
    ///
    /// # Errors
    /// If a number of it is none of JSON's.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        let mut text = serde_json::to_string(&self.header)? + "\n";
        for line in &self.lines {
            text += &serde_json::to_string(line)?;
            text.push('\n');
        }
        Ok(text)
    }

    /// Whether its trials pair with those of `experiment`.
    ///
    /// # Errors
    /// The first setting that they do not share.
    pub fn check_pairs(&self, path: &Path, experiment: &Experiment) -> Result<(), Invalid> {
        let header = &self.header;
        for (field, found, wanted) in [
            ("seed", header.seed, experiment.seed),
            ("initial_touches", header.initial_touches.into(), experiment.initial_touches.into()),
            ("touches", header.touches.into(), experiment.touches.into()),
            ("grid", header.grid.into(), experiment.grid.into()),
        ] {
            if found != wanted {
                let problem = format!(
                    "`{field}` is {found} there and {wanted} in the experiment: their trials do not pair"
                );
                let mend = "make a new baseline with --bless WHY";
                return Err(Invalid::new(problem).at(path.display()).mend(mend));
            }
        }
        Ok(())
    }

    /// The line of a trial.
    pub fn line(&self, trial: u32, planner: &str) -> Option<&Line> {
        self.lines.iter().find(|line| line.trial == trial && line.planner == planner)
    }
}
