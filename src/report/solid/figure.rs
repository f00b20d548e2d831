//! Figure of estimated surfaces: a row for each planner and each side, a column for each touch
//! count.

use super::panel::{View, inner, scale};
use super::section::{TRUTH_TRIANGLES, deviation_axis};
use super::{PlannerSurfaces, SurfaceFrame};
use crate::report::axes::{Axis, MM, colour_bar};
use crate::report::canvas::{Area, Canvas, PointPx};
use crate::report::legend::{FigureLayout, MISS, SEEN, stroke_entry, touch_entries};
use crate::report::relief::ON_RELIEF;
use crate::report::style;
use palpate_geometry::decimate::decimate;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::solids::Triangles;
use palpate_input::format::counted;

const PANEL: (f64, f64) = (236.0, 258.0);
const MARGIN: (f64, f64) = (20.0, 40.0);
const FOOT_PX: f64 = 56.0;
/// Smallest left edge of the colour bar, after its label, and its length.
const BAR_LEFT_MIN_PX: f64 = 380.0;
const BAR_PX: f64 = 300.0;
const WIDTH_MIN_PX: f64 = BAR_LEFT_MIN_PX + BAR_PX;
/// Radius of the mark of a touch, and of the mark of the last touch.
const RADII_PX: [f64; 2] = [3.1, 4.6];
/// Colour of a surface where its value is not known.
const UNKNOWN: [u32; 2] = [0xcdcdcd; 2];
/// Position in the colour map of the true surface, which has no values.
const PLAIN: f64 = 0.6;

/// Draws the surfaces after some touch counts as SVG, from the front and from behind, coloured by
/// their standard deviation. Touches lie on them, and the true surface is on the right. Returns
/// `None` if there is nothing to draw, or no value to colour by. All have one scale.
pub fn figure(
    sequences: &[PlannerSurfaces],
    truth: Option<&Mesh>,
    counts: &[u32],
) -> Option<String> {
    let truth = truth.map(|mesh| decimate(mesh, TRUTH_TRIANGLES));
    let frames = sequences.iter().flat_map(|sequence| &sequence.frames);
    let drawn: Vec<&SurfaceFrame> =
        frames.filter(|frame| counts.contains(&frame.touches)).collect();
    let touches = || sequences.iter().flat_map(|sequence| &sequence.touches);
    let meshes = drawn.iter().map(|frame| &frame.mesh).chain(&truth);
    let contacts = touches().filter_map(|touch| touch.contact_w.as_ref());
    let points = meshes.flat_map(|(vertices, _)| vertices).chain(contacts);
    let points: Vec<_> = points.map(|p_w| p_w.coords).collect();
    let axis = deviation_axis(drawn.iter().flat_map(|frame| &frame.sd_m), MM);
    let axis = axis.filter(|_| !points.is_empty())?;

    let columns = counts.len() + usize::from(truth.is_some());
    let width = (columns as f64 * PANEL.0).max(WIDTH_MIN_PX);
    let is_missed = touches().any(|touch| touch.contact_w.is_none());
    let is_seen = drawn.iter().any(|frame| !frame.seen_w.is_empty());
    let entries = touch_entries().into_iter().chain(is_missed.then_some(MISS));
    let slides = drawn.iter().any(|frame| !frame.slid_w.is_empty());
    let entries = entries.chain(is_seen.then_some(SEEN)).chain(slides.then(stroke_entry));
    let rows = sequences.iter().flat_map(|it| [false, true].map(|is_behind| (it, is_behind)));
    let size = [width + 2.0 * MARGIN.0, MARGIN.1 + rows.clone().count() as f64 * PANEL.1 + FOOT_PX];
    let first = Area { left: MARGIN.0, top: MARGIN.1, width: PANEL.0, height: PANEL.1 };
    let mut sheet = FigureLayout::new(size, first, PANEL.into(), width, ON_RELIEF, entries);
    let px_per_m = scale(&points, first);
    for (row, (sequence, is_behind)) in rows.enumerate() {
        let area = |column: usize| sheet.area(column, row as f64);
        let views = (0..columns).map(|it| View::new(area(it), is_behind, px_per_m, &points));
        let views: Vec<View> = views.collect();
        for (view, &count) in views.iter().zip(counts) {
            belief(view, &mut sheet.canvas, sequence, count, &axis);
        }
        if let (Some(truth), Some(view)) = (&truth, views.last()) {
            view.title(&mut sheet.canvas, "true object", "");
            view.relief(&mut sheet.canvas, truth, |_, light| style::height(PLAIN, light));
        }
    }
    let top = sheet.bottom - FOOT_PX + 14.0;
    View::draw_scale(&mut sheet.canvas, px_per_m, [MARGIN.0, top]);
    let left = (0.5 * width).max(BAR_LEFT_MIN_PX) + MARGIN.0;
    let bar = Area { left, top, width: BAR_PX, height: 13.0 };
    colour_bar(&mut sheet.canvas, bar, &axis, "standard deviation σ (mm)", style::deviation);
    Some(sheet.canvas.finish())
}

/// Panels of a film: the estimated surface from the front and from behind, and the true object.
pub struct FilmPanels<'a> {
    sequence: &'a PlannerSurfaces,
    views: Vec<View>,
    truth: Option<Triangles>,
    px_per_m: f64,
    axis: Axis,
}

impl<'a> FilmPanels<'a> {
    /// Creates the panels in the first of `areas`, three of one size; all frames have one scale and
    /// the same colours. Returns `None` if there is nothing to draw.
    pub fn new(
        sequence: &'a PlannerSurfaces,
        truth: Option<&Mesh>,
        areas: [Area; 3],
    ) -> Option<Self> {
        let truth = truth.map(|mesh| decimate(mesh, TRUTH_TRIANGLES));
        let meshes = sequence.frames.iter().map(|frame| &frame.mesh).chain(&truth);
        let contacts = sequence.touches.iter().filter_map(|touch| touch.contact_w.as_ref());
        let points = meshes.flat_map(|(vertices, _)| vertices).chain(contacts);
        let points: Vec<_> = points.map(|p_w| p_w.coords).collect();
        let axis = deviation_axis(sequence.frames.iter().flat_map(|frame| &frame.sd_m), MM)?;
        let px_per_m = scale(&points, areas[0]);
        let sides = areas.into_iter().zip([false, true, false]);
        let views = sides.map(|(area, is_behind)| View::new(area, is_behind, px_per_m, &points));
        Some(Self { sequence, views: views.collect(), truth, px_per_m, axis })
    }

    /// Axis of the colours, in millimetres.
    pub fn axis(&self) -> &Axis {
        &self.axis
    }

    /// Draws one of the frames, and a scale bar at `scale_at`.
    pub fn draw(&self, canvas: &mut Canvas, frame: &SurfaceFrame, scale_at: PointPx) {
        let [front, behind, true_view] = &self.views[..] else { return };
        for view in [front, behind] {
            view.title(canvas, "belief", "");
            draw_frame(view, canvas, self.sequence, frame, &self.axis);
        }
        if let Some(truth) = &self.truth {
            true_view.title(canvas, "true object", "");
            true_view.relief(canvas, truth, |_, light| style::height(PLAIN, light));
        }
        View::draw_scale(canvas, self.px_per_m, scale_at);
    }
}

fn belief(view: &View, canvas: &mut Canvas, sequence: &PlannerSurfaces, count: u32, axis: &Axis) {
    let title = format!("{}, {}", sequence.planner, counted(count, "touch"));
    let Some(frame) = sequence.frames.iter().find(|frame| frame.touches == count) else {
        return view.title(canvas, &title, "no belief at this count");
    };
    view.title(canvas, &title, &frame.score);
    draw_frame(view, canvas, sequence, frame, axis);
}

/// Draws a surface, coloured by its standard deviation along `axis`, and its touches.
fn draw_frame(
    view: &View,
    canvas: &mut Canvas,
    sequence: &PlannerSurfaces,
    frame: &SurfaceFrame,
    axis: &Axis,
) {
    let count = frame.touches as usize;
    // Colour of a triangle by the mean of its corners.
    let colour = |triangle: usize, light: f64| {
        let shares = frame.mesh.1[triangle].map(|vertex| {
            let sd_m = frame.sd_m.get(vertex as usize).copied().unwrap_or(f64::NAN);
            axis.fraction(sd_m * MM.per_m).clamp(0.0, 1.0)
        });
        match shares.iter().sum::<f64>() / 3.0 {
            share if share.is_finite() => style::shaded_colour(&style::DEVIATION, share, light),
            _ => style::shaded_colour(&UNKNOWN, 0.0, light),
        }
    };
    let relief = view.relief(canvas, &frame.mesh, colour);
    canvas.grouped(ON_RELIEF, |canvas| {
        relief.dots(canvas, &view.camera, frame.seen_w.iter().map(|p_w| p_w.coords));
        for slid_w in &frame.slid_w {
            relief.stroke(canvas, &view.camera, slid_w.iter().map(|p_w| p_w.coords));
        }
        for (i, touch) in sequence.touches.iter().take(count).enumerate() {
            let colour = style::touch(touch.is_initial);
            let p_w = touch.contact_w.unwrap_or(touch.aim_w).coords;
            let at = view.camera.at(&p_w);
            // The target of a missed touch may lie outside of the drawing.
            if touch.contact_w.is_some() {
                let radius = RADII_PX[usize::from(i + 1 == count)];
                relief.mark(canvas, &view.camera, &p_w, radius, colour);
            } else if inner(view.area).contains(at) {
                canvas.diamond(at, &style::stroke(colour, 1.3));
            }
        }
    });
}
