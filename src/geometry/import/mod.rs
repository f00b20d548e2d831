//! Mesh files. To add a format: write its file here and give it a line in `FORMATS`.

use std::io;
use std::path::Path;

use super::error::{MeshError, MeshFault};
use super::mesh::Mesh;
use super::raw::RawMesh;
use super::repair::repair;
use super::report::MeshReport;
use crate::files;

mod accessor;
mod gltf;
mod obj;
mod ply;
mod source;
mod stl;

pub use source::Buffers;

use source::{BYTES_MAX, Source};

type Reader = fn(&Source) -> Result<RawMesh, MeshFault>;

/// Extensions, in lower case, and who reads them.
const FORMATS: &[(&str, Reader)] = &[
    ("obj", obj::read),
    ("gltf", gltf::read),
    ("glb", gltf::read),
    ("stl", stl::read),
    ("ply", ply::read),
];

/// Reads a mesh file, scales it by `metres_per_unit` and repairs it. Buffers that a glTF document
/// refers to must lie [beside](Buffers::Beside) it.
///
/// The extension decides the format: OBJ, glTF (`.gltf` or `.glb`), STL, PLY. A glTF file is in
/// metres by its specification; the scale multiplies all the same.
///
/// # Errors
/// [`MeshError`] says which file, and what is wrong with it.
pub fn import(path: &Path, metres_per_unit: f64) -> Result<(Mesh, MeshReport), MeshError> {
    import_with(path, metres_per_unit, Buffers::Beside)
}

/// As [`import`], with buffers where `buffers` allows them.
///
/// # Errors
/// [`MeshError`] says which file, and what is wrong with it.
pub fn import_with(
    path: &Path,
    metres_per_unit: f64,
    buffers: Buffers,
) -> Result<(Mesh, MeshReport), MeshError> {
    read_and_repair(path, metres_per_unit, buffers)
        .map_err(|fault| MeshError { path: path.to_owned(), fault })
}

fn read_and_repair(
    path: &Path,
    metres_per_unit: f64,
    buffers: Buffers,
) -> Result<(Mesh, MeshReport), MeshFault> {
    if !(metres_per_unit > 0.0 && metres_per_unit.is_finite()) {
        return Err(MeshFault::BadScale { metres_per_unit });
    }
    if path.is_dir() {
        return Err(MeshFault::Unreadable(io::ErrorKind::IsADirectory.into()));
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let Some((_, read)) = FORMATS.iter().find(|(known, _)| *known == extension) else {
        let supported = FORMATS.iter().map(|(known, _)| *known).collect();
        return Err(MeshFault::UnsupportedExtension { extension, supported });
    };
    let bytes = files::bytes(path, BYTES_MAX)?;
    let mut raw = read(&Source { path, bytes: &bytes, buffers })?;
    raw.scale(metres_per_unit);
    let (mesh, report) = repair(raw)?;
    let sha256 = mesh.sha256();
    Ok((mesh, MeshReport { sha256, ..report }))
}
