//! View of a solid in a drawing: from the front or from behind, lit from the viewer.

use crate::report::axes::{Axis, MM};
use crate::report::canvas::{Anchor, Area, Canvas, PointPx};
use crate::report::relief::{self, Camera, Relief, SHADING, brightness};
use crate::report::style::{self, INK, SMALL_PX};
use nalgebra::Vector3;
use palpate_geometry::solids::{Triangles, normals};

/// Height of the title above a surface, and margin on every side of it.
const TITLE_PX: f64 = 38.0;
const GAP_PX: f64 = 8.0;
/// Largest length of the scale bar.
const SCALE_PX: f64 = 60.0;

/// Returns the camera in front, on the side that a finger touches along −y, or behind.
fn camera(is_behind: bool) -> Camera {
    Camera::from_azimuth(SHADING.azimuth_deg + if is_behind { 180.0 } else { 0.0 }, 1.0)
}

/// Returns the scale, in pixels per metre, at which `points` fit into a panel from both sides.
pub(super) fn scale(points: &[Vector3<f64>], panel: Area) -> f64 {
    let scales = [false, true].map(|is_behind| camera(is_behind).scale(points, inner(panel)));
    scales[0].min(scales[1])
}

/// Returns the part of a panel in which its surface is drawn.
pub(super) fn inner(area: Area) -> Area {
    Area {
        left: area.left + GAP_PX,
        top: area.top + TITLE_PX,
        width: area.width - 2.0 * GAP_PX,
        height: area.height - TITLE_PX - GAP_PX,
    }
}

/// Panel with its camera.
pub(super) struct View {
    pub(super) area: Area,
    is_behind: bool,
    pub(super) camera: Camera,
}

impl View {
    /// Creates a panel with `points` in the middle.
    pub(super) fn new(area: Area, is_behind: bool, px_per_m: f64, points: &[Vector3<f64>]) -> Self {
        let camera = camera(is_behind).scaled(px_per_m, points, inner(area));
        Self { area, is_behind, camera }
    }

    pub(super) fn title(&self, canvas: &mut Canvas, words: &str, score: &str) {
        let behind = if self.is_behind { ", from behind" } else { "" };
        relief::title(canvas, self.area, &format!("{words}{behind}"), score);
    }

    /// Draws the triangles that face the viewer, with the colour for their index and their
    /// brightness.
    pub(super) fn relief(
        &self,
        canvas: &mut Canvas,
        (vertices, triangles): &Triangles,
        colour: impl Fn(usize, f64) -> String,
    ) -> Relief {
        let outward = normals(vertices, triangles);
        // The light moves with the viewer.
        let lit = |normal: Vector3<f64>| match self.is_behind {
            true => Vector3::new(-normal.x, -normal.y, normal.z),
            false => normal,
        };
        let corners = triangles.iter().map(|it| it.map(|vertex| vertices[vertex as usize].coords));
        let relief = Relief::of_triangles(&self.camera, corners, |triangle, _, normal| {
            let corners = triangles[triangle].iter();
            let smooth: Vector3<f64> = corners.map(|&vertex| outward[vertex as usize]).sum();
            let normal = lit(smooth.try_normalize(0.0).unwrap_or(normal));
            colour(triangle, brightness(&normal))
        });
        relief.draw(canvas);
        relief
    }

    /// Draws a scale bar of a round number of millimetres.
    pub(super) fn draw_scale(canvas: &mut Canvas, px_per_m: f64, [left, top]: PointPx) {
        let most_mm = SCALE_PX / px_per_m * MM.per_m;
        let ticks = Axis::linear(0.0, most_mm, 3.0).ticks();
        let Some((length_mm, label)) = ticks.into_iter().rev().find(|(mm, _)| *mm > 0.0) else {
            return;
        };
        let right = left + length_mm / MM.per_m * px_per_m;
        let ends = [[left, top + 2.0], [left, top + 8.0], [right, top + 8.0], [right, top + 2.0]];
        canvas.line(ends, &style::stroke(INK, 1.2));
        canvas.text([left, top + 24.0], &format!("{label} mm"), SMALL_PX, Anchor::Start);
    }
}
