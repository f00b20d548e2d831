//! What was found in a mesh and what was done to it.

use std::fmt;

use nalgebra::{Point3, Vector3};

use super::mesh::Mesh;
use super::raw::Element;

/// An object smaller than this, in metres, is too small to be touched.
pub const MIN_TOUCHABLE_M: f64 = 1e-3;

/// An object larger than this, in metres, is too large to be explored by touch.
pub const MAX_TOUCHABLE_M: f64 = 5.0;

/// How often something was found, and the first triangle it was found on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Finding {
    /// How often.
    pub count: usize,
    /// The first triangle, as its source names it.
    pub first: Option<Element>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.count)?;
        match &self.first {
            Some(first) => write!(f, "  (first: triangle {first})"),
            None => Ok(()),
        }
    }
}

/// What [`repair`](super::repair::repair) found in a mesh and did to it. Its `Display` is the
/// summary for a person.
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
    /// Least and greatest corner of the bounding box, in metres.
    pub bounds_m: (Point3<f64>, Point3<f64>),
    /// Surface area, in m².
    pub area_m2: f64,
    /// Enclosed volume, in m³, if the mesh is closed.
    pub volume_m3: Option<f64>,
    /// Primitives of points or lines that were left out.
    pub skipped_primitives: usize,
    /// Vertices that shared the position of an earlier one.
    pub welded: usize,
    /// Triangles without area, removed.
    pub degenerate_removed: Finding,
    /// Triangles with the vertices of an earlier one, removed.
    pub duplicates_removed: Finding,
    /// Triangles whose winding was reversed.
    pub flipped: Finding,
    /// Edges with one triangle.
    pub border_edges: Finding,
    /// Edges with three or more triangles.
    pub non_manifold_edges: Finding,
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

    /// What to change if the object's size says that its file was read in the wrong unit.
    pub fn unit_hint(&self) -> Option<&'static str> {
        let size_m = (self.bounds_m.1 - self.bounds_m.0).max();
        if size_m > MAX_TOUCHABLE_M {
            Some("larger than 5 m: for a file in millimetres say unit = \"mm\"")
        } else if size_m < MIN_TOUCHABLE_M {
            Some("smaller than 1 mm: for a file in metres say unit = \"m\"")
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
