//! Settings of a run's report. They do not affect rows, so they may change on a finished run.

use crate::measure::MEASURES;
use crate::planner_names;
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of a run's report.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ReportSettings {
    /// Touch counts after which beliefs are drawn (default: three).
    pub touch_counts: Vec<u32>,
    /// Trial whose beliefs are drawn.
    pub trial: u32,
    /// Planners whose beliefs are drawn (default: all).
    pub planners: Vec<String>,
    /// Reference planners of the comparisons (default: `random` and `active` if they ran, otherwise
    /// every planner).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub baselines: Vec<String>,
    /// Number of touches of a baseline whose error is the goal of the others (default: all).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal_touches: Option<u32>,
    /// Published claims, shown on the page beside the results after the same number of touches.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub claims: Vec<Claim>,
}

/// A claim of a publication about an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Figure or section of the publication.
    pub source: String,
    /// Text of the claim.
    pub text: String,
    /// Number of touches after which it applies.
    pub touches: u32,
    /// Names of the measures that test it.
    pub measures: Vec<String>,
}

/// Maximum touches per trial.
pub(super) const TOUCHES_MAX: f64 = 20_000.0;

/// Maximum number of beliefs drawn side by side.
const DRAWN_MAX: usize = 8;

impl Validate for ReportSettings {
    fn check(&self, rules: &mut Rules) {
        let drawn = self.touch_counts.len();
        rules.require("touch_counts", drawn, drawn <= DRAWN_MAX, || {
            format!("at most {DRAWN_MAX} touch counts")
        });
        for (i, &count) in self.touch_counts.iter().enumerate() {
            rules.number(&format!("touch_counts[{i}]"), count.into(), 1.0..=TOUCHES_MAX);
        }
        for (key, names) in [("planners", &self.planners), ("baselines", &self.baselines)] {
            for (i, name) in names.iter().enumerate() {
                rules.one_of(&format!("{key}[{i}]"), name, &planner_names::allowed_names(name));
            }
        }
        rules.optional_number("goal_touches", self.goal_touches.map(f64::from), 1.0..=TOUCHES_MAX);
        let measures: Vec<&str> = MEASURES.iter().map(|measure| measure.id).collect();
        for (i, claim) in self.claims.iter().enumerate() {
            let key = |field: &str| format!("claims[{i}].{field}");
            rules.number(&key("touches"), claim.touches.into(), 1.0..=TOUCHES_MAX);
            for (j, name) in claim.measures.iter().enumerate() {
                rules.one_of(&key(&format!("measures[{j}]")), name, &measures);
            }
        }
    }
}
