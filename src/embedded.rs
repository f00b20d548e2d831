//! Experiments, scenes and models inside the program, for use outside a checkout.

use include_dir::{Dir, include_dir};
use palpate_input::format::hex;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};

static FOLDERS: [(&str, Dir<'_>); 3] = [
    ("experiments", include_dir!("$CARGO_MANIFEST_DIR/experiments")),
    ("scenes", include_dir!("$CARGO_MANIFEST_DIR/scenes")),
    ("models", include_dir!("$CARGO_MANIFEST_DIR/models")),
];

/// Returns a folder with the shipped files, in the user's cache; the first call of a version writes
/// it. Returns `None` without a cache folder that can be written.
pub fn folder() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let cache = match variable("XDG_CACHE_HOME") {
        Some(cache) => PathBuf::from(cache),
        None => Path::new(&variable("HOME")?).join(".cache"),
    };
    let files = files();
    let mut hash = Sha256::new();
    for (path, content) in &files {
        hash.update(path.to_string_lossy().as_bytes());
        hash.update(content);
    }
    let folder = cache.join("palpate").join(hex(&hash.finalize()[..8]));
    if !folder.is_dir() {
        write(&folder, &files).ok()?;
    }
    Some(folder)
}

/// Paths and contents of all files.
fn files() -> Vec<(PathBuf, &'static [u8])> {
    fn add(root: &str, dir: &'static Dir<'_>, files: &mut Vec<(PathBuf, &'static [u8])>) {
        files.extend(dir.files().map(|file| (Path::new(root).join(file.path()), file.contents())));
        dir.dirs().for_each(|dir| add(root, dir, files));
    }
    let mut files = Vec::new();
    FOLDERS.iter().for_each(|(root, dir)| add(root, dir, &mut files));
    files.sort();
    files
}

/// Writes the files beside `folder`, then moves them there at once, so that the folder is complete
/// whenever it exists.
fn write(folder: &Path, files: &[(PathBuf, &[u8])]) -> std::io::Result<()> {
    let beside = folder.parent().unwrap_or(folder);
    fs::create_dir_all(beside)?;
    let unfinished = tempfile::tempdir_in(beside)?;
    for (path, content) in files {
        let path = unfinished.path().join(path);
        path.parent().map_or(Ok(()), fs::create_dir_all)?;
        fs::write(path, content)?;
    }
    match fs::rename(unfinished.path(), folder) {
        // Another process wrote it meanwhile.
        Err(_) if folder.is_dir() => Ok(()),
        moved => moved,
    }
}
