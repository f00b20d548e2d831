//! The planner's trait: a planner gets the belief and nothing else, and chooses where to touch.

use super::settings::PlanningSettings;
use crate::belief::{Belief, HeightField};
use crate::task::Target;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Chooses targets. It is given the belief only: the ground truth is no part of it.
///
/// ```
/// use palpate_explore::belief::Belief;
/// use palpate_explore::planner::{Plan, PlanError, Planner};
///
/// struct Middle;
///
/// impl Planner for Middle {
///     fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
///         let field = belief.height_field().ok_or("it explores zones")?;
///         Ok(Plan::at(field.zone().at(&[0.5; 2])))
///     }
/// }
/// ```
///
/// A planner cannot ask for more: this crate knows no simulator and no truth.
pub trait Planner: Send {
    /// The next target.
    ///
    /// # Errors
    /// If it names none, which ends the trial.
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError>;
}

/// A planner's choice.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Where to touch.
    pub target: Target,
    /// Standard deviation there, if the planner looked at it: the root of
    /// the belief's variance.
    pub sd_m: Option<f64>,
    /// Why the planner's own rule could not decide, if it could not.
    pub stall: Option<Stall>,
}

impl Plan {
    /// To touch `target`.
    pub fn at(target: impl Into<Target>) -> Self {
        Self { target: target.into(), sd_m: None, stall: None }
    }
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
    /// Around an object: no way is free to anything that it would ask for.
    Blocked,
}

/// Why a planner named no target.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("the planner named no target: {reason}")]
pub struct PlanError {
    /// In its own words.
    pub reason: String,
}

impl From<&str> for PlanError {
    fn from(reason: &str) -> Self {
        Self { reason: reason.into() }
    }
}

impl<F: FnMut(&Belief) -> Result<Plan, PlanError> + Send> Planner for F {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        self(belief)
    }
}

/// A planner that explores zones only; around an object it names no target.
pub fn over_zone(mut plan: impl FnMut(&HeightField) -> Plan + Send + 'static) -> Box<dyn Planner> {
    Box::new(move |belief: &Belief| {
        Ok(plan(belief.height_field().ok_or("it explores zones only")?))
    })
}

/// A planner as an experiment file names it.
pub struct Entry {
    /// Its name.
    pub name: &'static str,
    /// One line for `--help`.
    pub about: &'static str,
    /// Why it explores zones only and cannot go around an object, if so.
    pub zone_only: Option<&'static str>,
    /// Makes one; the generator is its only randomness.
    pub make: fn(&PlanningSettings, ChaCha8Rng) -> Box<dyn Planner>,
}

/// Makes the planners of one name: an [`Entry`], or what a program adds to its simulation.
pub trait PlannerFactory: Send + Sync {
    /// As in an experiment's list; if it is not that of an entry, it is an
    /// [own](super::is_own) one's.
    fn name(&self) -> &str;

    /// The source text that decides its plans, whose hash becomes part of a run's identity; `None`
    /// for what is compiled into the program, which a run's manifest names.
    fn source(&self) -> Option<String> {
        None
    }

    /// Why it cannot go around a whole object, if it cannot.
    fn zone_only(&self) -> Option<&str> {
        None
    }

    /// Makes one for a trial; the generator is its only randomness.
    fn make(&self, settings: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner>;
}

impl PlannerFactory for Entry {
    fn name(&self) -> &str {
        self.name
    }

    fn zone_only(&self) -> Option<&str> {
        self.zone_only
    }

    fn make(&self, settings: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner> {
        (self.make)(settings, random)
    }
}
