//! Shared fragments of MJCF.

use crate::arm_mjcf::list;
use nalgebra::{Isometry3, Point3};
use palpate_geometry::mesh::Mesh;
use std::fmt::Display;

// Attributes of the two geoms that collide.
// heuristic: no friction, and as compliant as mount and gears of an arm, because a rigid contact
// would stop the arm with an unrealistic force.
pub(super) const CONTACT: &str =
    r#"contype="1" conaffinity="1" condim="1" solref=".01 1" solimp=".95 .99 .0001""#;

/// Attributes of the arm's links if they collide: with each other, the table and the object.
pub(super) const LINK: &str =
    r#"contype="2" conaffinity="3" condim="1" solref=".01 1" solimp=".95 .99 .0001""#;

/// Attributes of the table, and of a finger with a skin, if they collide with links.
pub(super) const TABLE: &str =
    r#"contype="2" conaffinity="2" condim="1" solref=".01 1" solimp=".95 .99 .0001""#;

/// Returns a pose as attributes.
pub(super) fn pose(x: &Isometry3<f64>) -> String {
    let q = x.rotation.quaternion();
    format!(r#"pos="{}" quat="{}""#, list(x.translation.vector.iter()), list([q.w, q.i, q.j, q.k]))
}

/// Returns `mesh` as an asset called `name`; MuJoCo stores its numbers in single precision, about
/// its centre of mass.
pub(super) fn mesh_asset(mesh: &Mesh, name: &str) -> String {
    surface(name, mesh.vertices().iter().copied(), mesh.triangles().iter().copied())
}

/// Returns a mesh asset of any vertices and triangles.
pub(super) fn surface<Index: Display>(
    name: &str,
    vertices: impl IntoIterator<Item = Point3<f64>>,
    triangles: impl IntoIterator<Item = [Index; 3]>,
) -> String {
    let vertices = list(vertices.into_iter().flat_map(|p| [p.x, p.y, p.z]));
    let faces = list(triangles.into_iter().flatten());
    format!(r#"<mesh name="{name}" inertia="shell" vertex="{vertices}" face="{faces}"/>"#)
}
