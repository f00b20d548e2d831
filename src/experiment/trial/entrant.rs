//! Entrants of an experiment: planners, and the oracle beside them.

use crate::experiment::trial::oracle::{GroundTruth, Oracle};
use palpate_explore::planner::{
    Entry, PLANNERS, Planner, PlannerFactory, PlanningSettings, is_own,
};
use rand_chacha::ChaCha8Rng;

/// Name of the oracle in an experiment's list of planners.
pub const ORACLE: &str = "oracle";

/// Each name that an experiment may list, with a line about it.
pub fn listed() -> impl Iterator<Item = (&'static str, &'static str)> {
    let oracle = "what lowers the true error most (looks at the truth: only to measure others by)";
    PLANNERS.iter().map(|entry| (entry.name, entry.about)).chain([(ORACLE, oracle)])
}

/// The names that may stand where `name` stands: those [`listed`], and `name` itself if it is that
/// of an [own](is_own) planner.
pub fn allowed(name: &str) -> Vec<&str> {
    listed().map(|(name, _)| name).chain(is_own(name).then_some(name)).collect()
}

/// A planner or the oracle.
#[derive(Clone, Copy)]
pub enum Entrant<'a> {
    /// A planner, which sees the belief.
    Planner(&'a dyn PlannerFactory),
    /// The oracle, which sees the ground truth.
    Oracle,
}

impl<'a> Entrant<'a> {
    /// Its name in an experiment's list.
    pub fn name(&self) -> &'a str {
        match *self {
            Self::Planner(factory) => factory.name(),
            Self::Oracle => ORACLE,
        }
    }

    /// Why it cannot go around a whole object, if it cannot.
    pub(super) fn zone_only(&self) -> Option<&'a str> {
        match *self {
            Self::Planner(factory) => factory.zone_only(),
            Self::Oracle => None,
        }
    }

    /// Makes the planner of one trial; only the oracle is given the truth.
    pub(super) fn make<'t>(
        &self,
        settings: &PlanningSettings,
        random: ChaCha8Rng,
        truth: &'t GroundTruth,
    ) -> Box<dyn Planner + 't> {
        match self {
            Self::Planner(factory) => factory.make(settings, random),
            Self::Oracle => Box::new(Oracle::new(settings, random, truth)),
        }
    }
}

impl<'a> From<&'a Entry> for Entrant<'a> {
    fn from(entry: &'a Entry) -> Self {
        Self::Planner(entry)
    }
}

impl<'a> From<&'a dyn PlannerFactory> for Entrant<'a> {
    fn from(factory: &'a dyn PlannerFactory) -> Self {
        Self::Planner(factory)
    }
}
