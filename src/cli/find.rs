//! Experiments and scenes by name: `bird` for `experiments/bird.toml`.

use anyhow::bail;
use palpate_input::{files, words};
use std::path::{Path, PathBuf};

/// Folder of the experiments that come with the program.
pub(super) const EXPERIMENTS: &str = "experiments";
/// Folder of the scenes.
pub(super) const SCENES: &str = "scenes";

/// The file that is meant by `name`: a path, or the name of a file in `folder`, here, beside the
/// program or in `PALPATE_HOME`.
///
/// # Errors
/// If there is none, with the name most like it.
pub(super) fn find(name: &Path, folder: &str) -> anyhow::Result<PathBuf> {
    let is_plain = name.extension().is_none() && name.components().count() == 1;
    if !is_plain || name.exists() && !name.is_dir() {
        return Ok(name.into());
    }
    let file = name.with_extension("toml");
    let found = folders(folder).map(|folder| folder.join(&file)).find(|path| path.is_file());
    if let Some(found) = found {
        return Ok(found);
    }
    let word = name.to_string_lossy();
    let known = words::nearest(&word, &names(folder));
    let meant = known.map_or(String::new(), |known| format!(", did you mean `{known}`?"));
    bail!("{word}: no such file, and no {folder}/{}{meant}", file.display())
}

/// An experiment names planners, a scene does not; a file that is neither is read as a scene.
pub(super) fn is_experiment(path: &Path) -> bool {
    files::text(path, files::TEXT_MAX)
        .ok()
        .and_then(|text| text.parse::<toml::Table>().ok())
        .is_some_and(|table| table.contains_key("planners") || table.contains_key("scene"))
}

/// The names of the files in `folder`, where [`find`] looks first, in order.
pub(super) fn names(folder: &str) -> Vec<String> {
    let files = folders(folder).find_map(|folder| std::fs::read_dir(folder).ok());
    let stem = |path: PathBuf| -> Option<String> {
        let is_toml = path.extension().is_some_and(|extension| extension == "toml");
        Some(path.file_stem()?.to_str()?.to_owned()).filter(|_| is_toml)
    };
    let mut names: Vec<String> =
        files.into_iter().flatten().flatten().filter_map(|entry| stem(entry.path())).collect();
    names.sort();
    names
}

/// Names the folder that `experiments` and `scenes` lie in, if they lie neither here nor beside the
/// program.
const HOME: &str = "PALPATE_HOME";

/// Where to look for `folder`.
fn folders(folder: &str) -> impl Iterator<Item = PathBuf> {
    let program = std::env::current_exe().ok();
    let beside = program.and_then(|program| Some(program.parent()?.join(folder)));
    let home = std::env::var_os(HOME).map(|home| Path::new(&home).join(folder));
    std::iter::once(PathBuf::from(folder)).chain(beside).chain(home)
}
