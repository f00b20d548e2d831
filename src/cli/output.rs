//! Output files and folders: Palpate replaces files of other programs only with `--force`.

use anyhow::{Context, bail, ensure};
use palpate_input::files;
use palpate_input::format::hex;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

/// Permission to replace files that Palpate did not write.
#[derive(Clone, Copy, clap::Args)]
pub(super) struct Overwrite {
    /// Replace a file that Palpate did not write, or write to a folder with other files.
    #[arg(long)]
    force: bool,
}

/// Marker near the start or end of every file that Palpate writes.
const MARKER: &[u8] = b"palpate";

/// Bytes searched for the marker at each end of a file.
// heuristic: longer than any header.
const SEARCH_BYTES: u64 = 1024;

impl Overwrite {
    /// Checks that `path` may be written: it does not exist, Palpate wrote it, or it is a file and
    /// `--force` is given.
    ///
    /// # Errors
    /// If it may not be written.
    pub(super) fn check_file(self, path: &Path) -> anyhow::Result<()> {
        if found(path)? == ExistingFile::Other && !self.force {
            bail!(
                "{} exists and was not written by Palpate; use --force to replace it",
                path.display()
            );
        }
        Ok(())
    }

    /// Checks `path` and the files beside it with each of `extensions`. If Palpate wrote the first,
    /// it also wrote the others.
    ///
    /// # Errors
    /// If one of the files may not be written.
    pub(super) fn check_files(self, path: &Path, extensions: &[&str]) -> anyhow::Result<()> {
        self.check_file(path)?;
        if found(path)? == ExistingFile::Ours {
            return Ok(());
        }
        extensions.iter().try_for_each(|extension| self.check_file(&path.with_extension(extension)))
    }

    /// Checks that `path`, a file for the user to edit, does not exist, is as [`sealed`] wrote it,
    /// or may be replaced.
    ///
    /// # Errors
    /// If it was edited or written otherwise, without `--force`, or is not a file.
    pub(super) fn check_editable_file(self, path: &Path) -> anyhow::Result<()> {
        if !path.is_file() || self.force {
            return self.check_file(path);
        }
        let text = files::text(path, files::TEXT_MAX).unwrap_or_default();
        ensure!(
            is_sealed(&text),
            "{} exists and is not as `palpate new` wrote it: use --force to replace it, or --out FOLDER to \
             write beside it",
            path.display()
        );
        Ok(())
    }

    /// Checks that `path` may be a folder of results that contain `own`: it does not exist, is
    /// empty, contains that file, or `--force` is given.
    ///
    /// # Errors
    /// If the folder may not be used.
    pub(super) fn check_folder(self, path: &Path, own: &str) -> anyhow::Result<()> {
        let is_empty = match fs::read_dir(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => true,
            entries => entries.with_context(|| path.display().to_string())?.next().is_none(),
        };
        if !is_empty && !path.join(own).is_file() && !self.force {
            bail!(
                "{} contains other files and no {own}: use a new folder, or --force to write to this \
                 one",
                path.display()
            );
        }
        Ok(())
    }
}

/// Comment before the checksum of the rest of a file.
const SEAL: &str = "# Replaced by the next `palpate new` unless edited; checksum ";

/// Returns a TOML text with a first line that tells whether it was edited later.
pub(super) fn sealed(text: &str) -> String {
    format!("{SEAL}{}\n{text}", checksum(text))
}

fn is_sealed(text: &str) -> bool {
    let lines = text.split_once('\n');
    lines.is_some_and(|(first, rest)| first.strip_prefix(SEAL) == Some(checksum(rest).as_str()))
}

fn checksum(text: &str) -> String {
    hex(&Sha256::digest(text.as_bytes())[..6])
}

/// Existing file at an output path.
#[derive(PartialEq)]
enum ExistingFile {
    Nothing,
    Ours,
    Other,
}

fn found(path: &Path) -> anyhow::Result<ExistingFile> {
    let name = path.display();
    let kind = match fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(ExistingFile::Nothing),
        Err(error) => return Err(error).with_context(|| name.to_string()),
        Ok(kind) => kind,
    };
    if !kind.is_file() {
        bail!("{name} is a folder, a device or a pipe; allowed is a file");
    }
    let is_ours = is_marked(path).with_context(|| name.to_string())?;
    Ok(if is_ours { ExistingFile::Ours } else { ExistingFile::Other })
}

fn is_marked(path: &Path) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let last = file.metadata()?.len().saturating_sub(SEARCH_BYTES);
    for start in [0, last] {
        file.seek(SeekFrom::Start(start))?;
        let mut bytes = Vec::new();
        Read::by_ref(&mut file).take(SEARCH_BYTES).read_to_end(&mut bytes)?;
        bytes.make_ascii_lowercase();
        if bytes.windows(MARKER.len()).any(|part| part == MARKER) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Creates a folder and its parents.
pub(super) fn make_folder(path: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(path).with_context(|| path.display().to_string())
}
