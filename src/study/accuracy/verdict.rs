//! The comparison of two planners in a scene, and whether a change of it matters.

use crate::experiment::statistics::Paired;
use crate::experiment::truth::Truth;
use crate::experiment::{Experiment, Simulation};
use crate::sim::{Environment, Scene};
use palpate_explore::planner;
use rayon::prelude::*;
use serde::Serialize;
use std::ops::Range;
use std::sync::Arc;

/// Test places along each side of the zone.
// heuristic: as many as experiments have.
const GRID: usize = 31;

/// Whether a scene needs an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Relevance {
    /// Switched, it deviates by more than the tolerance.
    Needed,
    /// It does not.
    NotNeeded,
    /// More touches or trials are needed.
    Undecided,
}

impl Relevance {
    /// Returns the relevance of a change with this 95 % interval: whether it lies within `margin`
    /// on both sides, or beyond it.
    pub fn of_change(interval: Option<[f64; 2]>, margin: Option<f64>) -> Self {
        match interval.zip(margin) {
            Some(([low, high], margin)) if low > -margin && high < margin => Self::NotNeeded,
            Some(([low, high], margin)) if low > margin || high < -margin => Self::Needed,
            _ => Self::Undecided,
        }
    }

    /// The words in tables.
    pub fn words(self) -> &'static str {
        match self {
            Self::Needed => "needed",
            Self::NotNeeded => "not needed",
            Self::Undecided => "undecided: more touches or trials",
        }
    }
}

/// RMSE of `active` minus that of `random`, m, trial by trial; `None` where one of them did not
/// end.
///
/// # Errors
/// If the scene cannot be built.
pub fn advantages_m(
    scene: &Scene,
    trials: Range<u32>,
    touches: u32,
) -> anyhow::Result<Vec<Option<f64>>> {
    let names = ["active", "random"];
    let ([Some(active), Some(random)], false) = (names.map(planner::by_name), trials.is_empty())
    else {
        return Ok(Vec::new());
    };
    let environment = Arc::new(Environment::build(scene.clone())?);
    let truth = Truth::sample(&environment, GRID, &|_| ());
    let experiment = Experiment::on(scene, &names, trials.end, touches);
    let is_known = truth.is_known();
    let Some(simulation) =
        Simulation::against(experiment, environment, truth).ok().filter(|_| is_known)
    else {
        return Ok(Vec::new());
    };
    let rmse_m = |planner, number| {
        let row = simulation.trial(planner, number);
        row.touches.last().and_then(|touch| Some(touch.metrics?.rmse_m))
    };
    let advantage = |number| Some(rmse_m(active, number)? - rmse_m(random, number)?);
    Ok(trials.into_par_iter().map(advantage).collect())
}

/// The mean of `a`, or of how much it is above `b` in those trials in which both are known.
pub fn difference(a: &[Option<f64>], b: Option<&[Option<f64>]>) -> Option<Paired> {
    let other = |i: usize| b.map_or(Some(0.0), |b| b[i]);
    let pairs = a.iter().enumerate().filter_map(|(i, a)| (*a).zip(other(i)));
    Paired::new(&pairs.collect::<Vec<_>>(), 0)
}
