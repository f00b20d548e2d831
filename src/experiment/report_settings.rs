//! What the report of a run shows. It decides no row, so it may change on a finished run.

use crate::experiment::measure::MEASURES;
use crate::experiment::trial::entrant;
use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the report shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ReportSettings {
    /// Touch counts after which beliefs are drawn, those that occur; none: a third, two thirds
    /// and all of the planned touches.
    pub touch_counts: Vec<u32>,
    /// The trial whose beliefs are drawn.
    pub trial: u32,
    /// The planners whose beliefs are drawn, those that ran; none: all.
    pub planners: Vec<String>,
    /// The planners that the others are held against, those that ran; none: `random` and
    /// `active` if they ran, or else every planner is held against every other.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub baselines: Vec<String>,
    /// Touches of a baseline whose error the others are asked to reach, if it makes as many; none:
    /// all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal_touches: Option<u32>,
    /// What a publication says, to stand on the page beside what comes out here; those after touch
    /// counts that occur.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub claims: Vec<Claim>,
}

/// What a publication says of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Where: its figure or section.
    pub place: String,
    /// What, in words.
    pub says: String,
    /// The count of touches after which it can be seen.
    pub touches: u32,
    /// Names of the measures that show it.
    pub measures: Vec<String>,
}

/// Most touches of a trial.
pub(super) const TOUCHES_MAX: f64 = 20_000.0;

/// Most beliefs drawn side by side.
const DRAWN_MAX: usize = 8;

impl Checked for ReportSettings {
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
                rules.one_of(&format!("{key}[{i}]"), name, &entrant::allowed(name));
            }
        }
        rules.given("goal_touches", self.goal_touches.map(f64::from), 1.0..=TOUCHES_MAX);
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
