//! Beliefs of a surface after some touches, Figs. 5 and 7 of Yi et al. 2016.

use super::figure::{Figure, miss_entry};
use crate::experiment::store::Run;
use crate::experiment::trial::row::TouchRow;
use crate::gp::posterior::Scratch;
use crate::report::axes::{Axis, Length, colour_bar};
use crate::report::canvas::{Area, Canvas, PointPx};
use crate::report::known;
use crate::report::legend::{Legend, Swatch};
use crate::report::relief::{Relief, Space};
use crate::report::relief_panel::ReliefPanel;
use crate::report::replay;
use crate::report::replay::Replay;
use crate::report::style;
use crate::report::style::{INITIAL, LATER};
use crate::task::Zone;
use anyhow::ensure;

/// Beliefs beside the true surface.
pub const FIGURE: Figure = Figure { name: "surfaces", caption, draw };

fn caption(run: &Run) -> String {
    let zone = run.experiment.scene.zone.as_ref();
    let stretch = zone.and_then(|zone| space(run, zone)).map_or(1.0, |space| space.stretch());
    let stretched = match stretch > 1.0 {
        true => format!(" Heights are stretched {stretch:.1} times."),
        false => String::new(),
    };
    format!(
        "Posterior mean over the zone in trial {} after some touches, and the true object on the \
         right, all in the same view, scale and colours. Blue points are the {} initial touches, \
         red ones those the planner chose.{stretched}{} Corresponds to Figs. 5 and 7 of the paper.",
        run.experiment.report.trial,
        run.experiment.initial_touches,
        known::words(run)
    )
}

/// Marks whose colours do not change with the paper's, for the relief's do not.
const ON_RELIEF: &str = r#"class="relief""#;
/// Faces along each side of a relief; more would not show at this size.
const FACES: usize = 40;
const MARGIN: (f64, f64) = (24.0, 44.0);
const PANEL: (f64, f64) = (252.0, 316.0);
const FOOT_PX: f64 = 62.0;
const BAR_LEFT_MIN_PX: f64 = 215.0;

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let Some(zone) = &run.experiment.scene.zone else { return Ok(None) };
    let (planners, counts) = (run.experiment.drawn_planners(), run.experiment.drawn_touch_counts());
    let Some(space) = space(run, zone) else { return Ok(None) };
    if !planners.iter().any(|planner| replay::row(run, planner).is_some()) {
        return Ok(None);
    }
    let grid = Grid::new(run)?;
    let unit = Length::of(zone);
    let (columns, rows) = (counts.len() as f64 + 1.0, planners.len() as f64);
    let width = columns * PANEL.0;
    let legend = Legend::new(width, entries(run));
    let top = MARGIN.1 + legend.more_px();
    let height = top + rows * PANEL.1 + FOOT_PX;
    let mut canvas = Canvas::new(width + 2.0 * MARGIN.0, height);
    canvas.grouped(ON_RELIEF, |canvas| legend.draw(canvas, [MARGIN.0, 20.0]));
    let area = |row: f64, column: usize| Area {
        left: MARGIN.0 + column as f64 * PANEL.0,
        top: top + row * PANEL.1,
        width: PANEL.0,
        height: PANEL.1,
    };
    let [low, high] = space.height_m;
    let axis = Axis::linear(low, high, 5.0);
    for (row, planner) in planners.iter().enumerate() {
        for (column, &count) in counts.iter().enumerate() {
            let panel = ReliefPanel::new(unit, area(row as f64, column), space);
            let replay = Replay::new(run, planner, count)?;
            let score = match &replay {
                Some(replay) => replay.score(),
                None => "not reached in this trial".into(),
            };
            panel.frame(&mut canvas, &format!("{planner}, {count} touches"), &score);
            if let Some(replay) = replay {
                let mut scratch = Scratch::default();
                let drawn = known::over(&replay, grid.places().map(|(place, _)| place));
                let heights: Vec<Option<f64>> = (grid.places().zip(drawn))
                    .map(|((place, _), is_drawn)| {
                        is_drawn.then(|| replay.surface.mean(place, &mut scratch))
                    })
                    .collect();
                let relief = Relief::new(&panel.view, &grid.xs, &grid.zs, &heights, &axis);
                relief.draw(&mut canvas);
                canvas.grouped(ON_RELIEF, |canvas| {
                    for (touch, is_initial) in replay.marks() {
                        mark(&panel, canvas, zone, &relief, (touch, is_initial));
                    }
                });
            }
        }
    }
    if run.truth.is_known() {
        let panel = ReliefPanel::new(unit, area(0.5 * (rows - 1.0), counts.len()), space);
        panel.frame(&mut canvas, "true object", "");
        let heights: Vec<Option<f64>> = grid.places().map(|(_, height_m)| height_m).collect();
        Relief::new(&panel.view, &grid.xs, &grid.zs, &heights, &axis).draw(&mut canvas);
    }
    draw_colour_bar(&mut canvas, unit, space, [0.5 * width, height - FOOT_PX + 14.0]);
    Ok(Some(canvas.finish()))
}

/// What is drawn: the zone, and heights around the truth and the drawn touches; none in 1-D.
fn space(run: &Run, zone: &Zone) -> Option<Space> {
    let (low, high) =
        Axis::around(replay::heights_m(run, run.experiment.drawn_planners()), 0.08, 5.0)?.range();
    Some(Space { x_m: zone.x_m, z_m: zone.z_m?, height_m: [low, high] })
}

/// Some of the test grid's places.
struct Grid<'a> {
    run: &'a Run,
    side: usize,
    picked: Vec<usize>,
    xs: Vec<f64>,
    zs: Vec<f64>,
}

impl<'a> Grid<'a> {
    fn new(run: &'a Run) -> anyhow::Result<Self> {
        let (side, places) = (run.experiment.grid as usize, &run.truth.places);
        ensure!(
            places.len() == side * side && side > 1,
            "the true surface has {} places on a grid of {side} × {side}",
            places.len()
        );
        let faces = (side - 1).min(FACES);
        let picked: Vec<usize> = (0..=faces).map(|i| i * (side - 1) / faces).collect();
        let xs = picked.iter().map(|&i| places[i][0]).collect();
        let zs = picked.iter().map(|&j| places[j * side][1]).collect();
        Ok(Self { run, side, picked, xs, zs })
    }

    /// Each place with the true height there.
    fn places(&self) -> impl Iterator<Item = (&[f64], Option<f64>)> {
        let truth = &self.run.truth;
        (self.picked.iter())
            .flat_map(move |&j| self.picked.iter().map(move |&i| j * self.side + i))
            .map(|index| (truth.places[index].as_slice(), truth.heights_m[index]))
    }
}

/// A touch: a point where it met the surface, hollow if that is hidden; a diamond at the
/// back where it met nothing.
fn mark(
    panel: &ReliefPanel,
    canvas: &mut Canvas,
    zone: &Zone,
    relief: &Relief,
    (touch, is_initial): (&TouchRow, bool),
) {
    let colour = if is_initial { INITIAL } else { LATER };
    match replay::contact(zone, touch) {
        Some((place, height)) => {
            let point = [place[0], height, place[1]];
            let at = panel.view.at(point);
            let attributes = match relief.hides(at, panel.view.nearness(point)) {
                true => style::hidden(colour),
                false => style::visible(colour),
            };
            canvas.circle(at, 3.1, &attributes);
        }
        None => {
            let target = touch.target.numbers();
            let at = [target[0], panel.space.height_m[0], target[1]];
            canvas.diamond(panel.view.at(at), &style::stroke(colour, 1.3));
        }
    }
}

fn entries(run: &Run) -> Vec<(Swatch, &'static str)> {
    let mut entries = vec![
        (Swatch::Circle(style::visible(INITIAL)), "initial touch"),
        (Swatch::Circle(style::visible(LATER)), "later touch"),
        (Swatch::Circle(style::hidden(LATER)), "behind the surface"),
    ];
    entries.extend(miss_entry(run));
    entries
}

fn draw_colour_bar(canvas: &mut Canvas, unit: Length, space: Space, [middle, top]: PointPx) {
    let [low, high] = space.height_m.map(|height| height * unit.per_m);
    // Its words stand on the left, in whatever font a browser has.
    let left = (middle - 60.0).max(BAR_LEFT_MIN_PX);
    let area = Area { left, top, width: 320.0, height: 13.0 };
    let words = format!("height above the datum ({})", unit.symbol);
    colour_bar(canvas, area, &Axis::linear(low, high, 6.0), &words, |t| style::height(t, 1.0));
}
