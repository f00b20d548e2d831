//! Planners: they select the next target from the belief alone.
//!
//! To add a planner, write its file here and add a line to [`PLANNERS`].

mod active;
pub mod candidates;
mod grid;
mod integrated_variance;
pub mod look;
mod plan;
mod random;
pub mod sample;
pub mod search;
pub mod settings;
mod silhouette;
mod slope;
mod sobol;
mod travel;
mod ucb;

pub use plan::{Fallback, Plan, PlanError, Planner, PlannerEntry, PlannerFactory, zone_planner};
pub use sample::uniform;
pub use settings::PlanningSettings;

/// All built-in planners; add one line per planner.
pub const PLANNERS: &[PlannerEntry] = &[
    active::ENTRY,
    random::ENTRY,
    sobol::ENTRY,
    grid::ENTRY,
    integrated_variance::ENTRY,
    silhouette::ENTRY,
    slope::ENTRY,
    travel::ENTRY,
    ucb::ENTRY,
];

/// Whether `name` names an external planner, `MODULE:NAME` or `MODULE:NAME(ARGUMENTS)`. An
/// experiment may list external planners: a program that runs it needs
/// [their factories](PlannerFactory), one that only reads it does not.
pub fn is_external(name: &str) -> bool {
    let is_plain = |c: char| c.is_alphanumeric() || "_.<>-".contains(c);
    let is_word = |word: &str| !word.is_empty() && word.chars().all(is_plain);
    name.split_once(':').is_some_and(|(module, name)| {
        let (word, arguments) = name.split_once('(').unwrap_or((name, ")"));
        let is_list = arguments.ends_with(')') && !arguments.contains(char::is_control);
        is_word(module) && is_word(word) && is_list
    })
}

/// Returns the planner with this name.
pub fn by_name(name: &str) -> Option<&'static PlannerEntry> {
    PLANNERS.iter().find(|entry| entry.name == name)
}
