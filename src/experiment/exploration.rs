//! What a trial does between touches, whatever is explored: believe, plan, be compared.

use super::row::{TouchRow, VerificationRows};
use crate::explore::around;
use crate::explore::belief;
use crate::explore::plan::{Plan, Undecided};
use crate::explore::probe::{Probe, Swept, Touch};
use crate::gp::covariance::CovarianceError;
use crate::task::Approach;

/// What is known in a trial.
#[derive(Clone, Copy)]
pub enum Known<'a> {
    /// Of one side of an object.
    Zone(&'a belief::Belief),
    /// Of a whole one.
    Around(&'a around::Belief),
}

/// One trial's belief and planner.
pub(super) trait Exploration {
    /// One of the touches that every planner starts with.
    fn start(&mut self) -> Plan;

    /// What the planner asks for.
    ///
    /// # Errors
    /// If it names no target.
    fn decide(&mut self) -> Result<Plan, Undecided>;

    /// Takes in a touch.
    fn observe(
        &mut self,
        target: &[f64],
        approach: &Approach,
        touch: &Touch,
        swept: Option<&Swept>,
    );

    /// Whether contact normals stand in the rows, because they are observed.
    fn writes_normals(&self) -> bool;

    /// Whether the places where contacts left the tip do.
    fn writes_tips(&self) -> bool;

    /// Fits the belief, and writes it into `row` with how it compares with the truth.
    ///
    /// # Errors
    /// If there is no fit.
    fn conclude(&mut self, row: &mut TouchRow, is_last: bool) -> Result<(), CovarianceError>;

    /// What is known now.
    fn known(&self) -> Known<'_>;

    /// Makes the touches that the belief does not learn from; and why there are no more, if a
    /// fault ended them.
    fn verify(&self, probe: &mut dyn Probe, made: &[TouchRow]) -> VerificationRows;
}
