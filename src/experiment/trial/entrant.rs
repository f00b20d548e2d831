//! Names that an experiment may list: those of planners, and the oracle's beside them.

use palpate_explore::planner::{PLANNERS, is_own};

/// Name of the oracle in an experiment's list of planners.
pub const ORACLE: &str = "oracle";

/// Each name that an experiment may list, with a line about it.
pub fn listed() -> impl Iterator<Item = (&'static str, &'static str)> {
    let oracle = "what lowers the true error most (looks at the truth: only to measure others by)";
    PLANNERS.iter().map(|entry| (entry.name, entry.about)).chain([(ORACLE, oracle)])
}

/// The names that may stand where `name` stands: those [`listed`], and `name` itself if it is that
/// of an [own](is_own) planner.
pub fn allowed(name: &str) -> Vec<&str> {
    listed().map(|(name, _)| name).chain(is_own(name).then_some(name)).collect()
}
