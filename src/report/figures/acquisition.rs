//! Figure of the reducible standard deviation before and after a touch, Fig. 6 of Yi et al. 2016.

use super::ReportFigure;
use super::curves;
use crate::experiment::store::Run;
use crate::report::axes::{Axis, Length, Panel, colour_bar};
use crate::report::canvas::Area;
use crate::report::heat_map::{HeatMap, MapValue};
use crate::report::legend::{FigureLayout, Swatch, miss_entry};
use crate::report::replay::{BeliefReplay, drawn_caption, in_paper};
use crate::report::style::{self, INITIAL, PLANNED};
use palpate_explore::belief::HeightField;
use palpate_explore::task::Zone;
use palpate_gp::posterior::Scratch;
use palpate_input::format::counted;

pub(crate) const FIGURE: ReportFigure = ReportFigure { name: "acquisition", caption, draw };

fn caption(run: &Run) -> String {
    let planner = planner(run).unwrap_or("the planner");
    format!(
        "Standard deviation that another touch could remove, before and after one touch of \
         {planner} in trial {}. Circle: largest value found. Crosses: points of contact, which may \
         lie beside their targets.{}{}",
        run.experiment.report.trial,
        drawn_caption(run),
        in_paper(run, "Fig. 6")
    )
}

/// Returns the planner to draw: `active`, which maximises this map, if it is drawn; otherwise the
/// first.
fn planner(run: &Run) -> Option<&str> {
    let planners = run.experiment.drawn_planners();
    planners.iter().find(|&&name| name == "active").or(planners.first()).copied()
}

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let Some(zone) = &run.experiment.scene.zone else { return Ok(None) };
    let (Some(planner), Some(&count)) = (planner(run), run.experiment.drawn_touch_counts().first())
    else {
        return Ok(None);
    };
    let Some(before) = BeliefReplay::new(run, planner, count)? else { return Ok(None) };
    let after = BeliefReplay::new(run, planner, count + 1)?;
    let replays: Vec<BeliefReplay> = std::iter::once(before).chain(after).collect();
    Ok(match zone.dimension() {
        1 => draw_curves(run, zone, planner, &replays),
        _ => draw_maps(run, zone, planner, &replays),
    })
}

/// Returns the standard deviation at `place` that a touch can still reduce.
fn deviation_m(belief: &HeightField, place: &[f64], scratch: &mut Scratch) -> f64 {
    belief.planning_posterior().map_or(f64::NAN, |known| known.variance(place, scratch).sqrt())
}

/// Returns the place of the largest standard deviation: that of the plan, or else of `read`.
fn maximum<'a>(replay: &'a BeliefReplay, read: &'a [MapValue]) -> Option<&'a [f64]> {
    let next = replay.next.filter(|next| next.planned_sd_m.is_some() && next.fallback.is_none());
    let largest = || read.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let planned = next.and_then(|next| next.target.place());
    planned.or_else(|| largest().map(|(place, ..)| place.as_slice()))
}

fn title(planner: &str, replay: &BeliefReplay) -> String {
    format!("{planner}, after {}", counted(replay.touches.len(), "touch"))
}

fn ring(colour: &str) -> String {
    style::stroke(colour, 2.0)
}

const LEFT_PX: f64 = 72.0;
const TOP_PX: f64 = 66.0;
/// Room around a panel for its title and the numbers of its axes.
const ROOM: [f64; 4] = [62.0, 28.0, 16.0, 42.0];

/// Places at which the standard deviation of a curve is computed.
const STEPS: usize = 300;
/// Width of a panel, height of a panel of beliefs, height of a panel of standard deviations.
const CURVE_PX: (f64, f64, f64) = (340.0, 210.0, 130.0);
/// Largest height of a panel of beliefs with equal axes.
const EQUAL_HEIGHT_PX: f64 = 420.0;
/// Distance between panels, and between a belief and its standard deviation.
const GAPS_PX: (f64, f64) = (66.0, 40.0);

fn draw_curves(run: &Run, zone: &Zone, planner: &str, replays: &[BeliefReplay]) -> Option<String> {
    let unit = Length::of(zone);
    let read: Vec<Vec<MapValue>> =
        replays.iter().map(|replay| readings(zone.grid(STEPS), replay)).collect();
    let all = read.iter().flatten().map(|(_, sd_m, _)| sd_m * unit.per_m);
    let (_, largest) = Axis::around(all.chain([0.0]), 0.12, 4.0)?.range();
    let found = (Swatch::Circle(ring(style::MAXIMUM)), "largest standard deviation found");
    let step_px = CURVE_PX.0 + GAPS_PX.0;
    let width = LEFT_PX + replays.len() as f64 * step_px;
    let most = Area { left: LEFT_PX, top: TOP_PX, width: CURVE_PX.0, height: CURVE_PX.1 };
    let shape = curves::belief_panel(zone, curves::height_axis(run, unit)?, most, EQUAL_HEIGHT_PX);
    let size = [width, shape.area.bottom() + GAPS_PX.1 + CURVE_PX.2 + 56.0];
    let entries = curves::entries(run, [found]);
    let (first, step) = (shape.area, [step_px, 0.0]);
    let mut sheet = FigureLayout::new(size, first, step, width - LEFT_PX, "", entries);
    let colour = style::planner(&run.experiment.planners, planner);
    for (column, (replay, read)) in replays.iter().zip(&read).enumerate() {
        let below_px = GAPS_PX.1 + CURVE_PX.2 + ROOM[3];
        let room = [ROOM[0], ROOM[1], ROOM[2], below_px];
        let above = Panel { area: sheet.panel(column, 0.0, room), ..shape.clone() };
        let top = above.area.bottom() + GAPS_PX.1;
        let area = Area { top, height: CURVE_PX.2, ..above.area };
        let below = Panel { area, x: shape.x.clone(), y: Axis::linear(0.0, largest, 4.0) };
        let canvas = &mut sheet.canvas;
        above.titled_frame(canvas, &title(planner, replay), "", &unit.named("height"));
        curves::draw_belief(canvas, &above, run, replay, colour);
        below.titled_frame(canvas, "", &unit.named("x"), &unit.named("deviation"));
        let drawn = |sd_m: f64, is_drawn: bool| if is_drawn { sd_m * unit.per_m } else { f64::NAN };
        let curve: Vec<(f64, f64)> = (read.iter())
            .map(|(place, sd_m, is_drawn)| (place[0] * unit.per_m, drawn(*sd_m, *is_drawn)))
            .collect();
        below.curve(canvas, &curve, &style::stroke(colour, 1.8));
        if let Some(place) = maximum(replay, read) {
            let sd_m = deviation_m(&replay.belief, place, &mut Scratch::default());
            let at = below.at(place[0] * unit.per_m, sd_m * unit.per_m);
            canvas.clipped(below.area, |canvas| canvas.circle(at, 6.0, &ring(style::MAXIMUM)));
        }
    }
    Some(sheet.canvas.finish())
}

fn readings(places: Vec<Vec<f64>>, replay: &BeliefReplay) -> Vec<MapValue> {
    let mut scratch = Scratch::default();
    let drawn = replay.is_drawn(places.iter().map(Vec::as_slice));
    let read = |(place, is_drawn): (Vec<f64>, bool)| {
        let sd_m = deviation_m(&replay.belief, &place, &mut scratch);
        (place, sd_m, is_drawn)
    };
    places.into_iter().zip(drawn).map(read).collect()
}

/// Largest size of a map with equal axes.
const MAP_PX: (f64, f64) = (340.0, 640.0);
/// Length of the colour bar, and smallest distance between maps.
const BAR_PX: f64 = 320.0;
const MAP_STEP_PX: f64 = 280.0;

fn draw_maps(run: &Run, zone: &Zone, planner: &str, replays: &[BeliefReplay]) -> Option<String> {
    let unit = Length::of(zone);
    let [x, z] = [zone.x_m, zone.z_m?].map(|side| side.map(|end| end * unit.per_m));
    let mut entries = vec![
        (Swatch::Cross(INITIAL), "initial touch"),
        (Swatch::Cross(PLANNED), "later touch"),
        (Swatch::Circle(ring(style::MAXIMUM)), "largest standard deviation found"),
    ];
    entries.extend(miss_entry(run));
    let most = Area { left: LEFT_PX, top: TOP_PX, width: MAP_PX.0, height: MAP_PX.1 };
    let shape = Panel::equal(most, Axis::linear(x[0], x[1], 5.0), Axis::linear(z[0], z[1], 6.0));
    let step_px = (shape.area.width + 84.0).max(MAP_STEP_PX);
    let width = LEFT_PX + 2.0 * step_px;
    let size = [width, shape.area.bottom() + 120.0];
    let (first, step) = (shape.area, [step_px, 0.0]);
    let mut sheet = FigureLayout::new(size, first, step, width - LEFT_PX, "", entries);
    let shape = Panel { area: sheet.area(0, 0.0), ..shape };
    // The zone's part of a panel, all of it unless the zone is far from square.
    let [[left, bottom], [right, top]] = [shape.at(x[0], z[0]), shape.at(x[1], z[1])];
    let map_area = Area { left, top, width: right - left, height: bottom - top };
    let map = |replay| HeatMap::new(zone, map_area, |places| readings(places, replay));
    let maps: Vec<HeatMap> = replays.iter().map(map).collect();
    let largest = maps.iter().map(HeatMap::largest).fold(0.0, f64::max);
    let scale = Axis::linear(0.0, largest * unit.per_m, 5.0);
    for (column, (replay, map)) in replays.iter().zip(&maps).enumerate() {
        let area = Area { left: map_area.left + column as f64 * step_px, ..map_area };
        let panel = Panel { area: sheet.panel(column, 0.0, ROOM), ..shape.clone() };
        let canvas = &mut sheet.canvas;
        panel.titled_frame(canvas, &title(planner, replay), &unit.named("x"), &unit.named("z"));
        map.draw(canvas, area, |value| style::deviation(scale.fraction(value * unit.per_m)));
        let on_map = |place: &[f64]| panel.at(place[0] * unit.per_m, place[1] * unit.per_m);
        canvas.clipped(panel.area, |canvas| {
            replay.draw_marks(canvas, 1.6, |place, _| on_map(place));
            if let Some(place) = maximum(replay, &map.readings) {
                canvas.circle(on_map(place), 7.0, &style::stroke(style::PAPER, 5.0));
                canvas.circle(on_map(place), 7.0, &ring(style::MAXIMUM));
            }
        });
    }
    let top = shape.area.bottom() + 74.0;
    let bar = Area { left: 0.5 * (width - BAR_PX), top, width: BAR_PX, height: 13.0 };
    let words = unit.named("standard deviation");
    colour_bar(&mut sheet.canvas, bar, &scale, &words, style::deviation);
    Some(sheet.canvas.finish())
}
