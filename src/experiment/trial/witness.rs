//! Who is told of a trial while it runs.

use crate::backend::Fault;
use crate::experiment::trial::row::TouchRow;
use crate::explore::belief::Belief;
use crate::explore::probe::Touch;

/// A touch that is done.
pub struct Touched<'a> {
    /// Which, counted from 1.
    pub count: u32,
    /// What it ended with.
    pub touch: &'a Touch,
    /// Its part of the trial's row.
    pub row: &'a TouchRow,
    /// What is known with it.
    pub belief: &'a Belief,
}

/// Who is told of every touch of a trial when it is done, before the next is planned. What it does
/// changes no row, unless it ends the trial.
pub trait Witness {
    /// A touch is done, and the belief has taken it in.
    ///
    /// # Errors
    /// A fault ends the trial.
    fn touched(&mut self, touched: &Touched) -> Result<(), Fault>;
}

/// Nobody.
impl Witness for () {
    fn touched(&mut self, _: &Touched) -> Result<(), Fault> {
        Ok(())
    }
}
