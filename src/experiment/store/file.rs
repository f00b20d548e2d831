//! Files of a run's folder: written whole or not at all.

use super::error::StoreError;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file so that a reader sees all of it or none.
///
/// # Errors
/// If it cannot be written.
pub fn write_whole(path: &Path, text: &str) -> Result<(), StoreError> {
    write_whole_by(path, |file| file.write_all(text.as_bytes()))
}

/// As [`write_whole`], with what `write` writes.
pub(super) fn write_whole_by(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), StoreError> {
    let partial = partial(path);
    let written = File::create(&partial).and_then(|file| {
        let mut file = BufWriter::new(file);
        write(&mut file)?;
        file.flush()?;
        fs::rename(&partial, path)
    });
    written.map_err(|cause| {
        // What a full disk has taken of it is in the way there.
        let _ = fs::remove_file(&partial);
        StoreError::Io { path: path.into(), cause }
    })
}

/// Where a file is written until it is whole.
pub(super) fn partial(path: &Path) -> PathBuf {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".part");
    partial.into()
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
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
            Err(StoreError::Io { path: path.into(), cause })
        }
        _ => Ok(()),
    }
}
