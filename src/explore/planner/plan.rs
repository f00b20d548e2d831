//! What a planner is: it sees the belief and the zone, and says where to touch.

use super::settings::PlanningSettings;
use crate::explore::belief::Belief;
use crate::gp::Posterior;
use crate::task::Zone;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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

    /// As [`plan`](Self::plan), with what few need: yardsticks look at the truth, and what runs
    /// another's code can fail.
    ///
    /// # Errors
    /// If it names no target, which ends the trial.
    fn decide(&mut self, belief: &Belief, _: &dyn Sight) -> Result<Plan, Undecided> {
        Ok(self.plan(belief))
    }
}

/// Why a planner named no target.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("the planner named no target: {reason}")]
pub struct Undecided {
    /// In its own words.
    pub reason: String,
}

/// The truth, as a yardstick sees it.
pub trait Sight {
    /// The belief with a touch at `target` taken in, not fitted again; none if nobody can tell how
    /// that would end.
    fn touched(&self, belief: &Belief, target: &[f64]) -> Option<Belief>;

    /// Root mean square error of a belief; none where nobody knows the truth.
    fn rmse_m(&self, belief: &Posterior) -> Option<f64>;
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

/// What makes the planners of one name: an [`Entry`], or what a program adds to its simulation.
pub trait Maker: Send + Sync {
    /// As in an experiment's list; if it is not that of an entry, it is an
    /// [own](super::is_own) one's.
    fn name(&self) -> &str;

    /// Makes one for a trial; the generator is its only randomness.
    fn make(
        &self,
        zone: &Zone,
        settings: &PlanningSettings,
        random: ChaCha8Rng,
    ) -> Box<dyn Planner>;
}

impl Maker for Entry {
    fn name(&self) -> &str {
        self.name
    }

    fn make(
        &self,
        zone: &Zone,
        settings: &PlanningSettings,
        random: ChaCha8Rng,
    ) -> Box<dyn Planner> {
        (self.make)(zone, settings, random)
    }
}

/// A uniformly random place of the zone.
pub fn uniform(zone: &Zone, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let fractions: Vec<f64> = (0..zone.dimension()).map(|_| rng.random()).collect();
    zone.at(&fractions)
}

/// Straight way along the zone from one place to another.
pub(super) fn distance_m(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
