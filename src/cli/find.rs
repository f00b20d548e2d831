//! Lookup of experiments and scenes by name: `bird` finds `experiments/bird.toml`.

pub(super) use crate::experiment::experiment::SCENES;
pub(super) use crate::study::is_experiment;
use anyhow::{bail, ensure};
use palpate_geometry::import::is_mesh_file;
use palpate_input::shipped;
use std::convert::Infallible;
use std::path::{Path, PathBuf};

/// Folder of the shipped experiments.
pub(super) const EXPERIMENTS: &str = "experiments";

/// Finds the file for `name`: a path, or a path in `folder` without its ending. A relative path is
/// also searched beside the program and in `PALPATE_HOME`.
///
/// # Errors
/// If no file matches, with the most similar name, or if it is a mesh.
pub(super) fn find(name: &Path, folder: &str) -> anyhow::Result<PathBuf> {
    let what = if folder == SCENES { "a scene" } else { "an experiment" };
    ensure!(
        !(is_mesh_file(name) && name.is_file()),
        "{0} is a mesh, and this command needs {what} (.toml): palpate new {0} writes one",
        name.display()
    );
    if name.is_file() || name.is_absolute() {
        return Ok(name.into());
    }
    if let Some(found) = shipped::find(name, folder, None) {
        return Ok(found);
    }
    if name.extension().is_some() {
        return Ok(name.into());
    }
    let word = name.to_string_lossy();
    let file = format!("{word}.toml");
    let remedy = match Path::new(&file).is_file() {
        true => format!(", did you mean `{file}`?"),
        false => shipped::remedy(&word, &file_stems(folder)),
    };
    bail!("{word}: no such file, and no {folder}/{file}{remedy}")
}

/// Returns the path of an input file or folder: as it is, or that of a shipped one if there is no
/// other.
pub(super) fn find_input(path: &str) -> Result<PathBuf, Infallible> {
    Ok(located(Path::new(path)))
}

/// Returns the path as [`find_input`] does.
pub(super) fn located(path: &Path) -> PathBuf {
    shipped::locate(path, None).unwrap_or_else(|| path.into())
}

/// Sorted names of the files in `folder` that [`find`] finds.
pub(super) fn file_stems(folder: &str) -> Vec<String> {
    shipped::names(folder, None)
}
