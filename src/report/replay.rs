//! Replay of beliefs: a recorded trial's touches and hyperparameters, conditioned again.

use crate::experiment::Experiment;
use crate::experiment::metrics::Metrics;
use crate::experiment::row::{TouchRow, TrialRow};
use crate::experiment::store::Run;
use crate::report::canvas::{Canvas, PointPx};
use crate::report::style;
use crate::report::table::digits;
use anyhow::ensure;
use palpate_explore::belief::HeightField;
use palpate_explore::task::Zone;
use palpate_gp::Posterior;

/// Text of the score of a missing belief.
pub const NO_BELIEF: &str = "not reached in this trial";

/// Belief of one planner after some touches of the drawn trial.
pub struct BeliefReplay<'a> {
    /// Belief.
    pub belief: HeightField,
    /// Posterior of the surface.
    pub surface: Posterior,
    /// Agreement with the truth.
    pub metrics: Option<Metrics>,
    /// Touches so far.
    pub touches: &'a [TouchRow],
    /// Next touch.
    pub next: Option<&'a TouchRow>,
    initial_touches: usize,
}

impl<'a> BeliefReplay<'a> {
    /// Replays the belief of `planner` after `count` touches; `None` if the trial is missing, ended
    /// before, or had no fit then.
    ///
    /// # Errors
    /// If the recorded touches do not belong to the zone or cannot be conditioned on.
    pub fn new(run: &'a Run, planner: &str, count: u32) -> anyhow::Result<Option<Self>> {
        row(run, planner).map_or(Ok(None), |row| Self::of(&run.experiment, row, count))
    }

    /// Replays the belief of a trial's `row` after `count` touches, as [`BeliefReplay::new`].
    ///
    /// # Errors
    /// If the recorded touches do not belong to the zone or cannot be conditioned on.
    pub fn of(
        experiment: &Experiment,
        row: &'a TrialRow,
        count: u32,
    ) -> anyhow::Result<Option<Self>> {
        let Some(touches) = row.touches.get(..count as usize) else { return Ok(None) };
        let Some(last) = touches.last() else { return Ok(None) };
        let belief = row.belief(experiment, count)?;
        let Some(belief) = belief.as_ref().and_then(|belief| belief.height_field()).cloned() else {
            return Ok(None);
        };
        let Some(surface) = belief.surface().cloned() else { return Ok(None) };
        Ok(Some(Self {
            belief,
            surface,
            metrics: last.metrics,
            touches,
            next: row.touches.get(count as usize),
            initial_touches: experiment.initial_touches as usize,
        }))
    }

    /// Returns every touch with its colour.
    pub fn marks(&self) -> impl Iterator<Item = (&TouchRow, &'static str)> {
        marks(self.touches, self.initial_touches)
    }

    /// Returns the agreement with the truth as text.
    pub fn score(&self) -> String {
        self.metrics.map_or(String::new(), |metrics| {
            let centred = format!("{:.4}", metrics.centred_r).replace('-', "−");
            let rmse_mm = digits(1e3 * metrics.rmse_m);
            format!("RMSE {rmse_mm} mm, R {:.4}, centred {centred}", metrics.r)
        })
    }

    /// Returns whether the belief is drawn at each of `places`: a Gaussian process has a value
    /// everywhere, also where the zone reaches past the object.
    pub fn is_drawn<'p>(&self, places: impl IntoIterator<Item = &'p [f64]>) -> Vec<bool> {
        self.belief.surface_evidence().silhouette().is_likely(places)
    }

    /// Draws the touches on a flat panel: a cross for a contact, a diamond of this stroke width for
    /// a miss; `at` maps a place, and a height if there is one.
    pub fn draw_marks(
        &self,
        canvas: &mut Canvas,
        width: f64,
        at: impl Fn(&[f64], Option<f64>) -> PointPx,
    ) {
        for (touch, colour) in self.marks() {
            match contact(self.belief.zone(), touch) {
                Some((place, height_m)) => canvas.cross(at(&place, Some(height_m)), colour),
                None => {
                    let at = at(&touch.target.numbers(), None);
                    canvas.diamond(at, &style::stroke(colour, width));
                }
            }
        }
    }
}

/// Returns touches, the first `initial` of which all planners share, with their colours.
pub fn marks(
    touches: &[TouchRow],
    initial: usize,
) -> impl Iterator<Item = (&TouchRow, &'static str)> {
    touches.iter().enumerate().map(move |(i, touch)| (touch, style::touch(i < initial)))
}

/// Returns where the paper shows such a figure, for a run beside its claims.
pub fn in_paper(run: &Run, figure: &str) -> String {
    match run.experiment.report.claims.is_empty() {
        true => String::new(),
        false => format!(" Corresponds to {figure} of Yi et al. 2016."),
    }
}

/// Returns a sentence of a caption on where beliefs are drawn; empty if the surface is everywhere.
pub fn drawn_caption(run: &Run) -> &'static str {
    match run.truth.surface_count() < run.truth.places.len() {
        true => {
            " A belief is drawn where a surface is more probable than none, or everywhere while every \
             touch has made contact."
        }
        false => "",
    }
}

/// Subset of the test grid, evenly spaced along each side, x varying fastest.
pub struct Grid<'a> {
    /// Places along each side.
    pub side: usize,
    /// Places, with the true height at each.
    pub places: Vec<(&'a [f64], Option<f64>)>,
    /// Whether the finger can reach the true surface at each place.
    pub is_reachable: Vec<bool>,
}

impl<'a> Grid<'a> {
    /// Creates a grid of at most `most` places along each side of a zone of this dimension.
    ///
    /// # Errors
    /// If the truth is not on the experiment's grid.
    pub fn new(run: &'a Run, dimension: usize, most: usize) -> anyhow::Result<Self> {
        let (side, truth) = (run.experiment.grid as usize, &run.truth);
        ensure!(
            side > 1 && truth.places.len() == side.pow(dimension as u32),
            "the true surface has {} places, but the experiment's grid has {side} along each side",
            truth.places.len()
        );
        let steps = (side - 1).min(most - 1);
        let picked: Vec<usize> = (0..=steps).map(|i| i * (side - 1) / steps).collect();
        let rows = if dimension == 1 { &[0][..] } else { &picked };
        let indices = || rows.iter().flat_map(|j| picked.iter().map(move |i| j * side + i));
        let at = |index: usize| (truth.places[index].as_slice(), truth.heights_m[index]);
        Ok(Self {
            side: picked.len(),
            places: indices().map(at).collect(),
            is_reachable: indices().map(|index| truth.is_reachable[index]).collect(),
        })
    }

    /// Returns the places without their heights.
    pub fn places(&self) -> impl Iterator<Item = &'a [f64]> {
        self.places.iter().map(|(place, _)| *place)
    }

    /// Returns the coordinates along one side.
    pub fn along(&self, side: usize) -> Vec<f64> {
        let step = if side == 0 { 1 } else { self.side };
        (0..self.side).map(|i| self.places[i * step].0[side]).collect()
    }
}

/// Returns the row of a planner in the drawn trial.
pub fn row<'a>(run: &'a Run, planner: &str) -> Option<&'a TrialRow> {
    let trial = run.experiment.report.trial;
    run.rows.iter().find(|row| row.planner == planner && row.trial == trial)
}

/// Returns the place (x) or (x, z) of a touch and its height above the datum; `None` for a miss.
pub fn contact(zone: &Zone, touch: &TouchRow) -> Option<(Vec<f64>, f64)> {
    let p_wc = touch.contact()?;
    Some((zone.place(&p_wc), zone.height_m(&p_wc)))
}

/// Returns every height that a drawing of beliefs of `planners` must show: true and touched
/// heights.
pub fn heights_m<'a>(
    run: &'a Run,
    planners: impl IntoIterator<Item = &'a str>,
) -> impl Iterator<Item = f64> {
    let touched = planners
        .into_iter()
        .filter_map(move |planner| row(run, planner))
        .flat_map(|row| &row.touches)
        .filter_map(move |touch| Some(contact(run.experiment.scene.zone.as_ref()?, touch)?.1));
    run.truth.heights_m.iter().flatten().copied().chain(touched)
}
