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

struct Active {
    zone: Zone,
    settings: PlanningSettings,
    rng: ChaCha8Rng,
}

impl Planner for Active {
    fn plan(&mut self, belief: &Belief) -> Plan {
        let (lower, upper): (Vec<f64>, Vec<f64>) =
            self.zone.sides().map(|[low, high]| (low, high)).unzip();
        let bounds = Bounds { lower: &lower, upper: &upper };
        let mut scratch = Scratch::default();
        let found = optimize::direct(bounds, self.settings.direct_evaluations, |place| {
            belief.explorable_variance(place, &mut [], &mut scratch)
        });
        let climbed = optimize::lbfgs(
            bounds,
            &found.x,
            self.settings.lbfgs_evaluations,
            |place, gradient| belief.explorable_variance(place, gradient, &mut scratch),
        );
        let best = if climbed.value >= found.value { climbed } else { found };
        match self.stall(belief, &best.x, best.value) {
            None => Plan { target: best.x, sd_m: Some(best.value.sqrt()), stall: None },
            stall => {
                let target = uniform(&self.zone, &mut self.rng);
                let variance = belief.explorable_variance(&target, &mut [], &mut scratch);
                Plan { target, sd_m: Some(variance.sqrt()), stall }
            }
        }
    }
}

impl Active {
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
