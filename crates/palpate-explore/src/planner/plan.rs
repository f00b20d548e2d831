//! The planner trait: selects the next target from the belief alone.

use super::offer::{ActionKind, Offer};
use super::settings::PlanningSettings;
use super::{look, stroke};
use crate::belief::Belief;
use crate::task::{Target, Zone};
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A planner: selects targets from the belief, without access to the ground truth.
///
/// ```
/// use palpate_explore::belief::Belief;
/// use palpate_explore::planner::{Offer, Plan, PlanError, Planner};
///
/// struct Middle;
///
/// impl Planner for Middle {
///     fn plan(&mut self, belief: &Belief, _offer: &Offer) -> Result<Plan, PlanError> {
///         let region = belief.region();
///         let zone = region.zone().ok_or("it explores zones")?;
///         Ok(Plan::at(zone.at(&[0.5; 2])))
///     }
/// }
/// ```
///
/// This crate depends on no simulator and no ground truth, so a planner cannot access them.
pub trait Planner: Send {
    /// Returns the next target: a touch, or a stroke or look of the `offer`.
    ///
    /// # Errors
    /// If the planner returns no target; this ends the trial.
    fn plan(&mut self, belief: &Belief, offer: &Offer) -> Result<Plan, PlanError>;
}

/// Planner whose taps are replaced by the look or stroke on offer that pays: one that reduces the
/// variance over the surface more per time.
pub struct RefinedPlanner<P>(pub P);

impl<P: Planner> Planner for RefinedPlanner<P> {
    fn plan(&mut self, belief: &Belief, offer: &Offer) -> Result<Plan, PlanError> {
        let mut plan = self.0.plan(belief, offer)?;
        if let Some(look) = look::best(belief, offer, &plan.target) {
            return Ok(Plan::at(Target::Look { camera: look.number }));
        }
        if let Some(strokes) = &offer.stroke {
            plan.target = stroke::best(belief, strokes, plan.target);
        }
        Ok(plan)
    }
}

impl Planner for Box<dyn Planner> {
    fn plan(&mut self, belief: &Belief, offer: &Offer) -> Result<Plan, PlanError> {
        (**self).plan(belief, offer)
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
    fn plan(&mut self, belief: &Belief, _offer: &Offer) -> Result<Plan, PlanError> {
        self(belief)
    }
}

/// Wraps a planner that supports zones only; it returns an error for a whole object.
pub fn zone_planner(
    mut plan: impl FnMut(&Belief, &Zone) -> Plan + Send + 'static,
) -> Box<dyn Planner> {
    Box::new(move |belief: &Belief| {
        let region = belief.region();
        Ok(plan(belief, region.zone().ok_or("this planner supports zones only")?))
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
    /// Whether it plans strokes itself; otherwise its taps are [`RefinedPlanner`].
    pub plans_strokes: bool,
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

    /// Kinds of actions that it is offered.
    fn actions(&self) -> &[ActionKind] {
        &ActionKind::ALL
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

    fn make(&self, settings: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner> {
        let planner = (self.make)(settings, random);
        if self.plans_strokes { planner } else { Box::new(RefinedPlanner(planner)) }
    }
}

/// A built-in planner that is offered some kinds of actions only.
pub(super) struct RestrictedPlanner {
    pub name: String,
    pub entry: &'static PlannerEntry,
    pub actions: Vec<ActionKind>,
}

impl PlannerFactory for RestrictedPlanner {
    fn name(&self) -> &str {
        &self.name
    }

    fn zone_only(&self) -> Option<&str> {
        self.entry.zone_only
    }

    fn actions(&self) -> &[ActionKind] {
        &self.actions
    }

    fn make(&self, settings: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner> {
        self.entry.make(settings, random)
    }
}
