//! What a comparison of planners says in a scene, and what becomes of it in another.

use super::difference::{ALLOWED, Trials};
use super::yardstick::{FRESH, Need, Yardstick};
use crate::experiment::statistics::Paired;
use crate::experiment::truth::Truth;
use crate::experiment::{Experiment, Simulation};
use crate::explore::planner;
use crate::sim::{Environment, Scene};
use crate::study::fidelity::touches::MeasureError;
use crate::task::Target;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Test places along each side of the zone; chosen.
pub const GRID: usize = 31;

/// Targets that touches are timed on; chosen.
const TIMED: usize = 20;

/// RMSE of `active` minus that of `random`, m, trial by trial; none where one of them did not end.
pub fn advantages(
    environment: &Arc<Environment>,
    truth: &Truth,
    trials: Range<u32>,
    touches: u32,
) -> Vec<Option<f64>> {
    let planners = ["active", "random"].map(planner::by_name);
    let simulation = || {
        let names = ["active", "random"];
        let experiment = Experiment::on(environment.scene(), &names, trials.end, touches);
        Simulation::against(experiment, Arc::clone(environment), truth.clone()).ok()
    };
    let ([Some(active), Some(random)], true) = (planners, truth.is_known()) else {
        return Vec::new();
    };
    let Some(simulation) = simulation() else { return Vec::new() };
    let rmse_m = |planner, number| {
        let row = simulation.trial(planner, number);
        row.touches.last().and_then(|touch| Some(touch.metrics?.rmse_m))
    };
    let advantage = |number| Some(rmse_m(active, number)? - rmse_m(random, number)?);
    trials.into_par_iter().map(advantage).collect()
}

/// The mean of what there is, with its interval.
pub fn verdict(advantages: &[Option<f64>]) -> Option<Paired> {
    let pairs: Vec<_> = advantages.iter().flatten().map(|advantage| (*advantage, 0.0)).collect();
    Paired::new(&pairs, 0)
}

/// What a comparison says in another scene.
#[derive(Clone, Copy, Debug)]
pub struct Shift {
    /// RMSE of `active` minus that of `random` there, m.
    pub verdict: Paired,
    /// That less the same in the full scene, trial by trial.
    pub change: Paired,
}

/// Holds scenes against each other by what they say of `active` against `random`.
pub struct ByVerdict {
    truth: Truth,
    trials: Range<u32>,
    touches: u32,
    advantages: Vec<Option<f64>>,
    margin_m: Option<f64>,
    targets: Vec<Target>,
}

impl ByVerdict {
    /// Runs `trials` of each planner with `scene`, of `touches` each. A change by less than
    /// `margin_m` is none. Left out, it is the end of the interval that is nearest to zero: what
    /// changes by less cannot turn the verdict round.
    ///
    /// # Errors
    /// If the scene cannot be built.
    pub fn new(
        scene: &Scene,
        margin_m: Option<f64>,
        trials: Range<u32>,
        touches: u32,
    ) -> Result<Self, MeasureError> {
        let environment = Arc::new(Environment::build(scene.clone())?);
        let truth = Truth::sample(&environment, GRID);
        let advantages = advantages(&environment, &truth, trials.clone(), touches);
        let nearest = || match verdict(&advantages)?.interval? {
            [low, high] if low > 0.0 || high < 0.0 => Some(low.abs().min(high.abs())),
            _ => None,
        };
        let margin_m = margin_m.or_else(nearest);
        let targets = Trials::new(scene, TIMED, trials.start.into()).targets();
        Ok(Self { truth, trials, touches, advantages, margin_m, targets })
    }

    /// What the comparison says in the full scene; none if no trial of it ended.
    pub fn verdict(&self) -> Option<Paired> {
        verdict(&self.advantages)
    }

    /// Largest change of the verdict that is none; none where nothing was said and nobody won.
    pub fn margin_m(&self) -> Option<f64> {
        self.margin_m
    }
}

impl Yardstick for ByVerdict {
    type Off = Shift;

    fn off(&self, scene: &Scene) -> Result<Option<Shift>, MeasureError> {
        let environment = Arc::new(Environment::build(scene.clone())?);
        let there = advantages(&environment, &self.truth, self.trials.clone(), self.touches);
        let pairs: Vec<(f64, f64)> =
            there.iter().zip(&self.advantages).filter_map(|(a, b)| (*a).zip(*b)).collect();
        let ended = self.advantages.iter().flatten().count() as f64;
        if (pairs.len() as f64) < (1.0 - ALLOWED) * ended {
            return Ok(None);
        }
        let shift = |verdict, change| Shift { verdict, change };
        Ok(verdict(&there).zip(Paired::new(&pairs, 0)).map(|(there, change)| shift(there, change)))
    }

    fn need(&self, off: &Shift) -> Need {
        Need::of_change(off.change.interval, self.margin_m)
    }

    fn fresh(&self, full: &Scene, count: usize) -> Result<Self, MeasureError> {
        let first = FRESH as u32;
        Self::new(full, self.margin_m, first..first + count as u32, self.touches)
    }

    fn timed(&self) -> Vec<Target> {
        self.targets.clone()
    }
}
