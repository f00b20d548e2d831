//! Collisions between links, tool, object and table.

use super::effect::{Effect, Requirement};
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[collision]`: in the `dynamic` simulator, MuJoCo lets the links of the arm, the adapter
/// and the finger collide with each other and with a table. All but a soft finger also collide with
/// the object, with the geometry of `solver.collision`. Without this table they pass through each
/// other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CollisionEffect {
    /// Height of the table in `W`.
    pub table_m: f64,
}

impl Default for CollisionEffect {
    /// Returns the default: a table at the height of the arm's base.
    fn default() -> Self {
        Self { table_m: 0.0 }
    }
}

impl Validate for CollisionEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("table_m", self.table_m, -1e3..=1e3);
    }
}

impl Effect for CollisionEffect {
    type State = ();

    const REQUIRES: Requirement = Requirement::Nothing;
}
