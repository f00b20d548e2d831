//! Meshes as arrays.

use crate::errors;
use nalgebra::Point3;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray2};
use palpate::geometry::import::import;
use palpate::geometry::mesh::Mesh;
use palpate::geometry::report::MeshReport;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Vertices (n, 3), metres, and triangles (m, 3).
pub(crate) type Arrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

/// Converts a mesh to arrays.
///
/// # Errors
/// If memory is exhausted.
pub(crate) fn arrays<'py>(py: Python<'py>, mesh: &Mesh) -> PyResult<Arrays<'py>> {
    triangles_of(py, mesh.vertices(), mesh.triangles())
}

/// Converts vertices and triangles to arrays.
///
/// # Errors
/// If memory is exhausted.
pub(crate) fn triangles_of<'py>(
    py: Python<'py>,
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
) -> PyResult<Arrays<'py>> {
    let vertices: Vec<f64> =
        vertices.iter().flat_map(|vertex| vertex.coords.iter().copied()).collect();
    let triangles = triangles.concat();
    let count = (vertices.len() / 3, triangles.len() / 3);
    Ok((
        vertices.into_pyarray(py).reshape([count.0, 3])?,
        triangles.into_pyarray(py).reshape([count.1, 3])?,
    ))
}

/// Creates a repaired mesh from arrays.
///
/// # Errors
/// `ValueError` for other shapes, `SimulationError` if the mesh is unusable.
pub(crate) fn mesh_of(
    vertices: &PyReadonlyArray2<'_, f64>,
    triangles: &PyReadonlyArray2<'_, i64>,
) -> PyResult<(Mesh, MeshReport)> {
    let (vertices, triangles) = (vertices.as_array(), triangles.as_array());
    if vertices.ncols() != 3 || triangles.ncols() != 3 {
        let (v, t) = (vertices.shape(), triangles.shape());
        let words =
            format!("vertices have shape {v:?} and triangles {t:?}; allowed are (n, 3) and (m, 3)");
        return Err(PyValueError::new_err(words));
    }
    let vertices: Vec<Point3<f64>> =
        vertices.rows().into_iter().map(|row| Point3::new(row[0], row[1], row[2])).collect();
    // An invalid or negative index is rejected below.
    let index = |i: i64| u32::try_from(i).unwrap_or(u32::MAX);
    let triangles: Vec<[u32; 3]> =
        triangles.rows().into_iter().map(|row| [row[0], row[1], row[2]].map(index)).collect();
    Mesh::new(&vertices, &triangles).map_err(errors::scene)
}

/// Reads a mesh file and repairs it; returns vertices (n, 3), metres, triangles (m, 3), and a
/// report of the repairs.
#[pyfunction]
#[pyo3(signature = (path, metres_per_unit = 1.0))]
pub(crate) fn read_mesh<'py>(
    py: Python<'py>,
    path: PathBuf,
    metres_per_unit: f64,
) -> PyResult<(Arrays<'py>, String)> {
    let (mesh, report) = py.detach(|| import(&path, metres_per_unit)).map_err(errors::scene)?;
    Ok((arrays(py, &mesh)?, report.to_string()))
}
