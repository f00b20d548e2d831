//! The planner trait: selects the next target from the belief alone.

use super::settings::PlanningSettings;
use super::stroke::StrokeOffer;
use crate::belief::{Belief, HeightField};
use crate::task::Target;
use crate::view::Offer;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A planner: selects targets from the belief, without access to the ground truth.
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
/// This crate depends on no simulator and no ground truth, so a planner cannot access them.
pub trait Planner: Send {
    /// Returns the next target.
    ///
    /// # Errors
    /// If the planner returns no target; this ends the trial.
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError>;

    /// Returns the touch to make where this planner would tap at `target`, in a scene that allows
    /// strokes; by default the tap or stroke that [pays](super::stroke::worthwhile).
    fn stroke(&mut self, belief: &Belief, offer: &StrokeOffer, target: Target) -> Target {
        super::stroke::worthwhile(belief, offer, target)
    }

    /// Returns which of the `offers` of a camera to take before a touch at `target`, after which it
    /// plans anew; by default the one that [pays](super::look::worthwhile).
    fn look(&mut self, belief: &Belief, offers: &[Offer], target: &Target) -> Option<usize> {
        super::look::worthwhile(belief, offers, target)
    }
}

/// The choice of a planner.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Target of the touch.
    pub target: Target,
    /// Standard deviation at the target, if the planner computed it: the root of the belief's
    /// variance.
    pub sd_m: Option<f64>,
    /// Reason for a fallback to a random target, if there was one.
    pub fallback: Option<Fallback>,
}

impl Plan {
    /// A plan to touch `target`.
    pub fn at(target: impl Into<Target>) -> Self {
        Self { target: target.into(), sd_m: None, fallback: None }
    }
}

/// Reasons for another target than the planner's. Without an operator it is random, because a fixed
/// pattern might coincide with a pattern of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fallback {
    /// The variance at the best place is below rounding error.
    #[serde(alias = "collapsed")]
    NoVariance,
    /// The target would repeat an earlier one.
    #[serde(alias = "repeated")]
    DuplicateTarget,
    /// No approach to any candidate on a whole object is free.
    #[serde(alias = "blocked")]
    Unreachable,
    /// An operator chose another target.
    Operator,
}

/// Error of a planner that returned no target.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{reason}")]
pub struct PlanError {
    /// Complete message.
    pub reason: String,
}

impl From<&str> for PlanError {
    /// Creates the error from the planner's own message.
    fn from(message: &str) -> Self {
        Self { reason: format!("the planner returned no target: {message}") }
    }
}

impl<F: FnMut(&Belief) -> Result<Plan, PlanError> + Send> Planner for F {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        self(belief)
    }
}

/// Wraps a planner that supports zones only; it returns an error for a whole object.
pub fn zone_planner(
    mut plan: impl FnMut(&HeightField) -> Plan + Send + 'static,
) -> Box<dyn Planner> {
    Box::new(move |belief: &Belief| {
        Ok(plan(belief.height_field().ok_or("this planner supports zones only")?))
    })
}

/// A built-in planner.
pub struct PlannerEntry {
    /// Name in an experiment file.
    pub name: &'static str,
    /// One-line description for `--help`.
    pub about: &'static str,
    /// Reason why it supports zones only and no whole objects, if so.
    pub zone_only: Option<&'static str>,
    /// Whether it plans by hypotheses about the object, which need a library.
    pub needs_library: bool,
    /// Creates a planner; the generator is its only source of randomness.
    pub make: fn(&PlanningSettings, ChaCha8Rng) -> Box<dyn Planner>,
}

/// Factory of the planners of one name: a built-in [`PlannerEntry`], or one that a program adds to
/// its simulation.
pub trait PlannerFactory: Send + Sync {
    /// Name in an experiment's list; a name other than a built-in one's is an
    /// [external](super::is_external) planner's.
    fn name(&self) -> &str;

    /// Source text that determines the plans; its hash becomes part of a run's identity. `None` for
    /// planners compiled into the program, which the run's manifest names.
    fn source(&self) -> Option<String> {
        None
    }

    /// Reason why it does not support whole objects, if so.
    fn zone_only(&self) -> Option<&str> {
        None
    }

    /// Whether it only taps, where the scene allows strokes.
    fn taps(&self) -> bool {
        false
    }

    /// Creates a planner for a trial; the generator is its only source of randomness.
    fn make(&self, settings: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner>;
}

impl PlannerFactory for PlannerEntry {
    fn name(&self) -> &str {
        self.name
    }

    fn zone_only(&self) -> Option<&str> {
        self.zone_only
    }

    fn taps(&self) -> bool {
        self.name.ends_with("(taps)")
    }

    fn make(&self, settings: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner> {
        (self.make)(settings, random)
    }
}
