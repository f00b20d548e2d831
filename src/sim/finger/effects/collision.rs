//! Links, tool, object and table in each other's way.

use super::effect::{Effect, Needs};
use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[collision]`: in a `dynamic` body MuJoCo lets the links of the arm, the adapter and the
/// finger collide with each other, with a table, and all but a soft finger with the object as
/// `solver.collision` says. Without it they pass through each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CollisionEffect {
    /// Height of the table in `W`.
    pub table_m: f64,
}

impl Default for CollisionEffect {
    /// The foot of the arm where that stands by default.
    fn default() -> Self {
        Self { table_m: 0.0 }
    }
}

impl Checked for CollisionEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("table_m", self.table_m, -1e3..=1e3);
    }
}

impl Effect for CollisionEffect {
    type State = ();

    const NEEDS: Needs = Needs::Nothing;
}
