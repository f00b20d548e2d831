//! Beliefs of a surface after some touches, Figs. 5 and 7 of Yi et al. 2016.

use super::figure::{Figure, miss_entry};
use crate::experiment::store::Run;
use crate::experiment::trial::row::TouchRow;
use crate::report::axes::{Axis, Length, height_bar};
use crate::report::canvas::{Area, Canvas};
use crate::report::legend::{sheet, touch_entries};
use crate::report::relief::{Relief, ReliefPanel, Space};
use crate::report::replay::{self, Grid, Replay, drawn_words};
use crate::report::style;
use crate::report::style::{INITIAL, LATER};
use palpate_explore::task::Zone;
use palpate_gp::posterior::Scratch;

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
        drawn_words(run)
    )
}

/// Marks whose colours do not change with the paper's, for the relief's do not.
const ON_RELIEF: &str = r#"class="relief""#;
/// Places along each side of a relief; more would not show at this size.
const PLACES: usize = 41;
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
    let grid = Grid::new(run, 2, PLACES)?;
    let [xs, zs] = [grid.along(0), grid.along(1)];
    let unit = Length::of(zone);
    let (columns, rows) = (counts.len() as f64 + 1.0, planners.len() as f64);
    let width = columns * PANEL.0;
    let size = [width + 2.0 * MARGIN.0, MARGIN.1 + rows * PANEL.1 + FOOT_PX];
    let entries = touch_entries().into_iter().chain(miss_entry(run));
    let (mut canvas, more_px) = sheet(size, [MARGIN.0, 20.0], (width, ON_RELIEF), entries);
    let area = |row: f64, column: usize| Area {
        left: MARGIN.0 + column as f64 * PANEL.0,
        top: MARGIN.1 + more_px + row * PANEL.1,
        width: PANEL.0,
        height: PANEL.1,
    };
    let [low, high] = space.height_m;
    let axis = Axis::linear(low, high, 5.0);
    for (row, planner) in planners.iter().enumerate() {
        for (column, &count) in counts.iter().enumerate() {
            let panel = ReliefPanel::new(unit, area(row as f64, column), space);
            let (replay, score) = Replay::scored(run, planner, count)?;
            panel.frame(&mut canvas, &format!("{planner}, {count} touches"), &score);
            if let Some(replay) = replay {
                let mut scratch = Scratch::default();
                let drawn = replay.is_drawn(grid.places());
                let heights: Vec<Option<f64>> = (grid.places().zip(drawn))
                    .map(|(place, is_drawn)| {
                        is_drawn.then(|| replay.surface.mean(place, &mut scratch))
                    })
                    .collect();
                let relief = Relief::new(&panel, &xs, &zs, &heights, &axis);
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
        let heights: Vec<Option<f64>> = grid.places.iter().map(|(_, height_m)| *height_m).collect();
        Relief::new(&panel, &xs, &zs, &heights, &axis).draw(&mut canvas);
    }
    // Its words are on the left, in whatever font a browser has.
    let left = (0.5 * width - 60.0).max(BAR_LEFT_MIN_PX);
    let top = size[1] + more_px - FOOT_PX + 14.0;
    let bar = Area { left, top, width: 320.0, height: 13.0 };
    height_bar(&mut canvas, bar, unit, space.height_m);
    Ok(Some(canvas.finish()))
}

/// What is drawn: the zone, and heights around the truth and the drawn touches; none in 1-D.
fn space(run: &Run, zone: &Zone) -> Option<Space> {
    let (low, high) =
        Axis::around(replay::heights_m(run, run.experiment.drawn_planners()), 0.08, 5.0)?.range();
    Some(Space { x_m: zone.x_m, z_m: zone.z_m?, height_m: [low, high] })
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
            let at = (panel.at(point), panel.nearness(point));
            relief.mark(canvas, at, 3.1, colour);
        }
        None => {
            let target = touch.target.numbers();
            let at = [target[0], panel.space.height_m[0], target[1]];
            canvas.diamond(panel.at(at), &style::stroke(colour, 1.3));
        }
    }
}
