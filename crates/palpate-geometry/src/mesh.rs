//! The triangle mesh that can be trusted.

use super::primitives::extent;
use nalgebra::{Isometry3, Point3};
use palpate_input::words::hex;
use sha2::{Digest, Sha256};

/// A triangle mesh, in metres.
///
/// Only [`repair`](super::repair::repair) makes one, so it always has at least one triangle,
/// finite vertices that are all used, indices in range, and no degenerate or duplicate triangles.
/// Winding is consistent over each edge-connected component: seen from outside, corners run
/// counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    bounds: (Point3<f64>, Point3<f64>),
}

impl Mesh {
    /// The caller promises what the type promises.
    pub(super) fn from_sound_parts(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        let bounds = extent(&vertices).map_or_else(Default::default, |[low, high]| (low, high));
        Self { vertices, triangles, bounds }
    }

    /// Vertex positions, in metres.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Triangles as indices into [`vertices`](Self::vertices).
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners of triangle `triangle`, in winding order, in metres.
    ///
    /// # Panics
    /// If there is no such triangle, like any index.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }

    /// Corners of all triangles, in order.
    pub fn iter_corners(&self) -> impl ExactSizeIterator<Item = [Point3<f64>; 3]> + '_ {
        (0..self.triangles.len()).map(|triangle| self.corners(triangle))
    }

    /// The smallest axis-aligned box around the mesh: least and greatest corner, in metres. Known
    /// beforehand, however many vertices there are.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        self.bounds
    }

    /// SHA-256 of the vertices, then of the triangles, as [`MeshReport`](super::report::MeshReport)
    /// has it.
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
    /// Meaningful when the mesh is closed. An inner wall counts as a body of its own.
    pub fn volume_m3(&self) -> f64 {
        // Measured from a vertex, so that a mesh far from the origin loses no digits.
        let origin = self.vertices[0];
        self.iter_corners()
            .map(|[a, b, c]| (a - origin).dot(&(b - origin).cross(&(c - origin))))
            .sum::<f64>()
            / 6.0
    }

    /// The mesh enlarged by a positive, finite `factor` about its origin.
    pub fn scaled(&self, factor: f64) -> Self {
        let vertices = self.vertices.iter().map(|vertex| vertex * factor).collect();
        Self::from_sound_parts(vertices, self.triangles.clone())
    }

    /// The mesh moved by the finite pose `x_wm`: a vertex p in M becomes `x_wm` p in W.
    pub fn transformed(&self, x_wm: &Isometry3<f64>) -> Self {
        let vertices = self.vertices.iter().map(|vertex| x_wm * vertex).collect();
        Self::from_sound_parts(vertices, self.triangles.clone())
    }
}
