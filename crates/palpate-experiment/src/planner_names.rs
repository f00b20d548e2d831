//! Names that an experiment may list: planners, the oracle, and a person.

use palpate_explore::planner::{PLANNERS, is_external, restricted};

/// Name of the oracle in an experiment's list of planners.
pub const ORACLE: &str = "oracle";

/// Name of a person who plans on the page of `palpate live`.
pub const HUMAN: &str = "human";

/// Planners that are not in the list of planners, each with a description.
const OTHERS: [(&str, &str); 2] = [
    (ORACLE, "reduces the true error most (uses the ground truth: an upper bound for comparison)"),
    (HUMAN, "a person, on the page of `palpate live`"),
];

/// Names that an experiment may list, each with a description.
pub fn known_planners() -> impl Iterator<Item = (&'static str, &'static str)> {
    PLANNERS.iter().map(|entry| (entry.name, entry.about)).chain(OTHERS)
}

/// Names allowed in place of `name`: the [`known_planners`], and `name` itself if it names an
/// [external](is_external) planner, or one that is offered some actions only: `active(tap)`.
pub fn allowed_names(name: &str) -> Vec<&str> {
    let is_other = is_external(name) || restricted(name).is_some();
    known_planners().map(|(name, _)| name).chain(is_other.then_some(name)).collect()
}
