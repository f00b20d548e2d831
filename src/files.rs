//! Files that somebody named.
//!
//! Only regular files of a bounded size are read: a pipe or a device may never answer or never end.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Most bytes of a text that people write, as settings and recordings are; chosen.
pub const TEXT_MAX: u64 = 64 << 20;

/// What some programs put before UTF-8, to say that it is UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Opens a file to be read.
///
/// # Errors
/// If it is missing, forbidden, a folder, a pipe or a device.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path)?;
    if kind.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !kind.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    File::open(path)
}

/// The bytes of a file of at most `most` bytes.
///
/// # Errors
/// As [`open`], and if it is larger.
pub fn bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(file.metadata()?.len().min(most) as usize)?;
    // A file may grow while it is read, and some say that they are empty and never end.
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(io::Error::new(
            io::ErrorKind::FileTooLarge,
            format!("larger than {} MiB", most >> 20),
        )),
        false => Ok(bytes),
    }
}

/// The text of a file of at most `most` bytes, without a byte order mark.
///
/// # Errors
/// As [`bytes`], and if it is not UTF-8.
pub fn text(path: &Path, most: u64) -> io::Result<String> {
    let bytes = bytes(path, most)?;
    let text = str::from_utf8(unmarked(&bytes));
    let no_text = |_| io::Error::new(io::ErrorKind::InvalidData, "not UTF-8 text");
    text.map(str::to_owned).map_err(no_text)
}

/// `bytes` without the byte order mark they may begin with.
pub fn unmarked(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes)
}
