//! What a planner around an object is.

use crate::explore::around::belief::Belief;
use crate::explore::around::surface::Surface;
use crate::explore::plan::{Plan, Stall, Undecided};
use crate::task::Aim;

/// Chooses aims.
pub trait Planner: Send {
    /// The next target: an [`Aim`] into the ball, as six numbers.
    fn plan(&mut self, belief: &Belief) -> Plan;

    /// As [`plan`](Self::plan), with what few need: yardsticks look at the truth, and what runs
    /// another's code can fail.
    ///
    /// # Errors
    /// If it names no target, which ends the trial.
    fn decide(&mut self, belief: &Belief, _: &dyn Sight) -> Result<Plan, Undecided> {
        Ok(self.plan(belief))
    }
}

/// The truth, as a yardstick sees it.
pub trait Sight {
    /// The belief with a touch at `aim` taken in, and conditioned on with what the last fit found;
    /// none if nobody can tell how that would end.
    fn touched(&self, belief: &Belief, aim: &Aim) -> Option<Belief>;

    /// Mean distance of the true surface from a believed one; none where nobody knows the truth.
    fn error_m(&self, surface: &Surface) -> Option<f64>;
}

/// A plan to go where a planner's own rule wants.
pub(super) fn decided(aim: &Aim, sd_m: Option<f64>) -> Plan {
    Plan { target: aim.target(), sd_m, stall: None }
}

/// A plan to go anywhere, since no way to what the rule wants is free.
pub(super) fn blocked(aim: &Aim) -> Plan {
    Plan { target: aim.target(), sd_m: None, stall: Some(Stall::Blocked) }
}
