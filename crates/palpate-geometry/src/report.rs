//! Report of the defects and repairs of a mesh.

use std::fmt;

use nalgebra::{Point3, Vector3};

use super::holes::{Hole, description};
use super::mesh::Mesh;
use super::raw::Element;

/// Smallest size of an object for exploration by touch, m.
pub const MIN_TOUCHABLE_M: f64 = 1e-3;

/// Largest size of an object for exploration by touch, m.
pub const MAX_TOUCHABLE_M: f64 = 5.0;

/// Number of occurrences of a defect, and the first triangle with it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DefectCount {
    /// Number of occurrences.
    pub count: usize,
    /// First triangle, as named by its source.
    pub first: Option<Element>,
}

impl fmt::Display for DefectCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.count)?;
        match &self.first {
            Some(first) => write!(f, "  (first: triangle {first})"),
            None => Ok(()),
        }
    }
}

/// Report of [`repair`](super::repair::repair): defects and repairs of a mesh. Its `Display` is a
/// readable summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshReport {
    /// SHA-256 of the mesh: of its vertices, 24 bytes each, then of its triangles, 12 bytes each,
    /// all little-endian; in hexadecimal.
    pub sha256: String,
    /// Vertices as imported.
    pub vertices_before: usize,
    /// Triangles as imported.
    pub triangles_before: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Lowest and highest corner of the bounding box, in metres.
    pub bounds_m: (Point3<f64>, Point3<f64>),
    /// Surface area, in m².
    pub area_m2: f64,
    /// Enclosed volume, in m³, if the mesh is closed.
    pub volume_m3: Option<f64>,
    /// Number of primitives of points or lines that were skipped.
    pub skipped_primitives: usize,
    /// Number of vertices merged into an earlier one at the same position.
    pub welded: usize,
    /// Triangles without area, removed.
    pub degenerate_removed: DefectCount,
    /// Triangles with the vertices of an earlier one, removed.
    pub duplicates_removed: DefectCount,
    /// Triangles whose winding was reversed.
    pub flipped: DefectCount,
    /// Edges with one triangle.
    pub border_edges: DefectCount,
    /// Holes, the largest first: borders around which the surface continues.
    pub holes: Vec<Hole>,
    /// Edges with three or more triangles.
    pub non_manifold_edges: DefectCount,
    /// Components, connected over edges with two triangles.
    pub components: usize,
    /// Components that are one-sided, like a Möbius strip.
    pub unorientable: usize,
}

impl MeshReport {
    /// Whether every component encloses a volume.
    pub fn is_closed(&self) -> bool {
        self.volume_m3.is_some()
    }

    /// Extent of the bounding box along x, y and z, in millimetres.
    pub fn size_mm(&self) -> Vector3<f64> {
        (self.bounds_m.1 - self.bounds_m.0) * 1e3
    }

    /// Returns the setting to change if the object's size indicates a wrong unit of its file.
    pub fn unit_hint(&self) -> Option<&'static str> {
        let size_m = (self.bounds_m.1 - self.bounds_m.0).max();
        if size_m > MAX_TOUCHABLE_M {
            Some("larger than 5 m: for a file in millimetres, set unit = \"mm\"")
        } else if size_m < MIN_TOUCHABLE_M {
            Some("smaller than 1 mm: for a file in metres, set unit = \"m\"")
        } else {
            None
        }
    }

    pub(super) fn measure(&mut self, mesh: &Mesh, closed: bool) {
        self.vertices = mesh.vertices().len();
        self.triangles = mesh.triangles().len();
        self.bounds_m = mesh.bounds();
        self.area_m2 = mesh.area_m2();
        self.volume_m3 = closed.then(|| mesh.volume_m3());
    }
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.size_mm().into();
        let (low, high) = (self.bounds_m.0, self.bounds_m.1);
        let mut row = |name: &str, value: fmt::Arguments<'_>| writeln!(f, "{name:<20}{value}");
        row("size", format_args!("{x:.3} x {y:.3} x {z:.3} mm"))?;
        row("from", format_args!("({:.6}, {:.6}, {:.6}) m", low.x, low.y, low.z))?;
        row("to", format_args!("({:.6}, {:.6}, {:.6}) m", high.x, high.y, high.z))?;
        row("vertices", format_args!("{} of {}", self.vertices, self.vertices_before))?;
        row("triangles", format_args!("{} of {}", self.triangles, self.triangles_before))?;
        row("area", format_args!("{:.6e} m2", self.area_m2))?;
        match self.volume_m3 {
            Some(volume_m3) => row("volume", format_args!("{volume_m3:.6e} m3"))?,
            None => row("volume", format_args!("none: the mesh is not closed"))?,
        }
        row("components", format_args!("{}", self.components))?;
        row("one-sided", format_args!("{}", self.unorientable))?;
        row("border edges", format_args!("{}", self.border_edges))?;
        if !self.holes.is_empty() {
            let area_m2: f64 = self.holes.iter().map(|hole| hole.area_m2).sum();
            let percent = 100.0 * area_m2 / (self.area_m2 + area_m2);
            let words = description(&self.holes);
            row("holes", format_args!("{words}; {percent:.2} % of the surface"))?;
        }
        row("non-manifold edges", format_args!("{}", self.non_manifold_edges))?;
        row("welded vertices", format_args!("{}", self.welded))?;
        row("degenerate removed", format_args!("{}", self.degenerate_removed))?;
        row("duplicates removed", format_args!("{}", self.duplicates_removed))?;
        row("flipped", format_args!("{}", self.flipped))?;
        row("skipped primitives", format_args!("{}", self.skipped_primitives))?;
        match self.unit_hint() {
            Some(hint) => row("hint", format_args!("{hint}")),
            None => Ok(()),
        }
    }
}
