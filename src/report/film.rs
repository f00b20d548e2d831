//! Film of a trial: a drawing of the belief after each of some touch counts, with the touches, the
//! uncertainty, and the error against the truth.

use super::axes::{Axis, Length, MM, Panel, colour_bar};
use super::canvas::{Anchor, Area, Canvas};
use super::explorer::zone::HeightFrame;
use super::figures::{curves, surfaces};
use super::legend::{FigureLayout, MISS, Swatch, touch_entries};
use super::relief::{ON_RELIEF, Relief, ReliefPanel, brightness};
use super::replay::{self, BeliefReplay, Grid};
use super::solid::{FilmPanels, SurfaceFrame, deviation_axis};
use super::style::{self, FAINT_INK, FRAME, SMALL_PX, TEXT_PX};
use super::table::digits;
use super::whole_object;
use crate::experiment::measure::Measure;
use crate::experiment::row::TrialRow;
use crate::experiment::store::Run;
use crate::study::export::{median_index, ranked};
use anyhow::Context;
use palpate_explore::task::Zone;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

/// Largest number of frames.
// heuristic: a GIF stays a few megabytes.
const FRAMES_MAX: usize = 60;

/// Size of a panel of a surface, of a whole object, and of a curve.
const SURFACE_PX: [f64; 2] = [270.0, 300.0];
const SOLID_PX: [f64; 2] = [236.0, 258.0];
const CURVE_PX: [f64; 2] = [520.0, 300.0];
const MARGIN_PX: f64 = 24.0;
/// Height of the legend's first row, and of the two lines of the title below the legend.
const LEGEND_PX: f64 = 34.0;
const HEAD_PX: f64 = 50.0;
const HEADLINE_PX: f64 = 18.0;
/// Left margin of a panel with an axis of numbers.
const NUMBERS_PX: f64 = 46.0;
/// Height of the curve of errors with the space around it, and of the curve.
const ERROR_PX: [f64; 2] = [152.0, 84.0];
/// Height of the colour bar with its scale, and its length.
const BAR_PX: [f64; 2] = [50.0, 260.0];
/// Width that the colour bar and its label need.
const WIDTH_MIN_PX: f64 = 460.0;

/// Describes the place of a trial among the trials of its planner by final error.
pub fn rank_words(run: &Run, planner: &str, trial: u32) -> String {
    let ranked = ranked(run, planner);
    let (count, error) = (ranked.len(), run.experiment.error_measure().title);
    match ranked.iter().position(|(row, _)| row.trial == trial) {
        Some(place) if place == median_index(count) => {
            format!("trial {trial}, the median of {count} by final {error}")
        }
        Some(place) => format!("trial {trial}, number {} of {count} by final {error}", place + 1),
        None => format!("trial {trial}"),
    }
}

/// Returns the touch counts of the frames of `row` up to `last`: those with a fit whose error was
/// computed, as many as allowed, the first and the last included.
pub fn counts(run: &Run, row: &TrialRow, last: u32) -> Vec<u32> {
    let experiment = &run.experiment;
    let is_drawn = |&count: &u32| {
        let touch = (count as usize).checked_sub(1).and_then(|index| row.touches.get(index));
        let is_fitted = touch.is_some_and(|touch| touch.fit.is_some());
        is_fitted && (count == last || experiment.is_evaluated(count))
    };
    let all: Vec<u32> = (experiment.first_fit()..=last).filter(is_drawn).collect();
    let step = all.len().saturating_sub(1).div_ceil(FRAMES_MAX - 1).max(1);
    let mut counts: Vec<u32> = all.iter().rev().step_by(step).copied().collect();
    if counts.last() != all.first() {
        counts.extend(all.first());
    }
    counts.reverse();
    counts
}

/// Draws the frames of `planner` in the drawn trial, after each of `counts` touches, as SVG.
///
/// # Errors
/// If the trial is missing, or its touches cannot be conditioned on.
pub fn drawings(run: &Run, planner: &str, counts: &[u32]) -> anyhow::Result<Vec<String>> {
    let row = replay::row(run, planner).with_context(|| format!("no trial of {planner}"))?;
    let drawings = match &run.experiment.scene.zone {
        None => solids(run, row, counts),
        Some(zone) if zone.dimension() == 1 => self::curves(run, row, zone, counts),
        Some(zone) => reliefs(run, row, zone, counts),
    };
    drawings?.with_context(|| format!("{planner} has no belief to draw"))
}

/// Drawings; `None` if there is nothing to draw.
type Drawings = anyhow::Result<Option<Vec<String>>>;

fn curves(run: &Run, row: &TrialRow, zone: &Zone, counts: &[u32]) -> Drawings {
    let unit = Length::of(zone);
    let Some(heights) = curves::height_axis(run, unit) else { return Ok(None) };
    let inner =
        Area { left: 0.0, top: 0.0, width: CURVE_PX[0] - NUMBERS_PX, height: CURVE_PX[1] - 60.0 };
    let panel = curves::belief_panel(zone, heights, inner, inner.height);
    let sheet = FilmLayout::new(run, row, counts, [CURVE_PX[0], panel.area.height + 60.0], 1);
    let colour = style::planner(&run.experiment.planners, &row.planner);
    let draw = |&count: &u32| -> anyhow::Result<Option<String>> {
        let replay = BeliefReplay::of(&run.experiment, row, count)?;
        Ok(replay.map(|replay| {
            sheet.draw(count, curves::entries(run, []), None, |canvas, area| {
                let [left, top] = [area.left + NUMBERS_PX, area.top + 14.0];
                let panel = Panel { area: Area { left, top, ..panel.area }, ..panel.clone() };
                panel.frame(canvas);
                panel.name_axes(canvas, &unit.named("x"), &unit.named("height"));
                curves::draw_belief(canvas, &panel, run, &replay, colour);
            })
        }))
    };
    counts.par_iter().map(draw).collect()
}

fn reliefs(run: &Run, row: &TrialRow, zone: &Zone, counts: &[u32]) -> Drawings {
    let Some(space) = surfaces::space(run, zone) else { return Ok(None) };
    let grid = Grid::new(run, 2, surfaces::PLACES)?;
    let places: Vec<&[f64]> = grid.places().collect();
    let [xs, zs] = [grid.along(0), grid.along(1)];
    let frame = |&count: &u32| {
        let replay = BeliefReplay::of(&run.experiment, row, count)?;
        anyhow::Ok(replay.map(|replay| HeightFrame::of(&replay, &places)))
    };
    let Some(frames): Option<Vec<HeightFrame>> =
        counts.par_iter().map(frame).collect::<anyhow::Result<_>>()?
    else {
        return Ok(None);
    };
    let unit = Length::of(zone);
    let drawn = |frame: &HeightFrame| -> Vec<f64> {
        let known = frame.means_m.iter().zip(&frame.deviations_m);
        known.filter_map(|(mean_m, sd_m)| mean_m.map(|_| *sd_m)).collect()
    };
    let sds_m: Vec<f64> = frames.iter().flat_map(drawn).collect();
    let Some(axis) = deviation_axis(sds_m.iter(), unit) else { return Ok(None) };
    let panels = 1 + usize::from(run.truth.is_known());
    let sheet = FilmLayout::new(run, row, counts, SURFACE_PX, panels);
    let initial = run.experiment.initial_touches as usize;
    let draw = |frame: &HeightFrame| {
        let entries = sheet.touch_entries(row);
        sheet.draw(frame.touches, entries, Some((&axis, unit)), |canvas, area| {
            let panel = ReliefPanel::new(unit, area, space);
            panel.frame(canvas, "belief", "");
            let relief =
                Relief::coloured(&panel, [&xs, &zs], &frame.means_m, |corners, _, normal| {
                    let shares = corners.iter().map(|&corner| {
                        axis.fraction(frame.deviations_m[corner] * unit.per_m).clamp(0.0, 1.0)
                    });
                    let share = shares.sum::<f64>() / corners.len() as f64;
                    style::shaded_colour(&style::DEVIATION, share, brightness(normal))
                });
            relief.draw(canvas);
            canvas.grouped(ON_RELIEF, |canvas| {
                let touches = &row.touches[..frame.touches as usize];
                surfaces::mark(&panel, canvas, zone, &relief, replay::marks(touches, initial));
            });
            if panels > 1 {
                let area = Area { left: area.right(), ..area };
                let panel = ReliefPanel::new(unit, area, space);
                panel.frame(canvas, "true object", "");
                let heights_m: Vec<_> = grid.places.iter().map(|(_, height_m)| *height_m).collect();
                let [low, high] = space.height_m;
                let heights = Axis::linear(low, high, 5.0);
                Relief::new(&panel, [&xs, &zs], &heights_m, &heights).draw(canvas);
            }
        })
    };
    Ok(Some(frames.par_iter().map(draw).collect()))
}

fn solids(run: &Run, row: &TrialRow, counts: &[u32]) -> Drawings {
    let truth = whole_object::truth(run);
    let sequences = whole_object::sequences(run, &[&row.planner], &|_| counts.to_vec(), None)?;
    let Some(sequence) = sequences.first() else { return Ok(None) };
    let mesh = truth.as_ref().map(|bvh| &**bvh.mesh());
    let panels = 2 + usize::from(mesh.is_some());
    let sheet = FilmLayout::new(run, row, counts, SOLID_PX, panels);
    let areas = |first: Area| {
        [0.0, 1.0, 2.0].map(|column| Area { left: first.left + column * first.width, ..first })
    };
    let entries = || sheet.touch_entries(row);
    let Some(panels) = FilmPanels::new(sequence, mesh, areas(sheet.first(entries()))) else {
        return Ok(None);
    };
    let draw = |frame: &SurfaceFrame| {
        sheet.draw(
            frame.touches,
            entries(),
            panels.axis().map(|axis| (axis, MM)),
            |canvas, area| {
                panels.draw(canvas, frame, [area.left, area.bottom() - 24.0]);
            },
        )
    };
    Ok(Some(sequence.frames.par_iter().map(draw).collect()))
}

/// Parts that all frames of a film share.
struct FilmLayout<'a> {
    planner: &'a str,
    measure: &'static Measure,
    colour: &'static str,
    /// Trial, with its place among the others.
    trial: String,
    touches: u32,
    /// Touches and error, in the unit of the measure.
    errors: Vec<(f64, f64)>,
    panel_px: [f64; 2],
    /// Width of all panels.
    width_px: f64,
    /// Whether a surface is coloured by the standard deviation, so that there is a colour bar.
    has_bar: bool,
}

impl<'a> FilmLayout<'a> {
    fn new(
        run: &Run,
        row: &'a TrialRow,
        counts: &[u32],
        panel_px: [f64; 2],
        panels: usize,
    ) -> Self {
        let (experiment, measure) = (&run.experiment, run.experiment.error_measure());
        let last = counts.last().copied().unwrap_or_default();
        let error = |count: u32| {
            let error = measure.value(row, count)?;
            Some((f64::from(count), error * measure.unit.per_si))
        };
        Self {
            planner: &row.planner,
            measure,
            colour: style::planner(&experiment.planners, &row.planner),
            trial: rank_words(run, &row.planner, row.trial),
            touches: experiment.touches,
            errors: (experiment.first_fit()..=last).filter_map(error).collect(),
            panel_px,
            width_px: (panel_px[0] * panels as f64).max(WIDTH_MIN_PX),
            has_bar: !run.experiment.scene.is_curve(),
        }
    }

    /// Legend entries of touches on a surface.
    fn touch_entries(
        &self,
        row: &TrialRow,
    ) -> impl Iterator<Item = (Swatch, &'static str)> + use<> {
        let is_missed = row.touches.iter().any(|touch| touch.contact().is_none());
        touch_entries().into_iter().chain(is_missed.then_some(MISS))
    }

    fn layout(&self, entries: impl Iterator<Item = (Swatch, &'static str)>) -> FigureLayout {
        let [width, height] = self.panel_px;
        let first = Area { left: MARGIN_PX, top: LEGEND_PX + HEAD_PX, width, height };
        let error_px = if self.errors.is_empty() { 0.0 } else { ERROR_PX[0] };
        let foot_px = error_px + if self.has_bar { BAR_PX[0] } else { 0.0 };
        let size = [self.width_px + 2.0 * MARGIN_PX, first.bottom() + foot_px];
        FigureLayout::new(size, first, [width, 0.0], self.width_px, ON_RELIEF, entries)
    }

    /// Returns the area of the first panel.
    fn first(&self, entries: impl Iterator<Item = (Swatch, &'static str)>) -> Area {
        self.layout(entries).area(0, 0.0)
    }

    /// Draws a frame: `panels` draws the panels from the area of the first, and `bar` is the axis
    /// of the standard deviation.
    fn draw(
        &self,
        count: u32,
        entries: impl Iterator<Item = (Swatch, &'static str)>,
        bar: Option<(&Axis, Length)>,
        panels: impl FnOnce(&mut Canvas, Area),
    ) -> String {
        let mut sheet = self.layout(entries);
        let area = sheet.area(0, 0.0);
        let bottom = sheet.bottom;
        let canvas = &mut sheet.canvas;
        let headline = format!("{}: {count} of {} touches", self.planner, self.touches);
        canvas.text([area.left, area.top - 30.0], &headline, HEADLINE_PX, Anchor::Start);
        let Measure { title, unit, .. } = self.measure;
        let error = self.errors.iter().find(|(touches, _)| *touches == f64::from(count));
        let error = match error {
            Some((_, error)) => format!("{title} {} {}", digits(*error), unit.symbol),
            None => "no ground truth".into(),
        };
        let line = format!("{error}; {}", self.trial);
        canvas.text([area.left, area.top - 9.0], &line, TEXT_PX, Anchor::Start);
        panels(canvas, area);
        self.draw_errors(canvas, area.bottom(), count);
        if let Some((axis, unit)) = bar {
            let left = area.left + self.width_px - BAR_PX[1];
            let bar = Area { left, top: bottom - BAR_PX[0] + 6.0, width: BAR_PX[1], height: 13.0 };
            let words = unit.named("standard deviation σ");
            colour_bar(canvas, bar, axis, &words, style::deviation);
        }
        sheet.canvas.finish()
    }

    /// Draws the errors of the whole film, those after `count` touches faint.
    fn draw_errors(&self, canvas: &mut Canvas, top: f64, count: u32) {
        let Some(y) = Axis::log(self.errors.iter().map(|(_, error)| *error)) else { return };
        let [first, last] =
            [self.errors.first(), self.errors.last()].map(|it| it.map_or(0.0, |it| it.0));
        let area = Area {
            left: MARGIN_PX + NUMBERS_PX,
            top: top + 24.0,
            width: self.width_px - NUMBERS_PX,
            height: ERROR_PX[1],
        };
        let panel = Panel { area, x: Axis::counts(first, last, 8.0), y };
        panel.frame(canvas);
        let name = format!("{} ({})", self.measure.title, self.measure.unit.symbol);
        canvas.text([area.left, area.top - 7.0], &name, TEXT_PX, Anchor::Start);
        let below = [area.right(), area.bottom() + 32.0];
        canvas.coloured_text(below, "touches", SMALL_PX, Anchor::End, FAINT_INK);
        panel.curve(canvas, &self.errors, &style::stroke(FRAME, 1.2));
        let done = self.errors.iter().take_while(|(touches, _)| *touches <= f64::from(count));
        let done: Vec<(f64, f64)> = done.copied().collect();
        panel.curve(canvas, &done, &style::stroke(self.colour, 2.2));
        if let Some(&(touches, error)) = done.last() {
            canvas.circle(panel.at(touches, error), 4.0, &style::visible_touch(self.colour));
        }
    }
}
