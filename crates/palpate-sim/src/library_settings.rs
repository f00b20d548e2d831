//! Table `[library]`: the objects of a folder.

use super::unit::Unit;
use palpate_geometry::import::is_mesh_file;
use palpate_input::config::{Rules, Validate, is_default};
use palpate_input::error::InputError;
use palpate_input::paths::InputPath;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};

/// Table `[library]`: meshes of a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LibrarySettings {
    /// Folder with mesh files, relative to the scene file. Their z axis points up. Without any,
    /// each folder in it is an object: its mesh with the shortest name.
    pub folder: InputPath,
    /// Unit of the mesh files.
    #[serde(default)]
    pub unit: Unit,
    /// Names of the objects: files without their endings, folders, or paths such as `mug/textured`
    /// without an end that all share; default: all.
    #[serde(default, skip_serializing_if = "is_default")]
    pub objects: Vec<String>,
    /// Names of objects that trials touch too, and that no hypothesis has: none of these.
    #[serde(default, skip_serializing_if = "is_default")]
    pub unknown: Vec<String>,
    /// Whether the part of a name before `-` is a class, and hypotheses are about classes.
    #[serde(default, skip_serializing_if = "is_default")]
    pub has_classes: bool,
}

impl Validate for LibrarySettings {
    fn check(&self, rules: &mut Rules) {
        let is_named = !self.folder.as_os_str().is_empty();
        rules.require("folder", "\"\"", is_named, || "the name of a folder with meshes".into());
    }
}

/// Name of an object, and its mesh.
pub type ObjectFile = (String, PathBuf);

impl LibrarySettings {
    /// Returns the objects of the hypotheses, and the unknown ones, sorted by name.
    ///
    /// # Errors
    /// If the folder cannot be read, has no mesh, or lacks a listed object.
    pub fn files(&self) -> Result<[Vec<ObjectFile>; 2], InputError> {
        let failed = |words: String| {
            InputError::new(format!("{}{words}", self.folder.display())).at("library.folder")
        };
        let all = objects_of(&self.folder).map_err(|error| failed(format!(": {error}")))?;
        let find = |key: &str, name: &String| {
            let listed = all.iter().find(|(known, _)| known == name).cloned();
            listed.or_else(|| Some((name.clone(), mesh_at(&self.folder.join(name))?))).ok_or_else(
                || {
                    let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
                    let names = names.join(", ");
                    let words = format!("\"{name}\" is no mesh of the folder; allowed are {names}");
                    InputError::new(words).at(format!("library.{key}"))
                },
            )
        };
        if all.is_empty() && self.objects.is_empty() {
            let formats = "at least one .obj, .gltf, .glb, .stl or .ply file";
            return Err(failed(format!(" has no mesh; allowed is {formats}")));
        }
        let find_all = |key: &str, names: &[String]| -> Result<Vec<ObjectFile>, InputError> {
            names.iter().map(|name| find(key, name)).collect()
        };
        let mut unknown = find_all("unknown", &self.unknown)?;
        let mut known = match self.objects.is_empty() {
            true => all.clone(),
            false => find_all("objects", &self.objects)?,
        };
        known.retain(|(_, path)| unknown.iter().all(|(_, other)| other != path));
        shorten(known.iter_mut().chain(&mut unknown).map(|(name, _)| name).collect());
        known.sort();
        unknown.sort();
        Ok([known, unknown])
    }
}

/// Returns the meshes of a folder; if it has none, those of its folders.
fn objects_of(folder: &Path) -> io::Result<Vec<ObjectFile>> {
    let name = |path: Option<&std::ffi::OsStr>| path.unwrap_or_default().to_string_lossy().into();
    let (meshes, others): (Vec<PathBuf>, Vec<PathBuf>) =
        paths_in(folder)?.into_iter().partition(|path| is_mesh_file(path));
    if !meshes.is_empty() {
        return Ok(meshes.into_iter().map(|path| (name(path.file_stem()), path)).collect());
    }
    let object = |folder: &PathBuf| {
        let meshes = paths_in(folder).ok()?.into_iter().filter(|path| is_mesh_file(path));
        let mesh = meshes.min_by_key(|path| path.file_name().map(|name| name.len()))?;
        Some((name(folder.file_name()), mesh))
    };
    Ok(others.iter().filter_map(object).collect())
}

/// Returns the mesh at `path`, which lacks the ending.
fn mesh_at(path: &Path) -> Option<PathBuf> {
    let paths = paths_in(path.parent()?).ok()?;
    paths.into_iter().find(|it| is_mesh_file(it) && it.file_stem() == path.file_name())
}

/// Returns the sorted paths in a folder.
fn paths_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder)?.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    Ok(paths)
}

/// Removes the last parts that all of several names share: `mug/textured` becomes `mug`.
fn shorten(mut names: Vec<&mut String>) {
    let end = |name: &String| name.rsplit_once('/').map(|(_, end)| end.to_owned());
    while let Some(last) = names.first().and_then(|name| end(name)) {
        if names.len() == 1 || !names.iter().all(|name| end(name).as_ref() == Some(&last)) {
            return;
        }
        names.iter_mut().for_each(|name| name.truncate(name.len() - last.len() - 1));
    }
}
