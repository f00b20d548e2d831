//! What planners answer.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A planner's choice.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What to touch: a place of a zone, or six numbers that aim at an object from any side.
    pub target: Vec<f64>,
    /// Standard deviation there, if the planner looked at it: the root of
    /// the belief's variance.
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
    /// Around an object: no way is free to anything that it would ask for.
    Blocked,
}

/// Why a planner named no target.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("the planner named no target: {reason}")]
pub struct Undecided {
    /// In its own words.
    pub reason: String,
}
