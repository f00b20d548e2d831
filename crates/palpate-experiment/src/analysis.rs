//! Comparisons between the planners of a run, computed once for its files and its page because
//! bootstraps take time.

use crate::statistics::comparison::{PairedComparison, comparisons};
use crate::statistics::equal_error::{EqualError, equal_errors};
use crate::store::Run;

/// Comparisons of a run's planners with their baselines.
#[derive(Debug)]
pub struct Analysis<'a> {
    /// Differences in every measure after the last touch.
    pub comparisons: Vec<PairedComparison<'a>>,
    /// Touches to equal error.
    pub equal_errors: Vec<EqualError<'a>>,
}

impl<'a> Analysis<'a> {
    /// Computes the comparisons of a run's rows.
    pub fn new(run: &'a Run) -> Self {
        let Run { experiment, rows, .. } = run;
        Self {
            comparisons: comparisons(experiment, rows),
            equal_errors: equal_errors(experiment, rows),
        }
    }
}
