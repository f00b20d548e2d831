//! Interface to the program around the command line: the binary, or a program that embeds it.

use palpate_explore::planner::PlannerFactory;

/// Loads the planner of an [external](palpate_explore::planner::is_own) name; returns `None` if the
/// program has no such planners.
pub type PlannerLoader<'a> = dyn Fn(&str) -> Option<anyhow::Result<Box<dyn PlannerFactory>>> + 'a;

/// The program that runs the command line.
pub struct Host<'a> {
    /// Commit of the build; "unknown" outside a repository.
    pub commit: &'a str,
    /// Loader of external planners.
    pub load_planner: &'a PlannerLoader<'a>,
}
