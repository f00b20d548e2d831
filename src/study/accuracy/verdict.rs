//! Comparison of two planners in a scene, and the relevance of a change in it.

use super::touches::check;
use crate::experiment::metrics::truth::Truth;
use crate::experiment::statistics::PairedDifference;
use crate::experiment::{Experiment, Simulation};
use crate::sim::{Environment, Scene};
use palpate_explore::backend::Fault;
use palpate_explore::planner;
use rayon::prelude::*;
use serde::Serialize;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Test points along each side of the zone.
// heuristic: the default of experiments.
const GRID: usize = 31;

/// Relevance of an effect in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Relevance {
    /// Switching the effect exceeds the tolerance.
    Needed,
    /// Switching the effect stays within the tolerance.
    NotNeeded,
    /// More touches or trials are needed to decide.
    Undecided,
}

impl Relevance {
    /// Returns the relevance of a change with this 95 % interval: not needed if it lies within
    /// ±`margin`, needed if it lies beyond.
    pub fn of_change(interval: Option<[f64; 2]>, margin: Option<f64>) -> Self {
        match interval.zip(margin) {
            Some(([low, high], margin)) if low > -margin && high < margin => Self::NotNeeded,
            Some(([low, high], margin)) if low > margin || high < -margin => Self::Needed,
            _ => Self::Undecided,
        }
    }

    /// Text in tables.
    pub fn words(self) -> &'static str {
        match self {
            Self::Needed => "needed",
            Self::NotNeeded => "not needed",
            Self::Undecided => "undecided: use more touches or trials",
        }
    }
}

/// RMSE of `active` minus that of `random`, m, per trial; `None` if one of them failed.
///
/// # Errors
/// [`Interrupted`](super::touches::Interrupted) once `stop` is true; if the scene cannot be built.
pub fn paired_differences_m(
    scene: &Scene,
    trials: Range<u32>,
    touches: u32,
    stop: &AtomicBool,
) -> anyhow::Result<Vec<Option<f64>>> {
    let names = ["active", "random"];
    let ([Some(active), Some(random)], false) = (names.map(planner::by_name), trials.is_empty())
    else {
        return Ok(Vec::new());
    };
    let environment = Arc::new(Environment::build(scene.clone())?);
    let truth = Truth::sample(&environment, GRID, &|_| ());
    let experiment = Experiment::with_defaults(scene, &names, trials.end, touches);
    let is_known = truth.is_known();
    let Some(simulation) =
        Simulation::with_truth(experiment, environment, truth).ok().filter(|_| is_known)
    else {
        return Ok(Vec::new());
    };
    let rmse_m = |planner, number| {
        let mut probe = simulation.probe(number).ok()?;
        let row = simulation.trial_with(&mut *probe, planner, number, &mut |_| {
            check(stop).map(|()| None).map_err(|_| Fault::Stopped { time_s: 0.0 })
        });
        row.touches.last().and_then(|touch| Some(touch.metrics?.rmse_m))
    };
    let advantage = |number| Some(rmse_m(active, number)? - rmse_m(random, number)?);
    let differences_m = trials.into_par_iter().map(advantage).collect();
    check(stop)?;
    Ok(differences_m)
}

/// Mean of `a`, or of `a` minus `b` over the trials in which both are known.
pub fn difference(a: &[Option<f64>], b: Option<&[Option<f64>]>) -> Option<PairedDifference> {
    let other = |i: usize| b.map_or(Some(0.0), |b| b[i]);
    let pairs = a.iter().enumerate().filter_map(|(i, a)| (*a).zip(other(i)));
    PairedDifference::new(&pairs.collect::<Vec<_>>(), 0)
}
