//! Files of a run's folder: written whole or not at all.

use super::error::{StoreError, io_error};
use crate::files;
use std::fs;
use std::path::Path;

/// Replaces a file, so that a reader sees all of it or none; symbolic links are replaced too.
///
/// # Errors
/// If it cannot be written.
pub fn write_whole(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), StoreError> {
    files::replace(path, bytes).map_err(io_error(path))
}

/// As [`write_whole`], unless the file says that already.
pub(super) fn write_changed(path: &Path, text: &str) -> Result<(), StoreError> {
    match fs::read(path) {
        Ok(found) if found == text.as_bytes() => Ok(()),
        _ => write_whole(path, text),
    }
}

/// Insists that `found`, as it stands in `file` of `folder`, says the same as `wanted`.
pub(super) fn same(
    folder: &Path,
    file: &'static str,
    [found, wanted]: [&str; 2],
) -> Result<(), StoreError> {
    if found == wanted {
        return Ok(());
    }
    let mut pairs = found.lines().zip(wanted.lines()).filter(|(a, b)| a != b);
    let (found, wanted) = pairs.next().unwrap_or(("(fewer or more lines)", "..."));
    Err(StoreError::Differs {
        path: folder.into(),
        file,
        found: found.into(),
        wanted: wanted.into(),
    })
}

/// Removes a file that may not be there.
pub(super) fn remove(path: &Path) -> Result<(), StoreError> {
    files::remove(path).map_err(io_error(path))
}
