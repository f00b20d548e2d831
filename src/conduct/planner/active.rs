//! Algorithm 1 of Yi et al. 2016: touch where the belief's standard deviation is largest.

use super::{Belief, Entry, Plan, Planner, PlanningSettings, Stall, uniform};
use crate::ground::gp::posterior::Scratch;
use crate::ground::optimize::{self, Bounds};
use crate::world::Zone;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: Entry = Entry {
    name: "active",
    about: "largest posterior standard deviation, by DIRECT then L-BFGS (the paper's)",
    make: |zone, settings, rng| {
        Box::new(Active { zone: zone.clone(), settings: settings.clone(), rng })
    },
};

/// Two targets nearer than this, in units of the zone's sides, are the same touch; chosen.
const SAME_TARGET: f64 = 1e-6;

/// Below this fraction of the signal's standard deviation, the posterior's is the rounding error
/// of a covariance with the least noise allowed; chosen.
const LOST_IN_ROUNDING: f64 = 1e-5;

/// Hills that L-BFGS climbs, see [`MARGIN`].
const HILLS: usize = 8;

/// DIRECT searches the zone with this fraction of its sides added all around, and what it asks
/// outside is answered from the nearest place inside: it divides from the middles of rectangles
/// and would reach the zone's border, where the variance often peaks, only in the limit. On 78
/// beliefs of the bird, 200 evaluations and one climb came within 2 % of the maximum on a dense
/// grid 23 times; with the margin and eight climbs 73 times, and 500 evaluations 76 times.
const MARGIN: f64 = 0.1;

/// Places nearer than this, in units of the zone's sides, are taken for the same hill; chosen.
const SAME_HILL: f64 = 0.04;

struct Active {
    zone: Zone,
    settings: PlanningSettings,
    rng: ChaCha8Rng,
}

impl Planner for Active {
    fn plan(&mut self, belief: &Belief) -> Plan {
        if belief.surface().is_none() {
            return Plan { target: uniform(&self.zone, &mut self.rng), sd_m: None, stall: None };
        }
        let mut scratch = Scratch::default();
        let mut seen: Vec<(f64, Vec<f64>)> = Vec::new();
        let (lower, upper) = self.corners(MARGIN);
        let budget = self.settings.direct_evaluations;
        optimize::direct(Bounds { lower: &lower, upper: &upper }, budget, |place| {
            let place = self.clamped(place);
            let variance = belief.explorable_variance(&place, &mut [], &mut scratch);
            seen.push((variance, place));
            variance
        });
        let (lower, upper) = self.corners(0.0);
        let bounds = Bounds { lower: &lower, upper: &upper };
        let mut best = (f64::MIN, Vec::new());
        for start in self.hills(seen) {
            let budget = self.settings.lbfgs_evaluations;
            let top = optimize::lbfgs(bounds, &start, budget, |place, gradient| {
                belief.explorable_variance(place, gradient, &mut scratch)
            });
            if top.value > best.0 {
                best = (top.value, top.x);
            }
        }
        let (variance, place) = best;
        match self.stall(belief, &place, variance) {
            None => Plan { target: place, sd_m: Some(variance.sqrt()), stall: None },
            stall => {
                let target = uniform(&self.zone, &mut self.rng);
                let variance = belief.explorable_variance(&target, &mut [], &mut scratch);
                Plan { target, sd_m: Some(variance.sqrt()), stall }
            }
        }
    }
}

impl Active {
    /// Lowest and highest corner of the zone, moved out by `margin` of its sides.
    fn corners(&self, margin: f64) -> (Vec<f64>, Vec<f64>) {
        let moved = |[low, high]: [f64; 2]| {
            let step = margin * (high - low);
            (low - step, high + step)
        };
        self.zone.sides().map(moved).unzip()
    }

    fn clamped(&self, place: &[f64]) -> Vec<f64> {
        place.iter().zip(self.zone.sides()).map(|(at, [low, high])| at.clamp(low, high)).collect()
    }

    /// The best places seen that are not next to a better one.
    fn hills(&self, mut seen: Vec<(f64, Vec<f64>)>) -> Vec<Vec<f64>> {
        seen.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut hills: Vec<Vec<f64>> = Vec::new();
        for (_, place) in seen {
            let is_apart = |hill: &Vec<f64>| self.zone.distance(hill, &place) > SAME_HILL;
            if hills.iter().all(is_apart) {
                hills.push(place);
            }
            if hills.len() == HILLS {
                break;
            }
        }
        hills
    }

    fn stall(&self, belief: &Belief, place: &[f64], variance: f64) -> Option<Stall> {
        let lost_sd = LOST_IN_ROUNDING * belief.surface()?.hyperparameters().signal_sd;
        let same = |target: &Vec<f64>| self.zone.distance(target, place) < SAME_TARGET;
        if variance <= lost_sd * lost_sd {
            Some(Stall::Collapsed)
        } else if belief.targets().iter().any(same) {
            Some(Stall::Repeated)
        } else {
            None
        }
    }
}
