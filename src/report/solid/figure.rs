//! The same surfaces as a figure: a row of touch counts for each planner and each side.

use super::data::{deviation_range, error_range};
use super::panel::{ON_SURFACE, Side, View, draw_scale, inner};
use super::section::TRUTH_TRIANGLES;
use super::{Frame, Sequence, Touch};
use crate::geometry::coarse::coarse;
use crate::geometry::mesh::Mesh;
use crate::geometry::solids::Triangles;
use crate::report::axes::{Axis, MM, colour_bar};
use crate::report::canvas::{Area, Canvas};
use crate::report::legend::{Legend, Swatch};
use crate::report::relief::Relief;
use crate::report::style::{self, INITIAL, LATER};
use nalgebra::Vector3;

/// What a surface is coloured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// Its standard deviation.
    Deviation,
    /// Its distance from the true surface.
    Error,
}

const PANEL: (f64, f64) = (236.0, 258.0);
const MARGIN: (f64, f64) = (20.0, 40.0);
const FOOT_PX: f64 = 56.0;
/// The bar of colours: where it begins at least, behind its words, and its length.
const BAR_LEFT_MIN_PX: f64 = 380.0;
const BAR_PX: f64 = 300.0;
const WIDTH_MIN_PX: f64 = BAR_LEFT_MIN_PX + BAR_PX;
/// A touch, and the last one.
const RADII_PX: [f64; 2] = [3.1, 4.6];
/// The colour of a surface where its number is not known.
const UNKNOWN: [[f64; 3]; 2] = [[205.0; 3]; 2];

/// Surfaces after some touch counts, with the touches on them and the true one on the right, as
/// SVG; none if there is nothing to be drawn, or no number to colour it by. Everything is of one
/// scale.
///
/// # Errors
/// If a sequence does not fit together.
pub fn figure(
    sequences: &[Sequence],
    truth: Option<&Mesh>,
    counts: &[u32],
    sides: &[Side],
    colour: Colour,
) -> anyhow::Result<Option<String>> {
    sequences.iter().try_for_each(Sequence::check)?;
    let truth = truth.map(|mesh| coarse(mesh, TRUTH_TRIANGLES));
    let is_drawn = |frame: &&Frame| counts.contains(&frame.touches);
    let drawn: Vec<&Frame> =
        sequences.iter().flat_map(|sequence| &sequence.frames).filter(is_drawn).collect();
    let meshes = drawn.iter().map(|frame| &frame.mesh).chain(&truth);
    let contacts =
        sequences.iter().flat_map(|it| &it.touches).filter_map(|touch| touch.contact_w.as_ref());
    let points = meshes.flat_map(|(vertices, _)| vertices).chain(contacts);
    let points: Vec<_> = points.map(|p_w| p_w.coords).collect();
    if points.is_empty() || sides.is_empty() {
        return Ok(None);
    }
    let Some(tint) = Tint::new(colour, &drawn) else { return Ok(None) };
    Ok(Some(draw(sequences, truth.as_ref(), counts, sides, (&points, &tint))))
}

/// What colours a surface.
struct Tint {
    colour: Colour,
    /// In millimetres.
    axis: Axis,
}

impl Tint {
    fn new(colour: Colour, frames: &[&Frame]) -> Option<Self> {
        let of = |values: fn(&Frame) -> &Vec<f64>| frames.iter().flat_map(move |it| values(it));
        let axis = match colour {
            Colour::Deviation => {
                let ends_m = deviation_range(of(|frame| &frame.sd_m))?;
                Axis::log(ends_m.map(|end_m| end_m * MM.per_m))?
            }
            Colour::Error => {
                let [_, most_m] = error_range(of(|frame| &frame.error_m))?;
                Axis::fine(most_m * MM.per_m)
            }
        };
        Some(Self { colour, axis })
    }

    fn map(&self) -> &'static [[f64; 3]] {
        match self.colour {
            Colour::Deviation => &style::DEVIATION,
            Colour::Error => &style::ERROR,
        }
    }

    fn words(&self) -> &'static str {
        match self.colour {
            Colour::Deviation => "standard deviation σ (mm)",
            Colour::Error => "error: inside the true surface | outside (mm)",
        }
    }

    /// The colour of a triangle by the mean of its corners.
    fn of(&self, frame: &Frame, corners: [u32; 3], light: f64) -> String {
        let values_m = match self.colour {
            Colour::Deviation => &frame.sd_m,
            Colour::Error => &frame.error_m,
        };
        let shares = corners.map(|vertex| {
            let value_m = values_m.get(vertex as usize).copied().unwrap_or(f64::NAN);
            self.axis.fraction(value_m * MM.per_m).clamp(0.0, 1.0)
        });
        match shares.iter().sum::<f64>() / 3.0 {
            share if share.is_finite() => style::lit(self.map(), share, light),
            _ => style::lit(&UNKNOWN, 0.0, light),
        }
    }
}

fn draw(
    sequences: &[Sequence],
    truth: Option<&Triangles>,
    counts: &[u32],
    sides: &[Side],
    (points, tint): (&[Vector3<f64>], &Tint),
) -> String {
    let columns = counts.len() + usize::from(truth.is_some());
    let width = (columns as f64 * PANEL.0).max(WIDTH_MIN_PX);
    let is_missed = sequences.iter().flat_map(|it| &it.touches).any(|it| it.contact_w.is_none());
    let miss = (Swatch::Diamond(LATER), "touch that met nothing");
    let legend = Legend::new(width, entries().into_iter().chain(is_missed.then_some(miss)));
    let top = MARGIN.1 + legend.more_px();
    let height = top + (sequences.len() * sides.len()) as f64 * PANEL.1 + FOOT_PX;
    let mut canvas = Canvas::new(width + 2.0 * MARGIN.0, height);
    canvas.grouped(ON_SURFACE, |canvas| legend.draw(canvas, [MARGIN.0, 20.0]));
    let points = || points.iter().copied();
    let room = inner(Area { left: 0.0, top: 0.0, width: PANEL.0, height: PANEL.1 });
    let scales = sides.iter().map(|side| side.camera().scale(points(), room));
    let px_per_m = scales.fold(f64::MAX, f64::min);
    let rows = sequences.iter().flat_map(|it| sides.iter().map(move |side| (it, *side)));
    for (row, (sequence, side)) in rows.enumerate() {
        for column in 0..columns {
            let area = Area {
                left: MARGIN.0 + column as f64 * PANEL.0,
                top: top + row as f64 * PANEL.1,
                width: PANEL.0,
                height: PANEL.1,
            };
            let camera = side.camera();
            let camera = camera.scaled(px_per_m, points(), inner(area));
            let view = View { area, side, camera };
            match (counts.get(column), truth) {
                (Some(&count), _) => view.belief(&mut canvas, sequence, count, tint),
                (None, Some(truth)) => view.truth(&mut canvas, truth),
                (None, None) => {}
            }
        }
    }
    let foot = height - FOOT_PX + 14.0;
    draw_scale(&mut canvas, px_per_m, [MARGIN.0, foot]);
    let bar = Area {
        left: (0.5 * width).max(BAR_LEFT_MIN_PX) + MARGIN.0,
        top: foot,
        width: BAR_PX,
        height: 13.0,
    };
    let colour = |share| style::lit(tint.map(), share, 1.0);
    colour_bar(&mut canvas, bar, &tint.axis, tint.words(), colour);
    canvas.finish()
}

impl View {
    fn belief(&self, canvas: &mut Canvas, sequence: &Sequence, count: u32, tint: &Tint) {
        let title = format!("{}, {count} touches", sequence.planner);
        let Some(frame) = sequence.frames.iter().find(|frame| frame.touches == count) else {
            return self.title(canvas, &title, "no belief after so many");
        };
        self.title(canvas, &title, &frame.score);
        let relief = self.relief(&frame.mesh, |i, light| tint.of(frame, frame.mesh.1[i], light));
        relief.draw(canvas);
        let touches = sequence.touches(frame);
        canvas.grouped(ON_SURFACE, |canvas| {
            for (i, touch) in touches.iter().enumerate() {
                self.mark(canvas, touch, &relief, i + 1 == touches.len());
            }
        });
    }

    /// A touch: a point where it met the object, hollow if that is hidden; a diamond where it was
    /// sent if it met nothing, which may be beside all that is drawn.
    fn mark(&self, canvas: &mut Canvas, touch: &Touch, relief: &Relief, is_last: bool) {
        let colour = if touch.is_initial { INITIAL } else { LATER };
        let Some(p_w) = touch.contact_w else {
            let at = self.camera.at(&touch.aim_w.coords);
            if inner(self.area).contains(at) {
                canvas.diamond(at, &style::stroke(colour, 1.3));
            }
            return;
        };
        let at = self.camera.at(&p_w.coords);
        let attributes = match relief.hides(at, self.camera.nearness(&p_w.coords)) {
            true => style::hidden(colour),
            false => style::visible(colour),
        };
        canvas.circle(at, RADII_PX[usize::from(is_last)], &attributes);
    }
}

fn entries() -> [(Swatch, &'static str); 3] {
    [
        (Swatch::Circle(style::visible(INITIAL)), "initial touch"),
        (Swatch::Circle(style::visible(LATER)), "later touch"),
        (Swatch::Circle(style::hidden(LATER)), "behind the surface"),
    ]
}
