//! Figure of estimated surfaces: a row for each planner and each side, a column for each touch
//! count.

use super::panel::{View, inner, scale};
use super::section::{TRUTH_TRIANGLES, deviation_axis};
use super::{PlannerSurfaces, SurfaceFrame};
use crate::report::axes::{Axis, MM, colour_bar};
use crate::report::canvas::{Area, Canvas, PartKind, PointPx};
use crate::report::legend::{FigureLayout, MISS, SEEN, Swatch, stroke_entry, touch_entries};
use crate::report::relief::ON_RELIEF;
use crate::report::style::{self, TRUTH};
use palpate_geometry::decimate::decimate;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::solids::Triangles;
use palpate_input::format::counted;

const PANEL: (f64, f64) = (236.0, 258.0);
/// Width of a letter of a title, and of the rest of a title beside the planner's name.
const TITLE_PX: [f64; 2] = [7.2, 215.0];
const MARGIN: (f64, f64) = (20.0, 40.0);
const FOOT_PX: f64 = 72.0;
/// Width for the scale bar, and length of the colour bar.
const SCALE_PX: f64 = 110.0;
const BAR_PX: f64 = 300.0;
const WIDTH_MIN_PX: f64 = BAR_PX + 2.0 * SCALE_PX;
/// Radius of the mark of a touch, and of the mark of the last touch.
const RADII_PX: [f64; 2] = [3.1, 4.6];
/// Colour of a surface where its value is not known.
const UNKNOWN: [u32; 2] = [0xcdcdcd; 2];
/// Position in the colour map of the true surface, which has no values.
const PLAIN: f64 = 0.6;
/// Colour of the true object under a recognised one, and attributes of the latter.
const GREEN: [u32; 2] = [0x009e73; 2];
const OVER: &str = r#"opacity=".6""#;

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
    let has_objects = sequences.iter().any(PlannerSurfaces::has_objects);
    if points.is_empty() || axis.is_none() && !has_objects {
        return None;
    }

    let columns = counts.len() + usize::from(truth.is_some());
    let letters = sequences.iter().map(|sequence| sequence.planner.chars().count());
    let title_px = TITLE_PX[0] * letters.max().unwrap_or(0) as f64 + TITLE_PX[1];
    let panel_px = PANEL.0.max(title_px);
    let width = (columns as f64 * panel_px).max(WIDTH_MIN_PX);
    let is_missed = touches().any(|touch| touch.contact_w.is_none());
    let is_seen = drawn.iter().any(|frame| !frame.seen_w.is_empty());
    let entries = touch_entries().into_iter().chain(is_missed.then_some(MISS));
    let slides = touches().any(|touch| !touch.path_w.is_empty());
    let entries = entries.chain(is_seen.then_some(SEEN)).chain(slides.then(stroke_entry));
    let green = (has_objects && truth.is_some()).then_some((Swatch::Box(TRUTH), "true object"));
    let entries = entries.chain(green);
    let rows = sequences.iter().flat_map(|it| [false, true].map(|is_behind| (it, is_behind)));
    let size = [width + 2.0 * MARGIN.0, MARGIN.1 + rows.clone().count() as f64 * PANEL.1 + FOOT_PX];
    let first = Area { left: MARGIN.0, top: MARGIN.1, width: panel_px, height: PANEL.1 };
    let step = [panel_px, PANEL.1];
    let mut sheet = FigureLayout::new(size, first, step, width, ON_RELIEF, entries);
    let px_per_m = scale(&points, first);
    for (row, (sequence, is_behind)) in rows.enumerate() {
        let view = |column: usize, sheet: &mut FigureLayout| {
            let area = sheet.panel(column, row as f64, [0.0; 4]);
            View::new(area, is_behind, px_per_m, &points)
        };
        for (column, &count) in counts.iter().enumerate() {
            let view = view(column, &mut sheet);
            belief(&view, &mut sheet.canvas, sequence, count, axis.as_ref(), truth.as_ref());
        }
        if let Some(truth) = &truth {
            let view = view(counts.len(), &mut sheet);
            view.title(&mut sheet.canvas, "true object", "");
            view.relief(&mut sheet.canvas, truth, |_, light| style::height(PLAIN, light));
        }
    }
    let top = sheet.bottom - FOOT_PX + 30.0;
    let part = Area { left: 0.0, top: top - 6.0, width: SCALE_PX, height: 36.0 };
    sheet.canvas.part(PartKind::Key, part);
    View::draw_scale(&mut sheet.canvas, px_per_m, [MARGIN.0, top]);
    if let Some(axis) = axis {
        let left = MARGIN.0 + 0.5 * (width - BAR_PX);
        let bar = Area { left, top, width: BAR_PX, height: 13.0 };
        colour_bar(&mut sheet.canvas, bar, &axis, "standard deviation σ (mm)", style::deviation);
    }
    Some(sheet.canvas.finish())
}

/// Panels of a film: the estimated surface from the front and from behind, and the true object.
pub struct FilmPanels<'a> {
    sequence: &'a PlannerSurfaces,
    views: Vec<View>,
    truth: Option<Triangles>,
    px_per_m: f64,
    axis: Option<Axis>,
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
        let axis = deviation_axis(sequence.frames.iter().flat_map(|frame| &frame.sd_m), MM);
        if axis.is_none() && !sequence.has_objects() {
            return None;
        }
        let px_per_m = scale(&points, areas[0]);
        let sides = areas.into_iter().zip([false, true, false]);
        let views = sides.map(|(area, is_behind)| View::new(area, is_behind, px_per_m, &points));
        Some(Self { sequence, views: views.collect(), truth, px_per_m, axis })
    }

    /// Axis of the colours, in millimetres; `None` for recognised objects.
    pub fn axis(&self) -> Option<&Axis> {
        self.axis.as_ref()
    }

    /// Draws one of the frames, and a scale bar at `scale_at`.
    pub fn draw(&self, canvas: &mut Canvas, frame: &SurfaceFrame, scale_at: PointPx) {
        let [front, behind, true_view] = &self.views[..] else { return };
        for view in [front, behind] {
            view.title(canvas, "belief", "");
            let truth = self.truth.as_ref();
            draw_frame(view, canvas, self.sequence, frame, self.axis.as_ref(), truth);
        }
        if let Some(truth) = &self.truth {
            true_view.title(canvas, "true object", "");
            true_view.relief(canvas, truth, |_, light| style::height(PLAIN, light));
        }
        View::draw_scale(canvas, self.px_per_m, scale_at);
    }
}

fn belief(
    view: &View,
    canvas: &mut Canvas,
    sequence: &PlannerSurfaces,
    count: u32,
    axis: Option<&Axis>,
    truth: Option<&Triangles>,
) {
    let title = format!("{}, {}", sequence.planner, counted(count, "touch"));
    let Some(frame) = sequence.frames.iter().find(|frame| frame.touches == count) else {
        return view.title(canvas, &title, "no belief at this count");
    };
    view.title(canvas, &title, &frame.score);
    draw_frame(view, canvas, sequence, frame, axis, truth);
}

/// Draws a surface, coloured by its standard deviation along `axis`, or a recognised object over
/// the true one, and its touches.
fn draw_frame(
    view: &View,
    canvas: &mut Canvas,
    sequence: &PlannerSurfaces,
    frame: &SurfaceFrame,
    axis: Option<&Axis>,
    truth: Option<&Triangles>,
) {
    let count = frame.touches as usize;
    // Colour of a triangle by the mean of its corners.
    let colour = |triangle: usize, light: f64| {
        let shares = frame.mesh.1[triangle].map(|vertex| {
            let sd_m = frame.sd_m.get(vertex as usize).copied().unwrap_or(f64::NAN);
            axis.map_or(f64::NAN, |axis| axis.fraction(sd_m * MM.per_m).clamp(0.0, 1.0))
        });
        match shares.iter().sum::<f64>() / 3.0 {
            share if share.is_finite() => style::shaded_colour(&style::DEVIATION, share, light),
            _ => style::shaded_colour(&UNKNOWN, 0.0, light),
        }
    };
    let relief = match frame.hypotheses.is_empty() {
        true => view.relief(canvas, &frame.mesh, colour),
        false => {
            if let Some(truth) = truth {
                view.relief(canvas, truth, |_, light| style::shaded_colour(&GREEN, 0.0, light));
            }
            let (mut relief, plain) = (None, |_, light| style::height(PLAIN, light));
            canvas.grouped(OVER, |canvas| {
                relief = Some(view.relief(canvas, &frame.mesh, plain));
            });
            relief.unwrap_or_default()
        }
    };
    canvas.grouped(ON_RELIEF, |canvas| {
        relief.dots(canvas, &view.camera, frame.seen_w.iter().map(|p_w| p_w.coords));
        for (i, touch) in sequence.touches.iter().take(count).enumerate() {
            let colour = style::touch(touch.is_initial);
            if !touch.path_w.is_empty() {
                let points = touch.path_w.iter().map(|p_w| p_w.coords);
                relief.stroke(canvas, &view.camera, points, colour);
                continue;
            }
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
