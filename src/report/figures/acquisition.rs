//! Where the belief is unsure and what touching there changes, Fig. 6 of Yi et al. 2016.

use super::curves;
use super::figure::{Figure, miss_entry};
use crate::experiment::store::Run;
use crate::explore::belief::Belief;
use crate::gp::posterior::Scratch;
use crate::report::axes::{Axis, Length, Panel, Swatch, colour_bar, legend};
use crate::report::canvas::{Area, Canvas};
use crate::report::heat_map::{CELL_PX, HeatMap};
use crate::report::replay;
use crate::report::replay::Replay;
use crate::report::style;
use crate::report::style::{INITIAL, LATER};
use crate::task::Zone;

pub(super) const FIGURE: Figure = Figure { name: "acquisition", caption, draw };

fn caption(run: &Run) -> String {
    let planner = planner(run).unwrap_or("the planner");
    format!(
        "Standard deviation that another touch could still remove, before and after one more \
         touch of {planner} in trial {}: the circle marks the largest that \
         was found. Crosses are points of contact, which may lie beside their targets. \
         Corresponds to Fig. 6 of the paper.",
        run.experiment.report.trial
    )
}

/// The planner drawn: the one that follows this map, if it is there.
fn planner(run: &Run) -> Option<&str> {
    let planners = run.experiment.drawn_planners();
    planners.iter().find(|&&name| name == "active").or(planners.first()).copied()
}

fn draw(run: &Run) -> anyhow::Result<Option<String>> {
    let (Some(planner), Some(&count)) = (planner(run), run.experiment.drawn_touch_counts().first())
    else {
        return Ok(None);
    };
    let Some(before) = Replay::new(run, planner, count)? else { return Ok(None) };
    let after = Replay::new(run, planner, count + 1)?;
    let replays: Vec<Replay> = std::iter::once(before).chain(after).collect();
    Ok(match run.experiment.scene.zone.dimension() {
        1 => draw_curves(run, planner, &replays),
        _ => draw_maps(run, planner, &replays),
    })
}

/// Standard deviation that a touch asked for at `place` could still remove.
fn deviation_m(belief: &Belief, place: &[f64], scratch: &mut Scratch) -> f64 {
    belief.explorable_variance(place, &mut [], scratch).sqrt()
}

/// Where the deviation is largest: what the planner found, or else the largest of `read`.
fn maximum(replay: &Replay, read: impl Iterator<Item = (Vec<f64>, f64)>) -> Option<Vec<f64>> {
    let planned = replay
        .next
        .filter(|next| next.planned_sd_m.is_some() && next.stall.is_none())
        .map(|next| next.target.clone());
    planned.or_else(|| read.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(place, _)| place))
}

fn title(planner: &str, replay: &Replay) -> String {
    format!("{planner}, after {} touches", replay.touches.len())
}

fn ring(colour: &str) -> String {
    style::stroke(colour, 2.0)
}

const LEFT_PX: f64 = 72.0;
const TOP_PX: f64 = 66.0;

/// Places at which the deviation of a curve is read.
const STEPS: usize = 300;
/// Heights of the panels of beliefs and of deviations.
const CURVE_PX: (f64, f64) = (210.0, 130.0);

fn draw_curves(run: &Run, planner: &str, replays: &[Replay]) -> Option<String> {
    let unit = Length::of(&run.experiment.scene.zone);
    let heights = curves::height_axis(run)?;
    let read: Vec<Vec<(Vec<f64>, f64)>> =
        replays.iter().map(|replay| read_deviations(run, replay)).collect();
    let all = read.iter().flatten().map(|(_, sd_m)| sd_m * unit.per_m);
    let (_, largest) = Axis::around(all.chain([0.0]), 0.12, 4.0)?.range();
    let mut canvas = Canvas::new(1000.0, TOP_PX + CURVE_PX.0 + 40.0 + CURVE_PX.1 + 56.0);
    let mut entries = vec![
        (Swatch::Line(style::stroke(style::TRUTH, 2.0)), "true surface"),
        (Swatch::Line(style::stroke(style::INK, 1.6)), "posterior mean"),
        (Swatch::Cross(INITIAL), "initial touch"),
        (Swatch::Cross(LATER), "later touch"),
        (Swatch::Circle(ring(style::MAXIMUM)), "largest deviation found"),
    ];
    entries.extend(miss_entry(run));
    legend(&mut canvas, [LEFT_PX, 20.0], &entries);
    for (column, (replay, read)) in replays.iter().zip(&read).enumerate() {
        let left = LEFT_PX + column as f64 * 486.0;
        let area = Area { left, top: TOP_PX, width: 420.0, height: CURVE_PX.0 };
        let axes = [heights.clone(), Axis::linear(0.0, largest, 4.0)];
        draw_column(&mut canvas, run, planner, (replay, read), area, axes);
    }
    Some(canvas.finish())
}

/// Places along the zone with their deviations in metres.
fn read_deviations(run: &Run, replay: &Replay) -> Vec<(Vec<f64>, f64)> {
    let mut scratch = Scratch::default();
    let mut read = |place: &[f64]| deviation_m(&replay.belief, place, &mut scratch);
    let places = run.experiment.scene.zone.grid(STEPS).into_iter();
    places.map(|place| (place.clone(), read(&place))).collect()
}

/// The belief in `area` and its deviation below.
fn draw_column(
    canvas: &mut Canvas,
    run: &Run,
    planner: &str,
    (replay, read): (&Replay, &[(Vec<f64>, f64)]),
    area: Area,
    [heights, deviations]: [Axis; 2],
) {
    let zone = &run.experiment.scene.zone;
    let unit = Length::of(zone);
    let colour = style::planner(&run.experiment.planners, planner);
    let [low, high] = zone.x_m.map(|x| x * unit.per_m);
    let x = Axis::linear(low, high, 6.0);
    let words = |name: &str| format!("{name} ({})", unit.symbol);
    let panel = Panel { area, x: x.clone(), y: heights };
    panel.frame(canvas);
    panel.label(canvas, &title(planner, replay), "", &words("height"));
    curves::draw_belief(canvas, &panel, run, replay, colour);
    let area = Area { top: area.bottom() + 40.0, height: CURVE_PX.1, ..area };
    let panel = Panel { area, x, y: deviations };
    panel.frame(canvas);
    panel.label(canvas, "", &words("x"), &words("deviation"));
    let curve: Vec<(f64, f64)> =
        read.iter().map(|(place, sd_m)| (place[0] * unit.per_m, sd_m * unit.per_m)).collect();
    panel.curve(canvas, &curve, &style::stroke(colour, 1.8));
    if let Some(place) = maximum(replay, read.iter().cloned()) {
        let sd_m = deviation_m(&replay.belief, &place, &mut Scratch::default());
        let at = panel.at(place[0] * unit.per_m, sd_m * unit.per_m);
        canvas.circle(at, 6.0, &ring(style::MAXIMUM));
    }
}

const MAP_WIDTH_PX: f64 = 400.0;
/// Smallest and largest height of a map, for zones that are far from square.
const MAP_HEIGHT_PX: (f64, f64) = (160.0, 640.0);

fn draw_maps(run: &Run, planner: &str, replays: &[Replay]) -> Option<String> {
    let zone = &run.experiment.scene.zone;
    let unit = Length::of(zone);
    let [[x_low, x_high], [z_low, z_high]] = axes_of(zone, unit)?;
    let height = MAP_WIDTH_PX * (z_high - z_low) / (x_high - x_low);
    let height = height.clamp(MAP_HEIGHT_PX.0, MAP_HEIGHT_PX.1);
    let area = Area {
        left: LEFT_PX,
        top: TOP_PX,
        width: MAP_WIDTH_PX,
        height: (height / CELL_PX).round() * CELL_PX,
    };
    let maps: Vec<HeatMap> = replays
        .iter()
        .map(|replay| {
            let mut scratch = Scratch::default();
            HeatMap::read(zone, area, |place| {
                unit.per_m * deviation_m(&replay.belief, place, &mut scratch)
            })
        })
        .collect();
    let largest = maps.iter().map(HeatMap::largest).fold(0.0, f64::max);
    let scale = Axis::linear(0.0, largest, 5.0);
    let mut canvas = Canvas::new(1000.0, area.bottom() + 108.0);
    let mut entries = vec![
        (Swatch::Cross(INITIAL), "initial touch"),
        (Swatch::Cross(LATER), "later touch"),
        (Swatch::Circle(ring(style::MAXIMUM)), "largest deviation found"),
    ];
    entries.extend(miss_entry(run));
    legend(&mut canvas, [LEFT_PX, 20.0], &entries);
    for (column, (replay, map)) in replays.iter().zip(&maps).enumerate() {
        let area = Area { left: LEFT_PX + column as f64 * (MAP_WIDTH_PX + 84.0), ..area };
        let panel = Panel {
            area,
            x: Axis::linear(x_low, x_high, 5.0),
            y: Axis::linear(z_low, z_high, 6.0),
        };
        panel.frame(&mut canvas);
        map.draw(&mut canvas, area, |value| style::deviation(scale.fraction(value)));
        let words = |name: &str| format!("{name} ({})", unit.symbol);
        panel.label(&mut canvas, &title(planner, replay), &words("x"), &words("z"));
        let on_map = |place: &[f64]| panel.at(place[0] * unit.per_m, place[1] * unit.per_m);
        for (touch, is_initial) in replay.marks() {
            let colour = if is_initial { INITIAL } else { LATER };
            match replay::contact(zone, touch) {
                Some((place, _)) => canvas.cross(on_map(&place), colour),
                None => canvas.diamond(on_map(&touch.target), &style::stroke(colour, 1.6)),
            }
        }
        if let Some(place) = maximum(replay, map.places(zone)) {
            canvas.circle(on_map(&place), 7.0, &style::stroke(style::PAPER, 5.0));
            canvas.circle(on_map(&place), 7.0, &ring(style::MAXIMUM));
        }
    }
    let bar = Area { left: 420.0, top: area.bottom() + 62.0, width: 320.0, height: 13.0 };
    let words = format!("standard deviation ({})", unit.symbol);
    colour_bar(&mut canvas, bar, &scale, &words, style::deviation);
    Some(canvas.finish())
}

/// Ends of x and z for labels.
fn axes_of(zone: &Zone, unit: Length) -> Option<[[f64; 2]; 2]> {
    Some([zone.x_m, zone.z_m?].map(|side| side.map(|end| end * unit.per_m)))
}
