//! A skin that answers with more or less force than its constants say.

use super::effect::{Effect, OnLoad};
use crate::config::{Checked, Rules};
use serde::{Deserialize, Serialize};

/// Table `[gain]`: a factor on the load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GainEffect {
    /// On force and torque.
    pub factor: f64,
}

impl Default for GainEffect {
    /// Chosen.
    fn default() -> Self {
        Self { factor: 1.1 }
    }
}

impl Checked for GainEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("factor", self.factor, 0.1..=10.0);
    }
}

impl Effect for GainEffect {
    type State = ();

    const ON_LOAD: Option<OnLoad<Self>> = Some(|effect, (), _, load| {
        load.force_n *= effect.factor;
        load.torque_nm *= effect.factor;
    });

    fn start(&self) {}
}
