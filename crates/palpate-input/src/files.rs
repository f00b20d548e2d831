//! Reading and writing of user files.
//!
//! Only regular files of a bounded size are read, since a pipe or a device may block or never end.
//! Writes do not follow symbolic links, so that a run's folder cannot change a file outside;
//! [`bytes_below`] does not follow them either.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// Largest size of a text written by hand, such as settings and recordings, in bytes.
// heuristic: far more than is written by hand, and little memory.
pub const TEXT_MAX: u64 = 64 << 20;

/// Byte order mark that some programs write before UTF-8 text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// First bytes of a file that Git LFS puts in place of a large one.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Opens a file for reading.
///
/// # Errors
/// If it is missing, not permitted, a folder, a pipe or a device.
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

/// Reads the bytes of a file of at most `most` bytes.
///
/// # Errors
/// The errors of [`open`], and if it is larger, or a pointer of Git LFS.
pub fn bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(file.metadata()?.len().min(most) as usize)?;
    // A file may grow while it is read, and some report a size of zero and never end.
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let size = format!("larger than {} MiB", most >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, size));
    }
    if bytes.starts_with(LFS_POINTER) {
        let pointer = "a pointer of Git LFS, not the file: run git lfs pull in its repository";
        return Err(io::Error::new(io::ErrorKind::InvalidData, pointer));
    }
    Ok(bytes)
}

/// Reads the bytes of the file `path` below `folder`, of at most `most` bytes, without following
/// symbolic links below `folder`.
///
/// # Errors
/// The errors of [`bytes`], and if the path leaves the folder or contains a symbolic link.
pub fn bytes_below(folder: &Path, path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let folder = folder.canonicalize()?;
    let file = folder.join(path);
    if !file.starts_with(&folder) || file.canonicalize()? != file {
        let problem = "outside of the folder, or a symbolic link, which is not followed";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    bytes(&file, most)
}

/// Reads the text of a file of at most `most` bytes, without a byte order mark.
///
/// # Errors
/// The errors of [`bytes`], and if it is not UTF-8.
pub fn text(path: &Path, most: u64) -> io::Result<String> {
    let bytes = bytes(path, most)?;
    let text = str::from_utf8(without_bom(&bytes));
    let no_text = |_| io::Error::new(io::ErrorKind::InvalidData, "not UTF-8 text");
    text.map(str::to_owned).map_err(no_text)
}

/// Returns `bytes` without a leading byte order mark.
pub fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes)
}

/// Replaces the file `path` by `bytes` atomically: a reader sees either the new or the old
/// contents. A symbolic link is replaced, not followed.
///
/// # Errors
/// If it cannot be written; the old file then remains.
pub fn replace(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    replace_by(path, |file| file.write_all(bytes.as_ref()))
}

/// Replaces a file like [`replace`], with the output of `write`.
///
/// # Errors
/// If it cannot be written; the old file then remains.
pub fn replace_by(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let partial = partial_path(path);
    let written = create(&partial).and_then(|file| {
        let mut file = BufWriter::new(file);
        write(&mut file)?;
        file.flush()?;
        fs::rename(&partial, path)
    });
    if written.is_err() {
        // Frees the space of a partial file on a full disk.
        let _ = fs::remove_file(&partial);
    }
    written
}

/// Returns the path of a file during writing.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".part");
    partial.into()
}

/// Creates an empty file, replacing the file or symbolic link at `path`.
///
/// # Errors
/// If it cannot be written.
pub fn create(path: &Path) -> io::Result<File> {
    remove(path)?;
    OpenOptions::new().write(true).create_new(true).open(path)
}

/// Opens a file for appending and reading, and creates it if missing.
///
/// # Errors
/// If it cannot be written, or is a symbolic link.
pub fn append(path: &Path) -> io::Result<File> {
    refuse_link(path)?;
    OpenOptions::new().create(true).read(true).append(true).open(path)
}

/// Creates a folder in an existing one, unless it exists.
///
/// # Errors
/// If it cannot be created, or is a symbolic link.
pub fn make_folder(path: &Path) -> io::Result<()> {
    refuse_link(path)?;
    fs::create_dir_all(path)
}

/// Removes a file if it exists.
///
/// # Errors
/// If it exists and cannot be removed.
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
            "a symbolic link; links are not followed for writing; remove it",
        )),
        _ => Ok(()),
    }
}
