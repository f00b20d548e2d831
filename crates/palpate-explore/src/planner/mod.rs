//! Planners: they select the next target from the belief alone.
//!
//! To add a planner, write its file here and add a line to [`PLANNERS`].

mod active;
pub mod candidates;
mod expected_contact;
mod grid;
mod information;
mod integrated_variance;
pub mod look;
mod object_information;
mod offer;
mod plan;
mod pose_information;
mod random;
mod random_strokes;
mod raster;
pub mod sample;
pub mod search;
pub mod settings;
mod silhouette;
mod slope;
mod sobol;
pub mod stroke;
mod travel;

pub use offer::{ActionKind, LookOffer, Offer, StrokeOffer};
pub use plan::{
    Fallback, Plan, PlanError, Planner, PlannerEntry, PlannerFactory, RefinedPlanner, zone_planner,
};
pub use sample::uniform;
pub use settings::PlanningSettings;

use crate::task::Region;

/// Lists the planners of some modules.
macro_rules! planners {
    ($($module:ident: $name:literal,)*) => {
        /// All built-in planners; add one line per planner.
        pub const PLANNERS: &[PlannerEntry] =
            &[$(PlannerEntry { name: $name, ..$module::ENTRY },)*];
    };
}

planners! {
    active: "active",
    random: "random",
    sobol: "sobol",
    grid: "grid",
    integrated_variance: "integrated_variance",
    silhouette: "silhouette",
    expected_contact: "expected_contact",
    slope: "slope",
    travel: "travel",
    random_strokes: "random_strokes",
    raster: "raster",
    information: "information",
    object_information: "object_information",
    pose_information: "pose_information",
}

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

/// Returns the planner of the initial touches: random places in a zone, evenly spread directions
/// around a whole object.
pub fn initial(region: &Region) -> Option<&'static PlannerEntry> {
    by_name(match region {
        Region::Zone(_) => "random",
        Region::Ball(_) => "sobol",
    })
}

/// Returns the factory of a built-in planner that is offered only some kinds of actions:
/// `active(tap, look)`. `None` for another name.
pub fn restricted(name: &str) -> Option<Box<dyn PlannerFactory>> {
    let (base, actions) = name.strip_suffix(')')?.split_once('(')?;
    let (entry, actions) = (by_name(base)?, ActionKind::parse(actions)?);
    Some(Box::new(plan::RestrictedPlanner { name: name.into(), entry, actions }))
}
