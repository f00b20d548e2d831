//! Interactive view of beliefs over a zone: values on a grid after many touch counts, in few bytes.

use super::{
    Counts, InteractiveView, LEAST_SHARE, PARTS, STROKES, counts, encode, encode_log, short,
    thinned,
};
use crate::experiment::row::TouchRow;
use crate::experiment::store::Run;
use crate::report::axes::{self, Axis, Length};
use crate::report::relief::Space;
use crate::report::replay::{self, BeliefReplay, Grid, drawn_caption};
use crate::report::style;
use palpate_explore::task::Zone;
use palpate_input::format::counted;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde_json::{Value, json};

/// Scripts of the view.
pub const SCRIPTS: [&str; 4] =
    [PARTS, include_str!("relief.js"), include_str!("curve.js"), include_str!("heights.js")];

/// Colour maps of a surface: names in scripts, and labels.
pub const COLOURS: [(&str, &str); 4] =
    [("height", "height"), ("deviation", "σ"), ("band", "95 % band"), ("error", "error")];

/// Returns the section as HTML; empty if no planner has a belief to show.
///
/// # Errors
/// If the recorded touches do not belong to the zone or cannot be conditioned on.
pub fn section(run: &Run) -> anyhow::Result<String> {
    let experiment = &run.experiment;
    let Some(zone) = &experiment.scene.zone else { return Ok(String::new()) };
    let places = PLACES_MAX[zone.dimension() - 1].min(experiment.grid as usize);
    let places = places.pow(zone.dimension() as u32);
    let bytes = BYTES_OF_PLACE * experiment.planners.len() * places;
    let counts = counts(experiment.first_fit(), experiment.touches, bytes);
    let Some(data) = data(run, &|_| counts.clone())? else { return Ok(String::new()) };
    let (class, colours, help) = match data["z"].is_null() {
        true => ("curve", &[][..], "Drag the slider, or press the arrow keys."),
        false => ("surface", &COLOURS[..], HELP),
    };
    let is_slid = run.rows.iter().flat_map(|row| &row.touches).any(TouchRow::is_stroke);
    let note = format!(
        "Trial {}. Blue: the {}; red: those of the planner; the last one is larger.{}{} \
         {help}",
        run.experiment.report.trial,
        counted(run.experiment.initial_touches, "initial touch"),
        if is_slid { STROKES } else { "" },
        drawn_caption(run)
    );
    Ok(InteractiveView { colours, has_truth: true, class, note, scripts: &SCRIPTS }.html(&data))
}

const HELP: &str = "Hollow touches lie behind the surface; diamonds are touches without contact. \
                    Green: the true surface in front of the belief. Mauve: believed to be out of the \
                    finger's reach. Lines join equal heights; the dark one is the silhouette. Drag the surface to turn it and the slider to step through the touches, or press the \
                    arrow keys.";

// Largest number of places along the side of a curve and of a surface.
// heuristic: more would not be visible at the size of the page.
const PLACES_MAX: [usize; 2] = [301, 41];
/// Bytes of one place in one frame: two each for mean, standard deviation and the ends of the band,
/// in base 64, and one for reach.
const BYTES_OF_PLACE: usize = 12;
// heuristic: margin above and below the heights of a curve, for its bands, and of a surface.
const MARGIN: [f64; 2] = [0.3, 0.08];

/// Belief on the grid, in metres.
pub struct HeightFrame {
    /// Number of touches.
    pub touches: u32,
    score: String,
    /// Means; `None` where no belief is drawn.
    pub means_m: Vec<Option<f64>>,
    /// Standard deviations.
    pub deviations_m: Vec<f64>,
    /// Ends of the 95 % band.
    bands_m: Vec<[f64; 2]>,
    /// Whether the finger can reach the believed surface.
    is_reachable: Vec<bool>,
}

impl HeightFrame {
    /// Reads a belief at `places`.
    pub fn of(replay: &BeliefReplay, places: &[&[f64]]) -> Self {
        let predictions = replay.surface.predict(places.iter().copied());
        let owned: Vec<Vec<f64>> = places.iter().map(|place| place.to_vec()).collect();
        let drawn = replay.is_drawn(places.iter().copied()).into_iter().zip(&predictions);
        Self {
            touches: replay.touches.len() as u32,
            score: replay.score(),
            means_m: drawn.map(|(is_drawn, it)| is_drawn.then_some(it.mean)).collect(),
            deviations_m: predictions.iter().map(|it| it.variance.sqrt()).collect(),
            bands_m: replay.belief.bands_m(&owned).unwrap_or_default(),
            is_reachable: replay.belief.is_reachable(&owned),
        }
    }
}

/// Returns the data of the view: beliefs of the drawn trial, replayed after the `counts` of touches
/// of each planner, with lengths in the unit of the page. `None` if there is nothing to show.
///
/// # Errors
/// If the recorded touches do not belong to the zone or cannot be conditioned on.
pub fn data(run: &Run, counts: &Counts) -> anyhow::Result<Option<Value>> {
    let experiment = &run.experiment;
    let Some(zone) = &experiment.scene.zone else { return Ok(None) };
    let kind = zone.dimension() - 1;
    let names = || experiment.planners.iter().map(String::as_str);
    let heights_m = replay::heights_m(run, names());
    let Some(axis) = Axis::around(heights_m, MARGIN[kind], 5.0) else { return Ok(None) };
    let grid = Grid::new(run, zone.dimension(), PLACES_MAX[kind])?;
    let places: Vec<&[f64]> = grid.places().collect();
    let mut beliefs = Vec::new();
    for name in names() {
        let frames = frames(run, name, &counts(name), &places)?;
        if !frames.is_empty() {
            beliefs.push((name, frames));
        }
    }
    let all = || beliefs.iter().flat_map(|(_, frames)| frames);
    let deviations_m = all().flat_map(|it| it.deviations_m.iter().copied());
    let widths_m = all().flat_map(|it| it.bands_m.iter().map(|[low, high]| high - low));
    let (Some(deviations_m), Some(bands_m)) = (log_range(deviations_m), log_range(widths_m)) else {
        return Ok(None);
    };
    let (low, high) = axis.range();
    let heights_m = [low - (high - low), high + (high - low)];
    let ranges = CodeRanges { heights_m, deviations_m };
    let unit = Length::of(zone);
    let in_unit = |ends: [f64; 2]| ends.map(|end| end * unit.per_m);
    let axis = |side: usize| -> Vec<f64> {
        grid.along(side).into_iter().map(|at_m| short(at_m * unit.per_m)).collect()
    };
    let space = zone.z_m.map(|z_m| Space { x_m: zone.x_m, z_m, height_m: [low, high] });
    let planner = |(name, frames): &(&str, Vec<HeightFrame>)| {
        let touches = replay::row(run, name).map_or(&[][..], |row| &row.touches);
        let contacts = touches.iter().map(|touch| contact(zone, touch, unit));
        json!({
            "name": name,
            "colours": style::light_and_dark(style::planner(&experiment.planners, name)),
            "contacts": contacts.collect::<Vec<_>>(),
            "paths": touches.iter().map(|touch| path(zone, touch, unit)).collect::<Vec<_>>(),
            "frames": frames.iter().map(|frame| ranges.frame(frame)).collect::<Vec<_>>(),
        })
    };
    Ok(Some(json!({
        "unit": unit.symbol,
        "per_m": unit.per_m,
        "x": axis(0),
        "z": zone.z_m.map(|_| axis(1)),
        // Range of the heights drawn, and their stretch.
        "space": in_unit([low, high]),
        "stretch": space.map_or(1.0, |space| space.stretch()),
        "height_range": in_unit(heights_m),
        "deviation_range": in_unit(deviations_m),
        "band_range": in_unit(bands_m),
        "truth": ranges.heights(grid.places.iter().map(|(_, height_m)| *height_m)),
        "initial_touches": experiment.initial_touches,
        "colours": style::touch_colours(),
        "planners": beliefs.iter().map(planner).collect::<Vec<_>>(),
    })))
}

/// Replays a planner's beliefs at `places` after the `counts` of touches that have one.
fn frames(
    run: &Run,
    planner: &str,
    counts: &[u32],
    places: &[&[f64]],
) -> anyhow::Result<Vec<HeightFrame>> {
    let frame = |&count: &u32| {
        let replay = BeliefReplay::new(run, planner, count)?;
        anyhow::Ok(replay.map(|replay| HeightFrame::of(&replay, places)))
    };
    let frames: Vec<Option<HeightFrame>> =
        counts.par_iter().map(frame).collect::<anyhow::Result<_>>()?;
    Ok(frames.into_iter().flatten().collect())
}

/// Ranges of the values that codes stand for.
struct CodeRanges {
    heights_m: [f64; 2],
    deviations_m: [f64; 2],
}

impl CodeRanges {
    fn heights(&self, heights_m: impl Iterator<Item = Option<f64>>) -> String {
        let [low, high] = self.heights_m;
        encode(heights_m.map(|it| (it.unwrap_or(f64::NAN) - low) / (high - low)))
    }

    /// Encodes a belief.
    fn frame(&self, frame: &HeightFrame) -> Value {
        let end = |end: usize| self.heights(frame.bands_m.iter().map(|ends| Some(ends[end])));
        let band = [0, 1].map(end);
        let reach: String =
            frame.is_reachable.iter().map(|&it| if it { '1' } else { '0' }).collect();
        json!({
            "touches": frame.touches,
            "score": frame.score,
            "mean": self.heights(frame.means_m.iter().copied()),
            "deviation": encode_log(self.deviations_m, frame.deviations_m.iter().copied()),
            "band": band,
            "reach": reach,
        })
    }
}

/// Returns the ends of the logarithmic scale of these lengths.
fn log_range(lengths_m: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let (least, most) = axes::range(lengths_m)?;
    Some([least.max(LEAST_SHARE * most).max(f64::MIN_POSITIVE), most])
}

/// Returns x, height and z of the points along a stroke, in the unit of the page; empty for a tap.
fn path(zone: &Zone, touch: &TouchRow, unit: Length) -> Vec<[Option<f64>; 3]> {
    let slid_w = touch.slid_w().unwrap_or_default();
    let point = |p_w| {
        let place = zone.place(p_w);
        let in_unit = |at_m: f64| short(at_m * unit.per_m);
        [place.first().copied(), Some(zone.height_m(p_w)), place.get(1).copied()]
            .map(|at_m| at_m.map(in_unit))
    };
    thinned(&slid_w).map(point).collect()
}

/// Returns x, height and z of a touch, in the unit of the page.
fn contact(zone: &Zone, touch: &TouchRow, unit: Length) -> (f64, Option<f64>, Option<f64>) {
    let met = replay::contact(zone, touch);
    let height = met.as_ref().map(|(_, height_m)| short(height_m * unit.per_m));
    let place = met.map_or_else(|| touch.target.numbers(), |(place, _)| place);
    let coordinate = |side: usize| place.get(side).map(|at| short(at * unit.per_m));
    (coordinate(0).unwrap_or(0.0), height, coordinate(1))
}
