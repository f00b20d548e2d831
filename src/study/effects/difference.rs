//! How far touches of one scene are from those of another: the same targets in the same trials,
//! with sensors without noise, so that what differs is the model.

use super::share::Share;
use super::yardstick::{FRESH, Need, Yardstick};
use crate::experiment::statistics::median;
use crate::sim::{Environment, Scene};
use crate::study::fidelity::reference_load::noise_free;
use crate::study::fidelity::rung_result::electrode_rms_counts;
use crate::study::fidelity::tolerance::{Quantity, Tolerance};
use crate::study::fidelity::touches::{MeasureError, Touches, targets, touch_once};
use crate::task::Target;
use rayon::prelude::*;
use std::sync::Arc;

/// Share of the touches that may be beyond a tolerance.
pub const ALLOWED: f64 = 0.05;

/// Touches of one trial: after so many a finger's heat and drift have shown; chosen.
const TOUCHES: usize = 10;

/// Trials with their targets, no target twice.
#[derive(Clone, Debug)]
pub struct Trials {
    targets: Vec<Vec<Target>>,
    first: u64,
}

impl Trials {
    /// `count` targets of the scene's zone in trials of ten, the first of which has number `first`.
    /// Another `first` is another sequence of targets.
    pub fn new(scene: &Scene, count: usize, first: u64) -> Self {
        let targets = targets(scene, count, first);
        Self { targets: targets.chunks(TOUCHES).map(<[_]>::to_vec).collect(), first }
    }

    /// All targets.
    pub fn targets(&self) -> Vec<Target> {
        self.targets.concat()
    }

    /// What touches of `scene` bring, trial by trial.
    ///
    /// # Errors
    /// If the scene cannot be built, or its body not be brought to its start.
    pub fn touch(&self, scene: &Scene) -> Result<Vec<Touches>, MeasureError> {
        let environment = Arc::new(Environment::build(noise_free(scene))?);
        let trials = self.targets.par_iter().enumerate();
        trials
            .map(|(i, targets)| {
                touch_once(&environment, targets, self.first + i as u64, &mut |_| true)
            })
            .filter_map(Result::transpose)
            .collect()
    }
}

/// Holds scenes against each other by their touches, of which 5 % may be beyond a tolerance.
pub struct ByTouches {
    tolerance: Tolerance,
    trials: Trials,
    touches: Vec<Touches>,
}

impl ByTouches {
    /// Touches `count` targets with `scene`, in trials from number `first` on.
    ///
    /// # Errors
    /// If it cannot be built.
    pub fn new(
        scene: &Scene,
        tolerance: Tolerance,
        (count, first): (usize, u64),
    ) -> Result<Self, MeasureError> {
        let trials = Trials::new(scene, count, first);
        let touches = trials.touch(scene)?;
        Ok(Self { tolerance, trials, touches })
    }
}

impl Yardstick for ByTouches {
    type Off = Difference;

    fn off(&self, scene: &Scene) -> Result<Option<Difference>, MeasureError> {
        Ok(Difference::of(&self.touches, &self.trials.touch(scene)?, &self.tolerance))
    }

    fn need(&self, off: &Difference) -> Need {
        match off.beyond.interval {
            [low, _] if low > ALLOWED => Need::Needed,
            [_, high] if high < ALLOWED => Need::NotNeeded,
            _ => Need::CannotTell,
        }
    }

    fn fresh(&self, full: &Scene, count: usize) -> Result<Self, MeasureError> {
        Self::new(full, self.tolerance, (count, FRESH))
    }

    fn timed(&self) -> Vec<Target> {
        self.trials.targets()
    }
}

/// How far touches are from others, against a tolerance.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Those beyond it.
    pub beyond: Share,
    /// 95 % are no farther off: m, N or counts; infinite if more than 5 % have nothing to compare.
    pub p95: f64,
    /// In the middle.
    pub median: f64,
}

impl Difference {
    /// None without touches.
    pub fn of(a: &[Touches], b: &[Touches], tolerance: &Tolerance) -> Option<Self> {
        let quantity = tolerance.quantity();
        let apart = a.iter().zip(b).map(|(a, b)| {
            (0..a.contacts.len()).map(|i| apart(quantity, a, b, i)).collect::<Vec<_>>()
        });
        let apart: Vec<Vec<f64>> = apart.collect();
        let mut sorted = apart.concat();
        sorted.sort_by(f64::total_cmp);
        let is_beyond =
            |trial: &Vec<f64>| trial.iter().map(|off| *off > tolerance.size()).collect();
        let beyond = Share::of(&apart.iter().map(is_beyond).collect::<Vec<_>>())?;
        let rank = ((1.0 - ALLOWED) * (sorted.len() - 1) as f64).ceil() as usize;
        Some(Self { beyond, p95: sorted[rank], median: median(&sorted)? })
    }
}

/// How far the `i`-th touch of `a` is from that of `b`: infinitely, if one of them lacks what is
/// compared.
fn apart(quantity: Quantity, a: &Touches, b: &Touches, i: usize) -> f64 {
    let loads = (&a.loads[i], &b.loads[i]);
    match quantity {
        Quantity::Contact => both(&a.contacts[i], &b.contacts[i], |a, b| (a.p_wc - b.p_wc).norm()),
        Quantity::Force => both(loads.0, loads.1, |a, b| (a.force_n - b.force_n).abs()),
        Quantity::Electrodes => both(loads.0, loads.1, |a, b| {
            let counts = (a.electrode_counts, b.electrode_counts);
            both(&counts.0, &counts.1, |_, _| electrode_rms_counts(a, b).unwrap_or(f64::INFINITY))
        }),
    }
}

fn both<T>(a: &Option<T>, b: &Option<T>, apart: impl Fn(&T, &T) -> f64) -> f64 {
    match (a, b) {
        (Some(a), Some(b)) => apart(a, b),
        (None, None) => 0.0,
        _ => f64::INFINITY,
    }
}
