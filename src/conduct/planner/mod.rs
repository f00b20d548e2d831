//! Where to touch next. A planner sees the belief and the zone and nothing else.

mod active;
mod random;
mod sobol;

use super::belief::Belief;
use crate::ground::config::{Checked, Rules};
use crate::world::Zone;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// A planner's choice.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The place to touch.
    pub target: Vec<f64>,
    /// Standard deviation there, if the planner looked at it: the root of
    /// [`Belief::explorable_variance`].
    pub sd_m: Option<f64>,
    /// Why the planner's own rule could not decide, if it could not.
    pub stall: Option<Stall>,
}

/// Why a planner's own rule could not decide; the target is then random, because any fixed
/// pattern may be just the one the surface hides behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stall {
    /// The belief is sure everywhere: where its maximum lies is rounding.
    Collapsed,
    /// The same target as before would have been asked for again.
    Repeated,
}

/// Chooses targets.
pub trait Planner: Send {
    /// The next target, inside the zone.
    fn plan(&mut self, belief: &Belief) -> Plan;
}

/// How planners search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlanningSettings {
    /// Evaluations of the acquisition function that DIRECT may spend on one plan.
    pub direct_evaluations: u32,
    /// Evaluations that L-BFGS may spend on refining it.
    pub lbfgs_evaluations: u32,
}

impl Default for PlanningSettings {
    /// Chosen: on a hundred touches more evaluations rarely find a larger variance.
    fn default() -> Self {
        Self { direct_evaluations: 500, lbfgs_evaluations: 50 }
    }
}

impl Checked for PlanningSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("direct_evaluations", self.direct_evaluations.into(), 1.0..=1e6);
        rules.number("lbfgs_evaluations", self.lbfgs_evaluations.into(), 1.0..=1e6);
    }
}

/// A planner as an experiment file names it.
pub struct Entry {
    /// Its name.
    pub name: &'static str,
    /// One line for `--help`.
    pub about: &'static str,
    /// Makes one; the generator is its only randomness.
    pub make: fn(&Zone, &PlanningSettings, ChaCha8Rng) -> Box<dyn Planner>,
}

/// Every planner; one line to add one.
pub const PLANNERS: &[Entry] = &[active::ENTRY, random::ENTRY, sobol::ENTRY];

/// The planner called `name`.
pub fn by_name(name: &str) -> Option<&'static Entry> {
    PLANNERS.iter().find(|entry| entry.name == name)
}

/// A uniformly random place of the zone.
pub fn uniform(zone: &Zone, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let fractions: Vec<f64> = (0..zone.dimension()).map(|_| rng.random()).collect();
    zone.at(&fractions)
}
