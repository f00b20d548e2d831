//! When a trial ends before its last touch.

use palpate_explore::belief::Belief;
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Probability with which the claim of a stop holds, by the belief's own account.
pub const SURE: f64 = 0.95;

/// Table `[stop]`: a trial ends once one of these holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StopSettings {
    /// Bound of the RMSE within reach (95 %), m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_m: Option<f64>,
    /// Probability of an object.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object_probability: Option<f64>,
}

impl StopSettings {
    /// Whether a trial ends with this belief and bound of its RMSE.
    pub fn is_met(&self, belief: &Belief, rmse_bound_m: Option<f64>) -> bool {
        let is_sure = |least: f64| {
            let objects = belief.hypotheses().map(|it| it.class_probabilities());
            // The last is that of none of these.
            let objects = objects.as_deref().and_then(<[f64]>::split_last);
            objects.is_some_and(|(_, objects)| objects.iter().any(|it| *it >= least))
        };
        self.rmse_m.zip(rmse_bound_m).is_some_and(|(most_m, bound_m)| bound_m <= most_m)
            || self.object_probability.is_some_and(is_sure)
    }

    /// Returns the bound of the RMSE of `belief`, m, where a stop depends on it.
    pub fn rmse_bound_m(&self, belief: &Belief) -> Option<f64> {
        self.rmse_m.and_then(|_| belief.rmse_bound_m(SURE))
    }
}

impl Validate for StopSettings {
    fn check(&self, rules: &mut Rules) {
        rules.optional_number("rmse_m", self.rmse_m, 1e-9..=1.0);
        rules.optional_number("object_probability", self.object_probability, 0.01..=0.999_999);
    }
}
