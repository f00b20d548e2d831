//! Import of mesh files. To add a format, write its file here and add a line to `FORMATS`.

use std::io;
use std::path::Path;

use super::mesh::Mesh;
use super::raw::RawMesh;
use super::repair::repair;
use super::report::MeshReport;
use palpate_input::error::InputError;
use palpate_input::files;

mod accessor;
mod deform;
mod gltf;
mod obj;
pub mod ply;
mod ply_data;
mod source;
mod statement;
mod stl;

use source::{BYTES_MAX, Source};
pub use statement::{FileStatements, Statement, statements};

/// Reader of a format.
type Read = fn(&Source) -> Result<RawMesh, InputError>;

/// Extensions, in lower case, and their readers.
const FORMATS: &[(&str, Read)] = &[
    ("obj", obj::read),
    ("gltf", gltf::read),
    ("glb", gltf::read),
    ("stl", stl::read),
    ("ply", ply::read),
];

/// Whether the extension of a path is that of a mesh format, and its file is not hidden: macOS
/// writes a file `._NAME` beside each file on other systems' disks.
pub fn is_mesh_file(path: &Path) -> bool {
    if path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b".")) {
        return false;
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    FORMATS.iter().any(|(known, _)| *known == extension)
}

/// Reads a mesh file, scales it by `metres_per_unit` and repairs it. Buffers that a glTF document
/// refers to must lie in its folder or below.
///
/// The extension determines the format: OBJ, glTF (`.gltf` or `.glb`), STL, PLY. A glTF file is in
/// metres by its specification; the scale is applied nevertheless. Its model is turned upright:
/// (x, y, z) becomes (-x, z, y).
///
/// # Errors
/// If the file cannot be read or repaired; the place is the file.
pub fn import(path: &Path, metres_per_unit: f64) -> Result<(Mesh, MeshReport), InputError> {
    import_with(path, metres_per_unit, false)
}

/// Runs [`import`], with buffers of a glTF document outside its folder allowed if
/// `allow_external_buffers`.
///
/// # Errors
/// The errors of [`import`].
pub fn import_with(
    path: &Path,
    metres_per_unit: f64,
    allow_external_buffers: bool,
) -> Result<(Mesh, MeshReport), InputError> {
    read_and_repair(path, metres_per_unit, allow_external_buffers, true)
        .map_err(|fault| fault.at(path.display()))
}

/// Runs [`import`], and keeps the frame of the file also for glTF.
///
/// # Errors
/// The errors of [`import`].
pub fn import_in_file_frame(
    path: &Path,
    metres_per_unit: f64,
) -> Result<(Mesh, MeshReport), InputError> {
    read_and_repair(path, metres_per_unit, false, false).map_err(|fault| fault.at(path.display()))
}

fn read_and_repair(
    path: &Path,
    metres_per_unit: f64,
    allow_external_buffers: bool,
    upright: bool,
) -> Result<(Mesh, MeshReport), InputError> {
    if !(metres_per_unit > 0.0 && metres_per_unit.is_finite()) {
        return Err(InputError::new(format!(
            "the scale is {metres_per_unit} metres per unit; it must be positive and finite"
        )));
    }
    if path.is_dir() {
        return Err(unreadable(io::ErrorKind::IsADirectory.into()));
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let Some((_, read)) = FORMATS.iter().find(|(known, _)| *known == extension) else {
        let supported: Vec<&str> = FORMATS.iter().map(|(known, _)| *known).collect();
        let supported = supported.join(", ");
        return Err(InputError::new(format!("is a \".{extension}\" file; supported: {supported}")));
    };
    let bytes = files::bytes(path, BYTES_MAX).map_err(unreadable)?;
    let mut raw = read(&Source { path, bytes: &bytes, allow_external_buffers, upright })?;
    raw.scale(metres_per_unit);
    let (mesh, report) = repair(raw)?;
    let sha256 = mesh.sha256();
    Ok((mesh, MeshReport { sha256, ..report }))
}

fn unreadable(cause: io::Error) -> InputError {
    InputError::new(format!("cannot be read: {cause}"))
}
