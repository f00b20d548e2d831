//! What the explorer shows: beliefs on a grid after many touch counts, in few bytes.

use super::code::Code;
use super::shell;
use crate::experiment::store::Run;
use crate::experiment::trial::row::TouchRow;
use crate::gp::batch::Prediction;
use crate::report::axes;
use crate::report::axes::{Axis, Length};
use crate::report::known;
use crate::report::relief::Space;
use crate::report::replay;
use crate::report::replay::Replay;
use crate::report::style;
use crate::task::Zone;
use anyhow::ensure;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde::Serialize;

/// Most places along the side of a curve and of a surface; chosen as what shows at the size of the
/// page.
const PLACES_MAX: [usize; 2] = [301, 41];
/// Bytes of one place in one frame: two for the mean, two for the deviation, in base 64.
const BYTES_OF_PLACE: usize = 6;
/// Room above and below the heights of a curve, for its bands, and of a surface; chosen.
const MARGIN: [f64; 2] = [0.3, 0.08];
/// Deviations smaller than this share of the largest are shown as that; chosen.
const LEAST_SHARE: f64 = 1e-4;

/// Everything; lengths are in the unit of the page.
#[derive(Serialize)]
pub(super) struct Data {
    unit: &'static str,
    x: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    z: Option<Vec<f64>>,
    /// Ends of the heights drawn, and how much they are stretched.
    space: [f64; 2],
    stretch: f64,
    /// Ends of what the codes of heights and of deviations stand for.
    height_range: [f64; 2],
    deviation_range: [f64; 2],
    truth: String,
    initial_touches: u32,
    colours: Colours,
    planners: Vec<Planner>,
}

#[derive(Serialize)]
struct Colours {
    height: &'static [[f64; 3]],
    deviation: &'static [[f64; 3]],
    error: &'static [[f64; 3]],
    truth: [f64; 3],
    initial: [&'static str; 2],
    later: [&'static str; 2],
}

#[derive(Serialize)]
struct Planner {
    name: String,
    /// Its colour on light and on dark paper.
    colours: [&'static str; 2],
    /// (x, height, z) of each touch, or of its target if it met nothing.
    contacts: Vec<(f64, Option<f64>, Option<f64>)>,
    frames: Vec<Frame>,
}

#[derive(Serialize)]
struct Frame {
    touches: u32,
    score: String,
    mean: String,
    deviation: String,
}

/// A belief on the grid, in metres.
struct Belief {
    touches: u32,
    score: String,
    /// None where no belief is drawn.
    means_m: Vec<Option<f64>>,
    deviations_m: Vec<f64>,
}

impl Data {
    pub(super) fn is_surface(&self) -> bool {
        self.z.is_some()
    }

    /// Frames of the first planner.
    pub(super) fn frames(&self) -> usize {
        self.planners.first().map_or(0, |planner| planner.frames.len())
    }

    pub(super) fn planners(&self) -> impl Iterator<Item = &str> {
        self.planners.iter().map(|planner| planner.name.as_str())
    }
}

/// Replays the trial that the report draws; none if there is nothing to show.
pub(super) fn data(run: &Run) -> anyhow::Result<Option<Data>> {
    let experiment = &run.experiment;
    let Some(zone) = &experiment.scene.zone else { return Ok(None) };
    let kind = zone.dimension() - 1;
    let names: Vec<&str> = experiment.planners.iter().map(String::as_str).collect();
    let heights_m = replay::heights_m(run, names.iter().copied());
    let Some(axis) = Axis::around(heights_m, MARGIN[kind], 5.0) else { return Ok(None) };
    let grid = Grid::new(run, zone.dimension(), PLACES_MAX[kind])?;
    let places: Vec<&[f64]> =
        grid.indices.iter().map(|&index| run.truth.places[index].as_slice()).collect();
    let (first, last) = (experiment.initial_touches, experiment.touches);
    let counts = shell::counts(first, last, BYTES_OF_PLACE * names.len() * places.len());
    let mut beliefs = Vec::new();
    for &name in &names {
        let read = counts.par_iter().map(|&count| belief(run, name, count, &places));
        let read: Vec<Option<Belief>> = read.collect::<anyhow::Result<_>>()?;
        let read: Vec<Belief> = read.into_iter().flatten().collect();
        if !read.is_empty() {
            beliefs.push((name, read));
        }
    }
    let deviations = || beliefs.iter().flat_map(|(_, read)| read).flat_map(|b| &b.deviations_m);
    let Some((least, most)) = axes::range(deviations().copied()) else { return Ok(None) };
    let (low, high) = axis.range();
    let span = high - low;
    let unit = Length::of(zone);
    let code = Code {
        height_m: [low - span, high + span],
        deviation_m: [least.max(LEAST_SHARE * most).max(f64::MIN_POSITIVE), most],
    };
    let in_unit = |ends: [f64; 2]| ends.map(|end| end * unit.per_m);
    let axis = |side: usize| -> Vec<f64> {
        let step = if side == 0 { 1 } else { grid.picked.len() };
        let along = (0..grid.picked.len()).map(|i| places[i * step][side] * unit.per_m);
        along.map(short).collect()
    };
    let truth = grid.indices.iter().map(|&index| run.truth.heights_m[index].unwrap_or(f64::NAN));
    let stretch = zone
        .z_m
        .map(|z_m| Space { x_m: zone.x_m, z_m, height_m: [low, high] }.stretch())
        .unwrap_or(1.0);
    let planners = beliefs.iter().map(|(name, read)| Planner {
        name: (*name).into(),
        colours: style::on_both(style::planner(&experiment.planners, name)),
        contacts: replay::row(run, name)
            .map_or(&[][..], |row| &row.touches)
            .iter()
            .map(|touch| contact(zone, touch, unit))
            .collect(),
        frames: read
            .iter()
            .map(|belief| Frame {
                touches: belief.touches,
                score: belief.score.clone(),
                mean: code.heights(belief.means_m.iter().map(|mean_m| mean_m.unwrap_or(f64::NAN))),
                deviation: code.deviations(&belief.deviations_m),
            })
            .collect(),
    });
    Ok(Some(Data {
        unit: unit.symbol,
        x: axis(0),
        z: zone.z_m.map(|_| axis(1)),
        space: in_unit([low, high]),
        stretch,
        height_range: in_unit(code.height_m),
        deviation_range: in_unit(code.deviation_m),
        truth: code.heights(truth),
        initial_touches: experiment.initial_touches,
        colours: Colours {
            height: &style::HEIGHT,
            deviation: &style::DEVIATION,
            error: &style::ERROR,
            truth: style::TRUTH_RGB,
            initial: style::on_both(style::INITIAL),
            later: style::on_both(style::LATER),
        },
        planners: planners.collect(),
    }))
}

/// Some of the places of the test grid: every so many along each side.
struct Grid {
    /// Which along a side.
    picked: Vec<usize>,
    /// Which of all, x varying fastest.
    indices: Vec<usize>,
}

impl Grid {
    fn new(run: &Run, dimension: usize, most: usize) -> anyhow::Result<Self> {
        let (side, count) = (run.experiment.grid as usize, run.truth.places.len());
        ensure!(
            side > 1 && count == side.pow(dimension as u32),
            "the true surface has {count} places on a grid of {side} along each side"
        );
        let steps = (side - 1).min(most - 1);
        let picked: Vec<usize> = (0..=steps).map(|i| i * (side - 1) / steps).collect();
        let rows = if dimension == 1 { &[0][..] } else { &picked };
        let indices = rows.iter().flat_map(|j| picked.iter().map(move |i| j * side + i)).collect();
        Ok(Self { picked, indices })
    }
}

fn belief(
    run: &Run,
    planner: &str,
    touches: u32,
    places: &[&[f64]],
) -> anyhow::Result<Option<Belief>> {
    let Some(replay) = Replay::new(run, planner, touches)? else { return Ok(None) };
    let predictions = replay.surface.predict(places.iter().copied());
    let known = known::over(&replay, places.iter().copied());
    let drawn = |(known, prediction): (&bool, &Prediction)| known.then_some(prediction.mean);
    Ok(Some(Belief {
        touches,
        score: replay.score(),
        means_m: known.iter().zip(&predictions).map(drawn).collect(),
        deviations_m: predictions.iter().map(|prediction| prediction.variance.sqrt()).collect(),
    }))
}

fn contact(zone: &Zone, touch: &TouchRow, unit: Length) -> (f64, Option<f64>, Option<f64>) {
    let met = replay::contact(zone, touch);
    let height = met.as_ref().map(|(_, height_m)| short(height_m * unit.per_m));
    let place = met.map_or_else(|| touch.target.numbers(), |(place, _)| place);
    let coordinate = |side: usize| place.get(side).map(|at| short(at * unit.per_m));
    (coordinate(0).unwrap_or(0.0), height, coordinate(1))
}

/// A number with no more digits than show.
fn short(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
