//! A committed table of what fixed work costs in instructions.

use super::cost::{Cost, CostJudgement};
use crate::files;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What stands above a table that is written.
const HEAD: &str = "# What one trial of each planner costs, in instructions, its set-up taken off. `make check-cost` holds\n\
    # the program against it; `palpate cost FILE --write` counts again.\n";

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostTable {
    /// Share of the instructions that may be lost or won without a word.
    pub tolerance: f64,
    /// Compiler, target, optimisation, vectors, and what counted.
    #[serde(default)]
    pub by: String,
    /// What is done.
    pub work: Vec<Work>,
}

/// An experiment of which a trial is counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Work {
    /// Its file, or its name.
    pub experiment: PathBuf,
    /// Its settings that differ, as after `--set`.
    #[serde(default)]
    pub set: Vec<String>,
    /// By planner.
    #[serde(default)]
    pub instructions: BTreeMap<String, u64>,
}

/// Why there is no table.
#[derive(Debug, Error)]
pub enum CostTableError {
    /// The file cannot be read.
    #[error("{path}: {cause}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// The file is no table.
    #[error("{path}: {cause}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Where and what.
        cause: Box<toml::de::Error>,
    },
    /// The tolerance is no share.
    #[error("{path}: `tolerance` = {tolerance}: allowed is a share of 0.001 to 1")]
    Tolerance {
        /// The file.
        path: PathBuf,
        /// What it says.
        tolerance: f64,
    },
}

impl CostTable {
    /// Reads one.
    ///
    /// # Errors
    /// If it cannot be read or is none.
    pub fn read(path: &Path) -> Result<Self, CostTableError> {
        let owned = || path.to_path_buf();
        let text = files::text(path, files::TEXT_MAX)
            .map_err(|cause| CostTableError::Read { path: owned(), cause })?;
        let table: Self = toml::from_str(&text)
            .map_err(|cause| CostTableError::Syntax { path: owned(), cause: cause.into() })?;
        let tolerance = table.tolerance;
        match (1e-3..=1.0).contains(&tolerance) {
            true => Ok(table),
            false => Err(CostTableError::Tolerance { path: owned(), tolerance }),
        }
    }

    /// The text of its file.
    ///
    /// # Errors
    /// If a number does not fit into the format.
    pub fn text(&self) -> Result<String, toml::ser::Error> {
        Ok(format!("{HEAD}{}", toml::to_string(self)?))
    }

    /// Planner by planner of one work, which is now counted as `new`.
    pub fn judge(&self, work: &Work, new: &Cost) -> Vec<CostJudgement> {
        let old = Cost { by: self.by.clone(), instructions: work.instructions.clone() };
        new.judge(&old, self.tolerance)
    }
}
