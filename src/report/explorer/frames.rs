//! What the explorer shows: beliefs on a grid after many touch counts, in few bytes.

use super::shell::counts;
use crate::experiment::store::Run;
use crate::experiment::trial::row::TouchRow;
use crate::report::axes;
use crate::report::axes::{Axis, Length};
use crate::report::relief::Space;
use crate::report::replay::{self, Grid, Replay};
use crate::report::style;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use palpate_explore::task::Zone;
use palpate_gp::batch::Prediction;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde_json::{Value, json};

/// Most places along the side of a curve and of a surface; chosen as what shows at the size of the
/// page.
const PLACES_MAX: [usize; 2] = [301, 41];
/// Bytes of one place in one frame: two for the mean, two for the deviation, in base 64.
const BYTES_OF_PLACE: usize = 6;
/// Room above and below the heights of a curve, for its bands, and of a surface; chosen.
const MARGIN: [f64; 2] = [0.3, 0.08];
/// Deviations smaller than this share of the largest are shown as that; chosen.
const LEAST_SHARE: f64 = 1e-4;

/// A belief on the grid, in metres.
struct Belief {
    touches: u32,
    score: String,
    /// None where no belief is drawn.
    means_m: Vec<Option<f64>>,
    deviations_m: Vec<f64>,
}

/// The data of the trial that the report draws, replayed, with the names of the planners in it and
/// the number of the first one's frames; lengths are in the unit of the page. `None` if there is
/// nothing to show.
pub(super) fn data(run: &Run) -> anyhow::Result<Option<(Value, Vec<&str>, usize)>> {
    let experiment = &run.experiment;
    let Some(zone) = &experiment.scene.zone else { return Ok(None) };
    let kind = zone.dimension() - 1;
    let names: Vec<&str> = experiment.planners.iter().map(String::as_str).collect();
    let heights_m = replay::heights_m(run, names.iter().copied());
    let Some(axis) = Axis::around(heights_m, MARGIN[kind], 5.0) else { return Ok(None) };
    let grid = Grid::new(run, zone.dimension(), PLACES_MAX[kind])?;
    let places: Vec<&[f64]> = grid.places().collect();
    let (first, last) = (experiment.initial_touches, experiment.touches);
    let touch_counts = counts(first, last, BYTES_OF_PLACE * names.len() * places.len());
    let mut beliefs = Vec::new();
    for &name in &names {
        let read = touch_counts.par_iter().map(|&count| belief(run, name, count, &places));
        let read: Vec<Option<Belief>> = read.collect::<anyhow::Result<_>>()?;
        let read: Vec<Belief> = read.into_iter().flatten().collect();
        if !read.is_empty() {
            beliefs.push((name, read));
        }
    }
    let all_m = || beliefs.iter().flat_map(|(_, read)| read).flat_map(|b| &b.deviations_m);
    let Some((least, most)) = axes::range(all_m().copied()) else { return Ok(None) };
    let (low, high) = axis.range();
    let span = high - low;
    let unit = Length::of(zone);
    // The ends of the codes of heights and of deviations, which are along their logarithm.
    let height_range_m = [low - span, high + span];
    let deviation_range_m = [least.max(LEAST_SHARE * most).max(f64::MIN_POSITIVE), most];
    let heights = |heights_m: &mut dyn Iterator<Item = Option<f64>>| {
        let [low, high] = height_range_m;
        encode(heights_m.map(|it| (it.unwrap_or(f64::NAN) - low) / (high - low)))
    };
    let deviations = |deviations_m: &[f64]| {
        let [least, most] = deviation_range_m;
        encode(deviations_m.iter().map(|it| (it / least).ln() / (most / least).ln()))
    };
    let in_unit = |ends: [f64; 2]| ends.map(|end| end * unit.per_m);
    let axis = |side: usize| -> Vec<f64> {
        grid.along(side).into_iter().map(|at_m| short(at_m * unit.per_m)).collect()
    };
    let stretch = zone
        .z_m
        .map(|z_m| Space { x_m: zone.x_m, z_m, height_m: [low, high] }.stretch())
        .unwrap_or(1.0);
    let touches = |name: &str| replay::row(run, name).map_or(&[][..], |row| &row.touches);
    let frame = |belief: &Belief| {
        json!({
            "touches": belief.touches,
            "score": belief.score,
            "mean": heights(&mut belief.means_m.iter().copied()),
            "deviation": deviations(&belief.deviations_m),
        })
    };
    let planner = |(name, read): &(&str, Vec<Belief>)| {
        let contacts = touches(name).iter().map(|touch| contact(zone, touch, unit));
        json!({
            "name": name,
            "colours": style::on_both(style::planner(&experiment.planners, name)),
            "contacts": contacts.collect::<Vec<_>>(),
            "frames": read.iter().map(frame).collect::<Vec<_>>(),
        })
    };
    let mut colours = style::touch_colours();
    colours["height"] = json!(style::HEIGHT);
    let data = json!({
        "unit": unit.symbol,
        "x": axis(0),
        "z": zone.z_m.map(|_| axis(1)),
        // The ends of the heights drawn, and how much they are stretched.
        "space": in_unit([low, high]),
        "stretch": stretch,
        "height_range": in_unit(height_range_m),
        "deviation_range": in_unit(deviation_range_m),
        "truth": heights(&mut grid.places.iter().map(|(_, height_m)| *height_m)),
        "initial_touches": experiment.initial_touches,
        "colours": colours,
        "planners": beliefs.iter().map(planner).collect::<Vec<_>>(),
    });
    let planners = beliefs.iter().map(|(name, _)| *name).collect();
    Ok(Some((data, planners, beliefs[0].1.len())))
}

fn belief(
    run: &Run,
    planner: &str,
    touches: u32,
    places: &[&[f64]],
) -> anyhow::Result<Option<Belief>> {
    let Some(replay) = Replay::new(run, planner, touches)? else { return Ok(None) };
    let predictions = replay.surface.predict(places.iter().copied());
    let known = replay.is_drawn(places.iter().copied());
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

/// A number with no more digits than show; one that is not finite becomes null in JSON.
pub fn short(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// Numbers from 0 to 1 as text: sixteen bits each, the lower eight first; the highest code is none.
pub fn encode(shares: impl Iterator<Item = f64>) -> String {
    let code = |share: f64| match share.is_nan() {
        true => u16::MAX,
        false => (65534.0 * share.clamp(0.0, 1.0)).round() as u16,
    };
    STANDARD.encode(shares.flat_map(|share| code(share).to_le_bytes()).collect::<Vec<u8>>())
}
