//! A mesh as text.

use crate::geometry::mesh::Mesh;
use std::fmt::Write;

/// `mesh` as an asset called `name`; MuJoCo keeps its numbers in single precision, about its
/// centre of mass.
pub(super) fn asset(mesh: &Mesh, name: &str) -> String {
    let mut vertices = String::new();
    for p in mesh.vertices() {
        // Writing to a String cannot fail.
        let _ = write!(vertices, "{} {} {} ", p.x, p.y, p.z);
    }
    let mut faces = String::new();
    for [a, b, c] in mesh.triangles() {
        let _ = write!(faces, "{a} {b} {c} ");
    }
    format!(r#"<mesh name="{name}" inertia="shell" vertex="{vertices}" face="{faces}"/>"#)
}
