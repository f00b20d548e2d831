//! Interface to the program around the command line: the binary, or a program that embeds it.

use palpate_explore::planner::{self, PlannerFactory};

/// Loads the planner of an [external](palpate_explore::planner::is_external) name; returns `None`
/// if the program has no such planners.
pub type PlannerLoader<'a> = dyn Fn(&str) -> Option<anyhow::Result<Box<dyn PlannerFactory>>> + 'a;

/// The program that runs the command line.
pub struct Host<'a> {
    /// Commit of the build; "unknown" outside a repository.
    pub commit: &'a str,
    /// Loader of external planners.
    pub load_planner: &'a PlannerLoader<'a>,
}

impl Host<'_> {
    /// Loads the external planners among `names`; also returns the first error.
    pub(super) fn load_planners(
        &self,
        names: &[String],
    ) -> (Vec<Box<dyn PlannerFactory>>, Option<anyhow::Error>) {
        let own = names.iter().filter(|name| planner::is_external(name));
        let (own, failed): (Vec<_>, Vec<_>) =
            own.filter_map(|name| (self.load_planner)(name)).partition(Result::is_ok);
        (own.into_iter().flatten().collect(), failed.into_iter().find_map(Result::err))
    }
}
