//! Where to touch next. A planner sees the belief and the zone and nothing else.

mod active;
mod ei;
mod grid;
mod improvement;
mod integrated_variance;
mod pi;
mod random;
mod search;
pub mod settings;
mod slope;
mod sobol;
mod travel;
mod ucb;

pub use settings::PlanningSettings;

use super::belief::Belief;
use crate::task::Zone;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use search::Search;
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
    /// The belief is sure of the best place: that it is the best one is rounding.
    Collapsed,
    /// The same target as before would have been asked for again.
    Repeated,
}

/// Chooses targets.
pub trait Planner: Send {
    /// The next target, inside the zone.
    fn plan(&mut self, belief: &Belief) -> Plan;
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
pub const PLANNERS: &[Entry] = &[
    active::ENTRY,
    random::ENTRY,
    sobol::ENTRY,
    grid::ENTRY,
    integrated_variance::ENTRY,
    slope::ENTRY,
    travel::ENTRY,
    ucb::ENTRY,
    pi::ENTRY,
    ei::ENTRY,
];

/// The planner called `name`.
pub fn by_name(name: &str) -> Option<&'static Entry> {
    PLANNERS.iter().find(|entry| entry.name == name)
}

/// A uniformly random place of the zone.
pub fn uniform(zone: &Zone, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let fractions: Vec<f64> = (0..zone.dimension()).map(|_| rng.random()).collect();
    zone.at(&fractions)
}
