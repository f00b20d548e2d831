//! Validated triangle mesh.

use super::primitives::extent;
use nalgebra::{Isometry3, Point3};
use palpate_input::format::hex;
use sha2::{Digest, Sha256};

/// A triangle mesh, in metres.
///
/// It is created only by [`repair`](super::repair::repair), so it always has at least one triangle,
/// finite vertices that are all used, indices in range, and no degenerate or duplicate triangles.
/// Winding is consistent over each edge-connected component: seen from outside, corners run
/// counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// Number of triangles that are the object's; the others are patches over its holes.
    own: usize,
    bounds: (Point3<f64>, Point3<f64>),
}

impl Mesh {
    /// Creates a mesh from parts that must satisfy the invariants of the type.
    pub(super) fn from_sound_parts(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        let bounds = extent(&vertices).map_or_else(Default::default, |[low, high]| (low, high));
        Self { vertices, own: triangles.len(), triangles, bounds }
    }

    /// Returns the mesh with more triangles over its vertices, marked as patches.
    pub(super) fn with_marked_triangles(&self, patches: impl Iterator<Item = [u32; 3]>) -> Self {
        let triangles = self.triangles.iter().copied().chain(patches).collect();
        Self { triangles, ..self.clone() }
    }

    /// Whether a triangle is a patch over a [hole](super::holes), where the surface is unknown.
    pub fn is_patch(&self, triangle: u32) -> bool {
        triangle as usize >= self.own
    }

    /// Whether the mesh has patches over holes.
    pub fn has_patches(&self) -> bool {
        self.own < self.triangles.len()
    }

    /// Vertex positions, in metres.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Triangles as indices into [`vertices`](Self::vertices).
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the corners of triangle `triangle`, in winding order, in metres.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }

    /// Returns the corners of all triangles, in order.
    pub fn iter_corners(&self) -> impl ExactSizeIterator<Item = [Point3<f64>; 3]> + '_ {
        (0..self.triangles.len()).map(|triangle| self.corners(triangle))
    }

    /// Returns the smallest axis-aligned box around the mesh: lowest and highest corner, in metres.
    /// The box is precomputed.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        self.bounds
    }

    /// Returns the SHA-256 of the vertices, then of the triangles, as in
    /// [`MeshReport`](super::report::MeshReport).
    pub fn sha256(&self) -> String {
        let mut hash = Sha256::new();
        for vertex in &self.vertices {
            vertex.iter().for_each(|coordinate| hash.update(coordinate.to_le_bytes()));
        }
        for triangle in &self.triangles {
            triangle.iter().for_each(|corner| hash.update(corner.to_le_bytes()));
        }
        hex(hash.finalize())
    }

    /// Surface area, in m²: half the sum of ‖(b − a) × (c − a)‖.
    pub fn area_m2(&self) -> f64 {
        self.iter_corners().map(|[a, b, c]| (b - a).cross(&(c - a)).norm()).sum::<f64>() / 2.0
    }

    /// Enclosed volume, in m³, by the divergence theorem: a sixth of the sum of a · (b × c).
    ///
    /// Meaningful if the mesh is closed. An inner wall counts as a separate body.
    pub fn volume_m3(&self) -> f64 {
        // Relative to a vertex, so that a mesh far from the origin loses no digits.
        let origin = self.vertices[0];
        self.iter_corners()
            .map(|[a, b, c]| (a - origin).dot(&(b - origin).cross(&(c - origin))))
            .sum::<f64>()
            / 6.0
    }

    /// Returns the mesh scaled by a positive, finite `factor` about its origin.
    pub fn scaled(&self, factor: f64) -> Self {
        let vertices = self.vertices.iter().map(|vertex| vertex * factor).collect();
        Self { own: self.own, ..Self::from_sound_parts(vertices, self.triangles.clone()) }
    }

    /// Returns the mesh moved by the finite pose `x_wm`: a vertex p in M becomes `x_wm` p in W.
    pub fn transformed(&self, x_wm: &Isometry3<f64>) -> Self {
        let vertices = self.vertices.iter().map(|vertex| x_wm * vertex).collect();
        Self { own: self.own, ..Self::from_sound_parts(vertices, self.triangles.clone()) }
    }
}
