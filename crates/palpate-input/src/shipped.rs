//! Lookup of shipped files by name: `bird` finds `scenes/bird.toml`.

use crate::format;
use std::fs;
use std::path::{Path, PathBuf};

/// Environment variable: the folder that contains the folders of shipped files if they are neither
/// in the working directory nor beside the program.
pub const HOME: &str = "PALPATE_HOME";

/// Folders of the shipped files.
const FOLDERS: [&str; 3] = ["experiments", "scenes", "models"];

/// Whether `name` has no folder and no extension.
pub fn is_plain(name: &Path) -> bool {
    name.extension().is_none() && name.components().count() == 1
}

/// Returns the file `NAME.toml` in a `folder` of shipped files: in the working directory, beside
/// the program, or in `home`, by default that of [`HOME`]. A name with an extension is a whole
/// path in these places.
pub fn find(name: &Path, folder: &str, home: Option<&Path>) -> Option<PathBuf> {
    let (file, folder) = match name.extension() {
        None => (name.with_extension("toml"), folder),
        Some(_) => (name.to_owned(), ""),
    };
    folders(folder, home).map(|folder| folder.join(&file)).find(|path| path.is_file())
}

/// Returns the file or folder at the relative `path` in the working directory, beside the program,
/// or in `home`, by default that of [`HOME`].
pub fn locate(path: &Path, home: Option<&Path>) -> Option<PathBuf> {
    folders("", home).map(|folder| folder.join(path)).find(|path| path.exists())
}

/// Returns the sorted names of the files that [`find`] finds.
pub fn names(folder: &str, home: Option<&Path>) -> Vec<String> {
    let files = folders(folder, home).filter_map(|folder| fs::read_dir(folder).ok());
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

/// Returns the sorted paths of all shipped files, relative to the folder that contains theirs:
/// the program's, that of [`HOME`], or the working directory.
pub fn files() -> Vec<PathBuf> {
    let mut roots = folders("", None).skip(1);
    let root = roots.find(|root| FOLDERS.iter().all(|name| root.join(name).is_dir()));
    let root = root.unwrap_or_default();
    let mut files = Vec::new();
    FOLDERS.iter().for_each(|name| add_files(&root, Path::new(name), &mut files));
    files.sort();
    files
}

/// Adds the paths, relative to `root`, of the files in its `folder` and below.
fn add_files(root: &Path, folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(root.join(folder)).into_iter().flatten().flatten() {
        let path = folder.join(entry.file_name());
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => add_files(root, &path, files),
            Ok(kind) if kind.is_file() => files.push(path),
            _ => {}
        }
    }
}

/// Returns the end of a message about a `name` that [`find`] does not find: the most similar of
/// `names`, or how to set the folder if there are none.
pub fn remedy(name: &str, names: &[String]) -> String {
    match format::nearest(name, names) {
        Some(meant) => format!(", did you mean `{meant}`?"),
        None if names.is_empty() => {
            format!("; set {HOME} to the folder that has experiments/ and scenes/")
        }
        None => String::new(),
    }
}

/// Returns the path of the shipped file at the absolute `path` as [`locate`] finds it on every
/// machine, such as `models/bird.glb`; `None` for other files.
pub fn portable(path: &Path) -> Option<PathBuf> {
    let roots = installed(None).filter_map(|folder| folder.canonicalize().ok());
    let mut within = roots.filter_map(|root| path.strip_prefix(root).ok().map(Path::to_owned));
    within.find(|path| FOLDERS.iter().any(|folder| path.starts_with(folder)))
}

/// Candidate locations of `folder`, in search order.
fn folders(folder: &str, home: Option<&Path>) -> impl Iterator<Item = PathBuf> {
    let installed = installed(home).map(move |root| root.join(folder));
    std::iter::once(PathBuf::from(folder)).chain(installed)
}

/// Folders of the shipped files outside the working directory: beside the program, and `home`.
fn installed(home: Option<&Path>) -> impl Iterator<Item = PathBuf> {
    let program = std::env::current_exe().ok();
    let beside = program.and_then(|program| Some(program.parent()?.to_owned()));
    let home = home.map(Path::to_owned).or_else(|| std::env::var_os(HOME).map(PathBuf::from));
    beside.into_iter().chain(home)
}
