//! Lookup of experiments and scenes by name: `bird` finds `experiments/bird.toml`.

pub(super) use crate::experiment::experiment::SCENES;
use anyhow::bail;
use palpate_input::{files, shipped};
use std::path::{Path, PathBuf};

/// Folder of the shipped experiments.
pub(super) const EXPERIMENTS: &str = "experiments";

/// Finds the file for `name`: a path, or the name of a file in `folder`, in the working directory,
/// beside the program or in `PALPATE_HOME`.
///
/// # Errors
/// If no file matches; the message suggests the most similar name.
pub(super) fn find(name: &Path, folder: &str) -> anyhow::Result<PathBuf> {
    if !shipped::is_plain(name) || name.exists() && !name.is_dir() {
        return Ok(name.into());
    }
    if let Some(found) = shipped::find(name, folder, None) {
        return Ok(found);
    }
    let word = name.to_string_lossy();
    let remedy = shipped::remedy(&word, &file_stems(folder));
    bail!("{word}: no such file, and no {folder}/{word}.toml{remedy}")
}

/// Whether the file is an experiment: experiments have `planners` or `scene`, scenes do not. An
/// unreadable file counts as a scene.
pub(super) fn is_experiment(path: &Path) -> bool {
    files::text(path, files::TEXT_MAX)
        .ok()
        .and_then(|text| text.parse::<toml::Table>().ok())
        .is_some_and(|table| table.contains_key("planners") || table.contains_key("scene"))
}

/// Sorted names of the files in `folder` that [`find`] finds.
pub(super) fn file_stems(folder: &str) -> Vec<String> {
    shipped::names(folder, None)
}
