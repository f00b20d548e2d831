//! Atomic writes to a run's folder, and errors with the file's name.

use palpate_input::config::ConfigError;
use palpate_input::error::InputError;
use palpate_input::files;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::{fs, io};
use thiserror::Error;

/// Error of a run: in its settings, its folder, or its other inputs.
#[derive(Debug, Error)]
pub enum RunError {
    /// Error in the run's folder or a file in it.
    #[error("{cause}")]
    Folder {
        /// Path of the folder or file.
        path: PathBuf,
        /// Problem, with its place.
        cause: InputError,
    },
    /// Error in the recorded experiment.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Error in a planner, the threads, or an argument.
    #[error(transparent)]
    Invalid(#[from] InputError),
}

impl RunError {
    /// Error of the folder or file at `path`.
    pub(super) fn at(path: &Path, problem: impl Into<String>) -> Self {
        let cause = InputError::new(problem).at(path.display());
        Self::Folder { path: path.into(), cause }
    }

    /// Error of a line that cannot be read as a row.
    pub(super) fn bad_row(path: &Path, line: usize, message: impl Display) -> Self {
        let cause = InputError::new(format!("not a row of results: {message}"));
        Self::Folder { path: path.into(), cause: cause.at(format!("{}:{line}", path.display())) }
    }
}

/// Adds the file's name to an error of reading or writing.
pub(super) fn io_error<E: Into<io::Error>>(path: &Path) -> impl Fn(E) -> RunError {
    move |cause| RunError::Folder { path: path.into(), cause: InputError::io(path, cause.into()) }
}

/// Replaces a file atomically: a reader gets the old or the new contents. Symbolic links are
/// replaced too.
///
/// # Errors
/// If the file cannot be written.
pub fn write_whole(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), RunError> {
    files::replace(path, bytes).map_err(io_error(path))
}

/// Writes like [`write_whole`], unless the file already contains `text`.
pub(super) fn write_changed(path: &Path, text: &str) -> Result<(), RunError> {
    match fs::read(path) {
        Ok(found) if found == text.as_bytes() => Ok(()),
        _ => write_whole(path, text),
    }
}

/// Checks that `found`, the contents of `file` in `folder`, equals `wanted`.
pub(super) fn check_equal(
    folder: &Path,
    file: &str,
    [found, wanted]: [&str; 2],
) -> Result<(), RunError> {
    if found == wanted {
        return Ok(());
    }
    let mut pairs = found.lines().zip(wanted.lines()).filter(|(a, b)| a != b);
    let (found, wanted) = pairs.next().unwrap_or(("(a different number of lines)", "..."));
    let cause = InputError::new(format!(
        "{} contains another experiment: {file} has `{found}`, this one `{wanted}`",
        folder.display()
    ));
    let cause = cause.remedy("use --out for another folder, or --fresh to start again");
    Err(RunError::Folder { path: folder.into(), cause })
}

/// Removes a file if it exists.
pub(super) fn remove(path: &Path) -> Result<(), RunError> {
    files::remove(path).map_err(io_error(path))
}
