//! What a trial costs in instructions: counted and not timed, so that a busy machine counts the
//! same.

use super::judged::Verdict;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Share of a planner's instructions that may be lost; chosen: a counted trial is the same within a
/// thousandth.
pub const TOLERANCE: f64 = 0.02;

/// Instructions of one trial of each planner.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cost {
    /// Compiler, target and optimisation of the program, and what counted: numbers of others are
    /// not comparable.
    pub by: String,
    /// By planner.
    pub instructions: BTreeMap<String, u64>,
}

/// What is said of a planner.
#[derive(Clone, Debug, PartialEq)]
pub struct CostJudgement {
    /// Its name.
    pub planner: String,
    /// Instructions in the baseline and now; none where it is not there.
    pub instructions: [Option<u64>; 2],
    /// What is said of it.
    pub verdict: Verdict,
}

impl CostJudgement {
    /// The change as a share of what it was.
    pub fn change(&self) -> Option<f64> {
        let [old, new] = self.instructions;
        Some(new? as f64 / old? as f64 - 1.0)
    }
}

impl Cost {
    /// Planner by planner, where a share of `tolerance` may be lost; of numbers that are not
    /// comparable none is more than undecided.
    pub fn judge(&self, old: &Self, tolerance: f64) -> Vec<CostJudgement> {
        let mut names: Vec<&String> = old.instructions.keys().collect();
        names.extend(self.instructions.keys().filter(|name| !old.instructions.contains_key(*name)));
        let judged = names.into_iter().map(|name| {
            let instructions =
                [old, self].map(|cost| cost.instructions.get(name).copied().filter(|&it| it > 0));
            let mut said =
                CostJudgement { planner: name.clone(), instructions, verdict: Verdict::Missing };
            said.verdict = match (said.change(), instructions) {
                (Some(_), _) if self.by != old.by => Verdict::Undecided,
                (Some(change), _) if change > tolerance => Verdict::Worse,
                (Some(change), _) if change < -tolerance => Verdict::Better,
                (Some(_), _) => Verdict::Ok,
                (None, [None, Some(_)]) => Verdict::Undecided,
                (None, _) => Verdict::Missing,
            };
            said
        });
        judged.collect()
    }
}

/// The sum of a file that cachegrind wrote.
pub fn total(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("summary:"))?;
    line.split_whitespace().next()?.parse().ok()
}
