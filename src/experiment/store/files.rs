//! Files of a run's folder, written whole or not at all, and the error that names them.

use palpate_input::config::ConfigError;
use palpate_input::error::Invalid;
use palpate_input::files;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::{fs, io};
use thiserror::Error;

/// Error of a run: of its settings, of its folder, or of what it needs beside them.
#[derive(Debug, Error)]
pub enum RunError {
    /// The run's folder, or a file in it.
    #[error("{cause}")]
    Folder {
        /// The folder or file.
        path: PathBuf,
        /// The problem, with its place.
        cause: Invalid,
    },
    /// The recorded experiment.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A planner, the threads, or an argument.
    #[error(transparent)]
    Invalid(#[from] Invalid),
}

impl RunError {
    /// A problem of the folder or file at `path`.
    pub(super) fn at(path: &Path, problem: impl Into<String>) -> Self {
        let cause = Invalid::new(problem).at(path.display());
        Self::Folder { path: path.into(), cause }
    }

    /// A line that cannot be read as a row.
    pub(super) fn bad_row(path: &Path, line: usize, message: impl Display) -> Self {
        let cause = Invalid::new(format!("not a row of results: {message}"));
        Self::Folder { path: path.into(), cause: cause.at(format!("{}:{line}", path.display())) }
    }
}

/// Names the file that reading or writing failed on.
pub(super) fn io_error<E: Into<io::Error>>(path: &Path) -> impl Fn(E) -> RunError {
    move |cause| RunError::Folder { path: path.into(), cause: Invalid::io(path, cause.into()) }
}

/// Replaces a file, so that a reader sees all of it or none; symbolic links are replaced too.
///
/// # Errors
/// If it cannot be written.
pub fn write_whole(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), RunError> {
    files::replace(path, bytes).map_err(io_error(path))
}

/// Writes like [`write_whole`], unless the file holds `text` already.
pub(super) fn write_changed(path: &Path, text: &str) -> Result<(), RunError> {
    match fs::read(path) {
        Ok(found) if found == text.as_bytes() => Ok(()),
        _ => write_whole(path, text),
    }
}

/// Checks that `found`, which `file` of `folder` holds, is the same as `wanted`.
pub(super) fn same(folder: &Path, file: &str, [found, wanted]: [&str; 2]) -> Result<(), RunError> {
    if found == wanted {
        return Ok(());
    }
    let mut pairs = found.lines().zip(wanted.lines()).filter(|(a, b)| a != b);
    let (found, wanted) = pairs.next().unwrap_or(("(fewer or more lines)", "..."));
    let cause = Invalid::new(format!(
        "{} holds another experiment: {file} says `{found}`, this one `{wanted}`",
        folder.display()
    ));
    let cause = cause.mend("choose another folder with --out, or start over with --fresh");
    Err(RunError::Folder { path: folder.into(), cause })
}

/// Removes a file that may not be there.
pub(super) fn remove(path: &Path) -> Result<(), RunError> {
    files::remove(path).map_err(io_error(path))
}
