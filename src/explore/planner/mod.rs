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

pub use plan::{Entry, Plan, Planner, Sight, Stall, uniform};
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

/// The planner called `name`.
pub fn by_name(name: &str) -> Option<&'static Entry> {
    PLANNERS.iter().find(|entry| entry.name == name)
}
