//! Files and folders that a command is told to write: nobody else's is replaced unasked.

use anyhow::{Context, bail};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

/// Whether a file that Palpate did not write may be replaced.
#[derive(Clone, Copy, clap::Args)]
pub(super) struct Force {
    /// Replace a file that Palpate did not write, or write into a folder of other things.
    #[arg(long)]
    force: bool,
}

/// What every file that Palpate writes says in its first bytes or its last.
const MARK: &[u8] = b"palpate";

/// In how many; chosen, longer than any header.
const END: u64 = 1024;

impl Force {
    /// Makes sure that `path` may be written: it is not there, or Palpate wrote it, or it is a file
    /// and `--force` is given.
    ///
    /// # Errors
    /// If it may not.
    pub(super) fn claim(self, path: &Path) -> anyhow::Result<()> {
        if found(path)? == Found::Other && !self.force {
            bail!(
                "{} is there, and does not say that Palpate wrote it: --force replaces it",
                path.display()
            );
        }
        Ok(())
    }

    /// The same of `path` and the files beside it that have one of `extensions` instead; if Palpate
    /// wrote the first, it wrote those.
    ///
    /// # Errors
    /// If one of them may not be written.
    pub(super) fn claim_all(self, path: &Path, extensions: &[&str]) -> anyhow::Result<()> {
        self.claim(path)?;
        if found(path)? == Found::Ours {
            return Ok(());
        }
        extensions.iter().try_for_each(|extension| self.claim(&path.with_extension(extension)))
    }

    /// Makes sure that `path`, which people go on to edit, is not there or may be replaced.
    ///
    /// # Errors
    /// If it is there without `--force`, or is no file.
    pub(super) fn claim_new(self, path: &Path) -> anyhow::Result<()> {
        self.claim(path)?;
        if path.exists() && !self.force {
            bail!("{} is there: --force replaces it", path.display());
        }
        Ok(())
    }

    /// Makes sure that `path` may become a folder of results of which `own` is one: it is not
    /// there, empty, or has that file, or `--force` is given.
    ///
    /// # Errors
    /// If it may not.
    pub(super) fn claim_folder(self, path: &Path, own: &str) -> anyhow::Result<()> {
        let is_empty = match fs::read_dir(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => true,
            entries => entries.with_context(|| path.display().to_string())?.next().is_none(),
        };
        if !is_empty && !path.join(own).is_file() && !self.force {
            bail!(
                "{} holds other things and no {own}: name a new folder, or write beside them with \
                 --force",
                path.display()
            );
        }
        Ok(())
    }
}

/// What is where a file shall be.
#[derive(PartialEq)]
enum Found {
    Nothing,
    Ours,
    Other,
}

fn found(path: &Path) -> anyhow::Result<Found> {
    let name = path.display();
    let kind = match fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Found::Nothing),
        Err(error) => return Err(error).with_context(|| name.to_string()),
        Ok(kind) => kind,
    };
    if !kind.is_file() {
        bail!("{name} is a folder, a device or a pipe; allowed is the name of a file");
    }
    let is_ours = is_marked(path).with_context(|| name.to_string())?;
    Ok(if is_ours { Found::Ours } else { Found::Other })
}

fn is_marked(path: &Path) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let last = file.metadata()?.len().saturating_sub(END);
    for start in [0, last] {
        file.seek(SeekFrom::Start(start))?;
        let mut bytes = Vec::new();
        Read::by_ref(&mut file).take(END).read_to_end(&mut bytes)?;
        bytes.make_ascii_lowercase();
        if bytes.windows(MARK.len()).any(|part| part == MARK) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Makes a folder, and those around it.
pub(super) fn make_folder(path: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(path).with_context(|| path.display().to_string())
}
