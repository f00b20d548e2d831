//! Reading and writing files whose names come from users.
//!
//! Only regular files of a bounded size are read: a pipe or a device may never answer or never end.
//! Nothing is written through a symbolic link, so that a run's folder cannot change a file outside.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// Most bytes of a text that people write, as settings and recordings are.
// heuristic: far more than anyone writes by hand, and little memory.
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

/// Replaces the file `path` by `bytes`, so that a reader sees all of them or the file of before. A
/// symbolic link is replaced, not followed.
///
/// # Errors
/// If it cannot be written; then the file of before is still there.
pub fn replace(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    replace_by(path, |file| file.write_all(bytes.as_ref()))
}

/// Replaces a file like [`replace`], by what `write` writes.
///
/// # Errors
/// If it cannot be written; then the file of before is still there.
pub fn replace_by(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let partial = partial(path);
    let written = create(&partial).and_then(|file| {
        let mut file = BufWriter::new(file);
        write(&mut file)?;
        file.flush()?;
        fs::rename(&partial, path)
    });
    if written.is_err() {
        // What a full disk has taken of it is in the way there.
        let _ = fs::remove_file(&partial);
    }
    written
}

/// Where a file is written until it is whole.
pub fn partial(path: &Path) -> PathBuf {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".part");
    partial.into()
}

/// Creates an empty file in place of the file or symbolic link that `path` names.
///
/// # Errors
/// If it cannot be written.
pub fn create(path: &Path) -> io::Result<File> {
    remove(path)?;
    OpenOptions::new().write(true).create_new(true).open(path)
}

/// Opens a file to append to it and to read it, created if it is missing.
///
/// # Errors
/// If it cannot be written, or is a symbolic link.
pub fn append(path: &Path) -> io::Result<File> {
    refuse_link(path)?;
    OpenOptions::new().create(true).read(true).append(true).open(path)
}

/// Makes a folder inside one that is there, unless it is there already.
///
/// # Errors
/// If it cannot be made, or is a symbolic link.
pub fn make_folder(path: &Path) -> io::Result<()> {
    refuse_link(path)?;
    fs::create_dir_all(path)
}

/// Removes a file if it is there.
///
/// # Errors
/// If it is there and cannot be removed.
pub fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

fn refuse_link(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "a symbolic link, and nothing is written through one; remove it",
        )),
        _ => Ok(()),
    }
}
