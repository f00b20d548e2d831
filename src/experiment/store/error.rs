//! What can go wrong with a run folder.

use crate::config::ConfigError;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What can go wrong with a run folder.
#[derive(Debug, Error)]
pub enum StoreError {
    /// Reading or writing failed.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// The folder holds another experiment.
    #[error(
        "{} holds another experiment: {file} says `{found}`, this one `{wanted}`; \
         choose another folder with --out, or start over with --fresh", path.display()
    )]
    Differs {
        /// The folder.
        path: PathBuf,
        /// The file that differs.
        file: &'static str,
        /// First line of it that differs.
        found: String,
        /// What that line is in this experiment.
        wanted: String,
    },
    /// A file or planner is not the one that the rows were made with.
    #[error(
        "{}: {what} has changed since the run began, and its trials were made with what it was before; choose \
         another folder with --out, or start again with --fresh", path.display()
    )]
    Changed {
        /// The folder.
        path: PathBuf,
        /// Which, with its file.
        what: String,
    },
    /// An assignment to something that decides the rows of a run that is only shown.
    #[error(
        "--set {text}: a run that is there can be shown another way by `report.…` and `question` \
         only; what else it is must be run (palpate run)"
    )]
    DecidesRows {
        /// As typed.
        text: String,
    },
    /// Another process writes there.
    #[error("{}: another run is writing this folder", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// The folder holds no run.
    #[error("{}: not a run's folder: it has no {missing}", path.display())]
    NotARun {
        /// The folder.
        path: PathBuf,
        /// The file it lacks.
        missing: &'static str,
    },
    /// The folder is not empty and holds no run.
    #[error("{}: this folder holds something else; choose another with --out", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
    },
    /// A line is not a row.
    #[error("{}:{line}: not a row of results: {message}", path.display())]
    BadRow {
        /// The file.
        path: PathBuf,
        /// Its line.
        line: usize,
        /// What the parser says.
        message: String,
    },
    /// The recorded experiment cannot be read.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

/// Names the file that reading or writing failed on.
pub(super) fn io_error(path: &Path) -> impl Fn(io::Error) -> StoreError {
    move |cause| StoreError::Io { path: path.into(), cause }
}
