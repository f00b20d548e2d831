//! What a program that runs this one inside itself adds to it.

use crate::explore::planner::PlannerFactory;

/// Brings the planner of an [own](crate::explore::planner::is_own) name, or says why it cannot;
/// none if the program has no such planners.
pub type Bring<'a> = dyn Fn(&str) -> Option<anyhow::Result<Box<dyn PlannerFactory>>> + 'a;
