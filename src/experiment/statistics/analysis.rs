//! How the planners of a run compare, found once for its files and its page: every bootstrap takes
//! its time.

use crate::experiment::statistics::comparison::{Comparison, comparisons};
use crate::experiment::statistics::equal_error::{EqualError, equal_errors};
use crate::experiment::store::Run;

/// The planners of a run held against their baselines.
#[derive(Debug)]
pub struct Analysis<'a> {
    /// In every measure after the last touch.
    pub comparisons: Vec<Comparison<'a>>,
    /// In touches to equal error.
    pub equal_errors: Vec<EqualError<'a>>,
}

impl<'a> Analysis<'a> {
    /// Of a run's rows.
    pub fn of(run: &'a Run) -> Self {
        let Run { experiment, rows, .. } = run;
        Self {
            comparisons: comparisons(experiment, rows),
            equal_errors: equal_errors(experiment, rows),
        }
    }
}
