//! Figure of the beliefs of a curve after some touches, Fig. 3 of Yi et al. 2016.

use super::ReportFigure;
use crate::experiment::store::Run;
use crate::report::axes::{Axis, Length, MM, Panel};
use crate::report::canvas::{Anchor, Area, Canvas};
use crate::report::legend::{FigureLayout, Swatch, miss_entry};
use crate::report::replay::{self, BeliefReplay, NO_BELIEF, drawn_caption, in_paper};
use crate::report::style::{self, FAINT_INK, INITIAL, INK, PLANNED, SMALL_PX, TRUTH};
use palpate_explore::task::Zone;
use palpate_gp::posterior::Scratch;
use palpate_input::format::counted;

pub(crate) const FIGURE: ReportFigure = ReportFigure { name: "curves", caption, draw };

fn caption(run: &Run) -> String {
    format!(
        "Beliefs of trial {} by number of touches: posterior mean, its 95 % band, and the true \
         surface. Blue crosses: the {}; red: those of the planner.{}{}",
        run.experiment.report.trial,
        counted(run.experiment.initial_touches, "initial touch"),
        drawn_caption(run),
        in_paper(run, "Fig. 3")
    )
}

/// Places at which curves are computed.
const STEPS: usize = 300;
const MARGIN: (f64, f64) = (72.0, 80.0);
const PANEL: (f64, f64) = (236.0, 188.0);
/// Largest height of a panel with equal axes.
const EQUAL_HEIGHT_PX: f64 = 340.0;
const GAP: (f64, f64) = (22.0, 68.0);
/// Room around a panel for its title and the numbers of its axes.
const ROOM: [f64; 4] = [62.0, 40.0, 16.0, 42.0];

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let Some(zone) = &run.experiment.scene.zone else { return Ok(None) };
    let (planners, counts) = (run.experiment.drawn_planners(), run.experiment.drawn_touch_counts());
    if zone.dimension() != 1 || !planners.iter().any(|name| replay::row(run, name).is_some()) {
        return Ok(None);
    }
    let unit = Length::of(zone);
    let Some(y) = height_axis(run, unit) else { return Ok(None) };
    let most = Area { left: MARGIN.0, top: MARGIN.1, width: PANEL.0, height: PANEL.1 };
    let shape = belief_panel(zone, y, most, EQUAL_HEIGHT_PX);
    let step = [PANEL.0 + GAP.0, shape.area.height + GAP.1];
    let legend_px = counts.len() as f64 * step[0];
    let size = [MARGIN.0 + legend_px, MARGIN.1 + planners.len() as f64 * step[1]];
    let mut sheet = FigureLayout::new(size, shape.area, step, legend_px, "", entries(run, []));
    for (row, planner) in planners.iter().enumerate() {
        for (column, &count) in counts.iter().enumerate() {
            let area = sheet.panel(column, row as f64, ROOM);
            let panel = Panel { area, ..shape.clone() };
            let canvas = &mut sheet.canvas;
            let replay = BeliefReplay::new(run, planner, count)?;
            let score = replay.as_ref().map_or(NO_BELIEF.into(), BeliefReplay::score);
            let is_last_row = row + 1 == planners.len();
            panel.frame(canvas);
            let x_label = if is_last_row { unit.named("x") } else { String::new() };
            let y_label = unit.named(&format!("{planner}: height"));
            let middle = area.left + 0.5 * PANEL.0;
            canvas.title([middle, area.top - 24.0], &counted(count, "touch"));
            let above = [middle, area.top - 8.0];
            canvas.coloured_text(above, &score, SMALL_PX, Anchor::Middle, FAINT_INK);
            panel.name_axes(canvas, &x_label, if column == 0 { &y_label } else { "" });
            if let Some(replay) = replay {
                let colour = style::planner(&run.experiment.planners, planner);
                draw_belief(canvas, &panel, run, &replay, colour);
            }
        }
    }
    Ok(Some(sheet.canvas.finish()))
}

/// Creates a panel of heights over the zone, as large as `most`. If both axes are in millimetres
/// they have the same scale, and the panel is as high as needed, up to `height_px`.
pub fn belief_panel(zone: &Zone, heights: Axis, most: Area, height_px: f64) -> Panel {
    let unit = Length::of(zone);
    let [low, high] = zone.x_m.map(|x| x * unit.per_m);
    let x = Axis::linear(low, high, 5.0);
    match unit.symbol == MM.symbol {
        true => Panel::equal(Area { height: height_px, ..most }, x, heights),
        false => Panel { area: most, x, y: heights },
    }
}

/// Returns a height axis around the truth and all drawn touches, with a margin for the bands.
pub fn height_axis(run: &Run, unit: Length) -> Option<Axis> {
    let heights_m = replay::heights_m(run, run.experiment.drawn_planners());
    Axis::around(heights_m.map(|height_m| height_m * unit.per_m), 0.4, 5.0)
}

/// Returns the legend entries for [`draw_belief`], with `more` after those of touches.
pub fn entries(
    run: &Run,
    more: impl IntoIterator<Item = (Swatch, &'static str)>,
) -> impl Iterator<Item = (Swatch, &'static str)> {
    let entries = [
        (Swatch::Line(style::stroke(TRUTH, 2.0)), "true surface"),
        (Swatch::Line(style::stroke(INK, 1.6)), "posterior mean"),
        (Swatch::Band(INK), "95 % band"),
        (Swatch::Cross(INITIAL), "initial touch"),
        (Swatch::Cross(PLANNED), "later touch"),
    ];
    entries.into_iter().chain(more).chain(miss_entry(run))
}

/// Draws the belief in `panel`: band, truth, mean, touches.
pub fn draw_belief(
    canvas: &mut Canvas,
    panel: &Panel,
    run: &Run,
    replay: &BeliefReplay,
    colour: &str,
) {
    let per_m = Length::of(replay.belief.zone()).per_m;
    let belief = read(replay);
    let band: Vec<(f64, f64, f64)> = (belief.iter())
        .map(|&(x, _, [low, high])| (x * per_m, low * per_m, high * per_m))
        .collect();
    panel.band(canvas, &band, colour);
    let truth: Vec<(f64, f64)> = (run.truth.places.iter().zip(&run.truth.heights_m))
        .map(|(place, height)| (place[0] * per_m, height.unwrap_or(f64::NAN) * per_m))
        .collect();
    panel.curve(canvas, &truth, &style::stroke(TRUTH, 2.0));
    let mean: Vec<(f64, f64)> =
        belief.iter().map(|&(x, mean, _)| (x * per_m, mean * per_m)).collect();
    panel.curve(canvas, &mean, &style::stroke(INK, 1.5));
    canvas.clipped(panel.area, |canvas| {
        replay.draw_marks(canvas, 1.3, |place, height| match height {
            Some(height) => panel.at(place[0] * per_m, height * per_m),
            None => [panel.at(place[0] * per_m, 0.0)[0], panel.area.bottom() - 6.0],
        });
    });
}

/// Returns (x, mean, ends of the band) along the zone, not finite where the belief is not drawn.
fn read(replay: &BeliefReplay) -> Vec<(f64, f64, [f64; 2])> {
    let mut scratch = Scratch::default();
    let places = replay.belief.zone().grid(STEPS);
    let drawn = replay.is_drawn(places.iter().map(Vec::as_slice));
    let bands = replay.belief.bands_m(&places).unwrap_or_default();
    (places.iter().zip(drawn).zip(bands))
        .map(|((place, is_drawn), band)| match is_drawn {
            true => (place[0], replay.surface.mean(place, &mut scratch), band),
            false => (place[0], f64::NAN, [f64::NAN; 2]),
        })
        .collect()
}
