//! What optimisers of this room have in common: they maximise in a box.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Why an optimiser returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// No more was to be won.
    Converged,
    /// The budget of evaluations was spent.
    Budget,
    /// Rounding errors kept it from going on; what it returns is the best it saw.
    Roundoff,
    /// It could not begin or broke off; what it returns is the best it saw.
    Failed,
}

/// Where an optimiser ended.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// The best point seen, inside the box.
    pub x: Vec<f64>,
    /// The objective there.
    pub value: f64,
    /// How often the objective was evaluated.
    pub evaluations: u32,
    /// Why it returned.
    pub stop: Stop,
}

/// A box `lower ≤ x ≤ upper` in as many dimensions as the slices are long.
#[derive(Clone, Copy, Debug)]
pub struct Bounds<'a> {
    /// Smallest coordinates.
    pub lower: &'a [f64],
    /// Largest coordinates.
    pub upper: &'a [f64],
}
