//! The program around the command line: the binary, or one that runs it inside itself.

use palpate_explore::planner::PlannerFactory;

/// Makes the planner of an [own](palpate_explore::planner::is_own) name, or says why it cannot;
/// returns `None` if the program has no such planners.
pub type Bring<'a> = dyn Fn(&str) -> Option<anyhow::Result<Box<dyn PlannerFactory>>> + 'a;

/// The program that runs the command line.
pub struct Host<'a> {
    /// Commit that it was built from; "unknown" without a repository.
    pub commit: &'a str,
    /// Its own planners.
    pub bring: &'a Bring<'a>,
}
