//! Figure of the beliefs of a surface after some touches, Figs. 5 and 7 of Yi et al. 2016.

use super::ReportFigure;
use crate::experiment::row::TouchRow;
use crate::experiment::store::Run;
use crate::report::axes::{Axis, Length, height_bar};
use crate::report::canvas::{Area, Canvas};
use crate::report::legend::{FigureLayout, miss_entry, seen_entry, stroke_entry, touch_entries};
use crate::report::relief::{
    ON_RELIEF, Relief, ReliefPanel, Space, height_colour, unreachable_colour,
};
use crate::report::replay::{self, BeliefReplay, Grid, NO_BELIEF, drawn_caption, in_paper};
use crate::report::style;
use nalgebra::{Point3, Vector3};
use palpate_explore::task::Zone;
use palpate_explore::view::SeenSurface;
use palpate_gp::posterior::Scratch;
use palpate_input::format::counted;

/// Figure of beliefs next to the true surface.
pub const FIGURE: ReportFigure = ReportFigure { name: "surfaces", caption, draw };

fn caption(run: &Run) -> String {
    let zone = run.experiment.scene.zone.as_ref();
    let stretch = zone.and_then(|zone| space(run, zone)).map_or(1.0, |space| space.stretch());
    let stretched = match stretch > 1.0 {
        true => format!(" Heights are scaled by {stretch:.1}."),
        false => String::new(),
    };
    format!(
        "Posterior mean over the zone in trial {} by number of touches, and the true object on the \
         right, with the same view, scale and colours. Blue points: the {}; red: those \
         of the planner. Mauve: out of the finger's reach.{stretched}{}{}",
        run.experiment.report.trial,
        counted(run.experiment.initial_touches, "initial touch"),
        drawn_caption(run),
        in_paper(run, "Figs. 5 and 7")
    )
}

/// Places along each side of a relief; more would not be visible at this size.
pub const PLACES: usize = 41;
const MARGIN: (f64, f64) = (24.0, 44.0);
const PANEL: (f64, f64) = (252.0, 316.0);
const FOOT_PX: f64 = 78.0;
const BAR_PX: f64 = 320.0;

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let Some(zone) = &run.experiment.scene.zone else { return Ok(None) };
    let (planners, counts) = (run.experiment.drawn_planners(), run.experiment.drawn_touch_counts());
    let Some(space) = space(run, zone) else { return Ok(None) };
    if !planners.iter().any(|planner| replay::row(run, planner).is_some()) {
        return Ok(None);
    }
    let grid = Grid::new(run, 2, PLACES)?;
    let [xs, zs] = [grid.along(0), grid.along(1)];
    let unit = Length::of(zone);
    let (width, rows) = ((counts.len() as f64 + 1.0) * PANEL.0, planners.len() as f64);
    let size = [width + 2.0 * MARGIN.0, MARGIN.1 + rows * PANEL.1 + FOOT_PX];
    let slides = run.rows.iter().flat_map(|row| &row.touches).any(TouchRow::is_stroke);
    let entries = touch_entries().into_iter().chain(miss_entry(run)).chain(seen_entry(run));
    let entries = entries.chain(slides.then(stroke_entry));
    let first = Area { left: MARGIN.0, top: MARGIN.1, width: PANEL.0, height: PANEL.1 };
    let mut sheet = FigureLayout::new(size, first, PANEL.into(), width, ON_RELIEF, entries);
    let [low, high] = space.height_m;
    let axis = Axis::linear(low, high, 5.0);
    let relief =
        |canvas: &mut Canvas, panel: &ReliefPanel, heights: Vec<Option<f64>>, reach: &[bool]| {
            let colour = |places: &[usize], corners: &[Vector3<f64>], normal: &Vector3<f64>| {
                let reached = places.iter().filter(|&&place| reach[place]).count();
                match 2 * reached >= places.len() {
                    true => height_colour(&axis, corners, normal),
                    false => unreachable_colour(&axis, corners, normal),
                }
            };
            let relief = Relief::coloured(panel, [&xs, &zs], &heights, colour);
            relief.draw(canvas);
            relief
        };
    for (row, planner) in planners.iter().enumerate() {
        for (column, &count) in counts.iter().enumerate() {
            let panel = ReliefPanel::new(unit, sheet.panel(column, row as f64, [0.0; 4]), space);
            let canvas = &mut sheet.canvas;
            let replay = BeliefReplay::new(run, planner, count)?;
            let score = replay.as_ref().map_or(NO_BELIEF.into(), BeliefReplay::score);
            panel.frame(canvas, &format!("{planner}, {}", counted(count, "touch")), &score);
            if let Some(replay) = replay {
                let mut scratch = Scratch::default();
                let drawn = replay.is_drawn(grid.places());
                let heights = grid.places().zip(drawn).map(|(place, is_drawn)| {
                    is_drawn.then(|| replay.surface.mean(place, &mut scratch))
                });
                let places: Vec<Vec<f64>> = grid.places().map(<[f64]>::to_vec).collect();
                let reach = replay.belief.is_reachable(&places);
                let relief = relief(canvas, &panel, heights.collect(), &reach);
                canvas.grouped(ON_RELIEF, |canvas| {
                    relief.dots(canvas, &panel.camera, seen(&replay, space));
                    mark(&panel, canvas, zone, &relief, replay.marks());
                });
            }
        }
    }
    if run.truth.is_known() {
        let area = sheet.panel(counts.len(), 0.5 * (rows - 1.0), [0.0; 4]);
        let panel = ReliefPanel::new(unit, area, space);
        panel.frame(&mut sheet.canvas, "true object", "");
        let heights = grid.places.iter().map(|(_, height_m)| *height_m);
        relief(&mut sheet.canvas, &panel, heights.collect(), &grid.is_reachable);
    }
    let left = MARGIN.0 + 0.5 * (width - BAR_PX);
    let bar = Area { left, top: sheet.bottom - FOOT_PX + 30.0, width: BAR_PX, height: 13.0 };
    height_bar(&mut sheet.canvas, bar, unit, space.height_m);
    Ok(Some(sheet.canvas.finish()))
}

/// Returns what a camera has seen within `space`, in its axes.
fn seen(replay: &BeliefReplay, space: Space) -> Vec<Vector3<f64>> {
    let Space { x_m, z_m, height_m } = space;
    let zone = replay.belief.zone();
    let elements = replay.belief.seen().iter().flat_map(SeenSurface::elements);
    let point = |p_w: &Point3<f64>| match zone.place(p_w)[..] {
        [x, z] => Vector3::new(x, zone.height_m(p_w), z),
        _ => Vector3::repeat(f64::NAN),
    };
    let is_in = |p: &Vector3<f64>| {
        [(x_m, p.x), (height_m, p.y), (z_m, p.z)]
            .iter()
            .all(|([low, high], at)| (*low..=*high).contains(at))
    };
    elements.map(|element| point(&element.p_w)).filter(is_in).collect()
}

/// Returns the drawn space: the zone, and heights around the truth and the drawn touches; `None`
/// for a curve.
pub fn space(run: &Run, zone: &Zone) -> Option<Space> {
    let (low, high) =
        Axis::around(replay::heights_m(run, run.experiment.drawn_planners()), 0.08, 5.0)?.range();
    Some(Space { x_m: zone.x_m, z_m: zone.z_m?, height_m: [low, high] })
}

/// Marks touches in their colours: a point for a contact, hollow if the surface hides it; a diamond
/// at the back for a miss.
pub fn mark<'a>(
    panel: &ReliefPanel,
    canvas: &mut Canvas,
    zone: &Zone,
    relief: &Relief,
    marks: impl Iterator<Item = (&'a TouchRow, &'static str)>,
) {
    let at = |p_w: &Point3<f64>| match zone.place(p_w)[..] {
        [x, z] => Vector3::new(x, zone.height_m(p_w), z),
        _ => Vector3::repeat(f64::NAN),
    };
    for (touch, colour) in marks {
        if let Some(slid_w) = touch.slid_w() {
            relief.stroke(canvas, &panel.camera, slid_w.iter().map(at), colour);
            continue;
        }
        match replay::contact(zone, touch) {
            Some((place, height)) => {
                let point = Vector3::new(place[0], height, place[1]);
                relief.mark(canvas, &panel.camera, &point, 3.1, colour);
            }
            None => {
                let target = touch.target.numbers();
                let at = Vector3::new(target[0], panel.space.height_m[0], target[1]);
                canvas.diamond(panel.camera.at(&at), &style::stroke(colour, 1.3));
            }
        }
    }
}
