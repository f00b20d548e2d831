//! Beliefs of whole objects, as closed surfaces: to turn on the page, as a figure, as files.
//!
//! A surface is a list of triangles with values at their vertices, in `W` and metres.

mod figure;
mod panel;
mod reach;
mod section;

pub use figure::{FilmPanels, figure};
pub use reach::picture;
pub use section::{COLOURS, OBJECT_COLOURS, SCRIPTS, counts, data, deviation_axis, section};

use crate::report::points::PointCloud;
use crate::report::style;
use nalgebra::{Point3, Vector3};
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::solids::{Triangles, normals};

/// Touches of a planner with its beliefs after some of them.
#[derive(Clone, Debug, Default)]
pub struct PlannerSurfaces {
    /// Name of the planner.
    pub planner: String,
    /// Touches, in order.
    pub touches: Vec<SolidTouch>,
    /// Estimated surfaces, by increasing touch count.
    pub frames: Vec<SurfaceFrame>,
}

impl PlannerSurfaces {
    /// Returns whether the surfaces are recognised objects.
    pub fn has_objects(&self) -> bool {
        self.frames.iter().any(|frame| !frame.hypotheses.is_empty())
    }
}

/// Touch of a whole object.
#[derive(Clone, Debug)]
pub struct SolidTouch {
    /// Target point.
    pub aim_w: Point3<f64>,
    /// Unit vector of the finger's motion.
    pub along_w: Vector3<f64>,
    /// Contact point; `None` for a miss or an aborted touch.
    pub contact_w: Option<Point3<f64>>,
    /// Points along a stroke, from its begin to its end; empty for a tap.
    pub path_w: Vec<Point3<f64>>,
    /// Whether it is one of the initial touches, which all planners share.
    pub is_initial: bool,
}

/// Estimated surface.
#[derive(Clone, Debug, Default)]
pub struct SurfaceFrame {
    /// Number of touches.
    pub touches: u32,
    /// Vertices in `W`, in metres, and triangles of them, counter-clockwise seen from outside;
    /// empty if there is no surface.
    pub mesh: Triangles,
    /// Standard deviation of the surface along its normal at each vertex, in metres; unknown if not
    /// finite.
    pub sd_m: Vec<f64>,
    /// Signed distance of each vertex from the true surface in metres, negative inside the true
    /// object; empty if the truth is not known.
    pub error_m: Vec<f64>,
    /// Agreement with the truth, as text; may be empty.
    pub score: String,
    /// Points that cameras have seen, in `W`.
    pub seen_w: Vec<Point3<f64>>,
    /// Hypotheses about the object with their probabilities, the likeliest first. If there are any,
    /// the mesh is a recognised object, without standard deviations.
    pub hypotheses: Vec<(String, f64)>,
}

impl SurfaceFrame {
    /// Returns the vertices with their normals, σ and errors, coloured by σ from 0 to the largest,
    /// and the triangles; `comments` describe the file.
    pub fn points(&self, comments: Vec<String>) -> PointCloud {
        let (vertices, triangles) = &self.mesh;
        let finite = self.sd_m.iter().copied().filter(|sd_m| sd_m.is_finite());
        let largest_m = finite.fold(f64::MIN_POSITIVE, f64::max);
        // An unknown standard deviation is shown as the largest.
        let share = |sd_m: f64| if sd_m.is_finite() { sd_m / largest_m } else { 1.0 };
        let deviations = self.sd_m.iter().map(|&sd_m| (sd_m, style::deviation_rgb(share(sd_m))));
        PointCloud {
            comments,
            points: vertices.iter().copied().zip(normals(vertices, triangles)).collect(),
            deviations: deviations.collect(),
            errors_m: self.error_m.clone(),
            triangles: triangles.iter().map(|corners| corners.map(|i| i as usize)).collect(),
        }
    }
}

/// Returns the distance of a point from a closed surface, m, negative inside.
pub fn error_m(bvh: &MeshBvh, p_w: &Point3<f64>) -> f64 {
    let distance_m = bvh.closest_point(p_w).distance_m;
    if bvh.is_enclosed(p_w) { -distance_m } else { distance_m }
}
