//! A mesh as text.

use super::text::list;
use crate::geometry::mesh::Mesh;
use nalgebra::Point3;
use std::fmt::Display;

/// `mesh` as an asset called `name`; MuJoCo keeps its numbers in single precision, about its
/// centre of mass.
pub(super) fn asset(mesh: &Mesh, name: &str) -> String {
    surface(name, mesh.vertices().iter().copied(), mesh.triangles().iter().copied())
}

/// The same of any vertices and triangles.
pub(super) fn surface<Index: Display>(
    name: &str,
    vertices: impl IntoIterator<Item = Point3<f64>>,
    triangles: impl IntoIterator<Item = [Index; 3]>,
) -> String {
    let vertices = list(vertices.into_iter().flat_map(|p| [p.x, p.y, p.z]));
    let faces = list(triangles.into_iter().flatten());
    format!(r#"<mesh name="{name}" inertia="shell" vertex="{vertices}" face="{faces}"/>"#)
}
