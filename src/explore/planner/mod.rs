//! Where to touch next. A planner sees the belief and the zone and nothing else.
//!
//! To add a planner: write its file here and give it a line in [`PLANNERS`].

mod active;
mod ei;
mod grid;
mod improvement;
mod integrated_variance;
mod oracle;
mod pi;
mod plan;
mod random;
mod search;
pub mod settings;
mod silhouette;
mod slope;
mod sobol;
mod travel;
mod ucb;

pub use crate::explore::plan::{Plan, Stall, Undecided};
pub use plan::{Entry, MakeAround, Maker, Planner, Sight, uniform};
pub use settings::PlanningSettings;

/// Every planner; one line to add one.
pub const PLANNERS: &[Entry] = &[
    active::ENTRY,
    random::ENTRY,
    sobol::ENTRY,
    grid::ENTRY,
    integrated_variance::ENTRY,
    silhouette::ENTRY,
    slope::ENTRY,
    travel::ENTRY,
    ucb::ENTRY,
    pi::ENTRY,
    ei::ENTRY,
    oracle::ENTRY,
];

/// Name of the yardstick that looks at the truth; it needs to know how touches will end.
pub const ORACLE: &str = oracle::ENTRY.name;

/// Whether `name` is that of a planner that is not built in: `MODULE:NAME`. An experiment may list
/// such ones; what runs it must have [their makers](Maker), what reads it need not.
pub fn is_own(name: &str) -> bool {
    let is_plain = |c: char| c.is_alphanumeric() || "_.<>".contains(c);
    let is_word = |word: &str| !word.is_empty() && word.chars().all(is_plain);
    name.split_once(':').is_some_and(|(module, name)| is_word(module) && is_word(name))
}

/// The names that may stand where `name` stands: those of built-in planners, and `name` itself if
/// it is an [own](is_own) one.
pub fn allowed(name: &str) -> Vec<&str> {
    let built_in = PLANNERS.iter().map(|entry| entry.name);
    built_in.chain(is_own(name).then_some(name)).collect()
}

/// The planner called `name`.
pub fn by_name(name: &str) -> Option<&'static Entry> {
    PLANNERS.iter().find(|entry| entry.name == name)
}
