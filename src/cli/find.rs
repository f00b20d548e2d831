//! Lookup of experiments and scenes by name: `bird` finds `experiments/bird.toml`.

use anyhow::{bail, ensure};
use palpate_geometry::import::is_mesh_file;
use palpate_input::{files, format};
use std::path::{Path, PathBuf};

/// Folder of the shipped experiments.
pub(super) const EXPERIMENTS: &str = "experiments";
/// Folder of the shipped scenes.
pub(super) const SCENES: &str = "scenes";

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
    let in_places = |folder, file: &Path| -> Option<PathBuf> {
        folders(folder).map(|folder| folder.join(file)).find(|path| path.is_file())
    };
    if name.extension().is_some() {
        return Ok(in_places("", name).unwrap_or_else(|| name.into()));
    }
    let file = name.with_extension("toml");
    if let Some(found) = in_places(folder, &file) {
        return Ok(found);
    }
    let word = name.to_string_lossy();
    let known = file_stems(folder);
    let here = file.is_file().then(|| file.to_string_lossy().into_owned());
    let meant = match here.or_else(|| format::nearest(&word, &known)) {
        Some(meant) => format!(", did you mean `{meant}`?"),
        None if known.is_empty() => {
            format!("; set {HOME} to the folder that has {EXPERIMENTS}/ and {SCENES}/")
        }
        None => String::new(),
    };
    bail!("{word}: no such file, and no {folder}/{}{meant}", file.display())
}

/// Whether the file is an experiment: experiments have `planners` or `scene`, scenes do not. An
/// unreadable file counts as a scene.
pub(super) fn is_experiment(path: &Path) -> bool {
    files::text(path, files::TEXT_MAX)
        .ok()
        .and_then(|text| text.parse::<toml::Table>().ok())
        .is_some_and(|table| table.contains_key("planners") || table.contains_key("scene"))
}

/// Sorted names of the files in all places where [`find`] searches `folder`.
pub(super) fn file_stems(folder: &str) -> Vec<String> {
    let files = folders(folder).filter_map(|folder| std::fs::read_dir(folder).ok());
    let stem = |path: PathBuf| -> Option<String> {
        let is_toml = path.extension().is_some_and(|extension| extension == "toml");
        Some(path.file_stem()?.to_str()?.to_owned()).filter(|_| is_toml)
    };
    let mut names: Vec<String> =
        files.flatten().flatten().filter_map(|entry| stem(entry.path())).collect();
    names.sort();
    names.dedup();
    names
}

/// Environment variable: the folder that contains `experiments` and `scenes` if they are neither in
/// the working directory nor beside the program.
const HOME: &str = "PALPATE_HOME";

/// Candidate locations of `folder`, in search order.
fn folders(folder: &str) -> impl Iterator<Item = PathBuf> {
    let program = std::env::current_exe().ok();
    let beside = program.and_then(|program| Some(program.parent()?.join(folder)));
    let home = std::env::var_os(HOME).map(|home| Path::new(&home).join(folder));
    std::iter::once(PathBuf::from(folder)).chain(beside).chain(home)
}
