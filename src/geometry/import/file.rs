//! The bytes of a file that somebody named.

use std::fs;
use std::io;
use std::path::Path;

/// Reads a regular file. A folder, pipe or device is refused, because it may never end.
pub(super) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let kind = fs::metadata(path)?;
    if kind.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !kind.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    fs::read(path)
}
