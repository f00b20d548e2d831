//! The covariance of what was observed, factored with as little jitter as it needs.

use super::cholesky::NotPositiveDefinite;
use super::dense::Dense;
use super::kernel::Kernel;
use super::observations::Observations;
use std::ops::Range;
use thiserror::Error;

/// Largest jitter tried, relative to the diagonal; beyond it the data contradict the kernel.
const JITTER_MAX: f64 = 1e-4;

/// Columns of a triangle are correlated together until they hold this many entries: vector loops
/// over single short columns would run half empty. Chosen to stay in the first-level cache.
const BATCH: usize = 2048;

/// Consecutive ranges of the columns 0..count of a lower triangle with about [`BATCH`] entries.
pub(super) fn batches(count: usize) -> impl Iterator<Item = Range<usize>> {
    let mut begin = 0;
    std::iter::from_fn(move || {
        let (first, mut entries) = (begin, 0);
        while begin < count && (begin == first || entries + count - begin <= BATCH) {
            entries += count - begin;
            begin += 1;
        }
        (first < begin).then_some(first..begin)
    })
}

/// Observations that no posterior can be made of.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CovarianceError {
    /// A place or height that is not a finite number.
    #[error("touch {index} is not finite")]
    NotFinite {
        /// Which observation.
        index: usize,
    },
    /// No jitter, however large, made the covariance positive definite.
    #[error("covariance of {count} touches stays indefinite with jitter {jitter:e}: {cause}")]
    Indefinite {
        /// Number of observations.
        count: usize,
        /// Largest jitter tried, relative to the diagonal.
        jitter: f64,
        /// What the factorisation met.
        cause: NotPositiveDefinite,
    },
}

/// Factors C + (noise_ratio² + jitter)·I, where C are the correlations, into `dense` with the
/// smallest jitter of 0, 1e-15, 1e-14, … that works, and returns that jitter. `correlations` is
/// overwritten.
///
/// # Errors
/// If an observation is not finite, or even the largest jitter does not help.
pub fn factor(
    dense: &mut Dense,
    kernel: &dyn Kernel,
    observations: &Observations,
    length_scales: &[f64],
    noise_ratio: f64,
    correlations: &mut Vec<f64>,
) -> Result<f64, CovarianceError> {
    if let Some(index) = observations.first_not_finite() {
        return Err(CovarianceError::NotFinite { index });
    }
    let count = observations.len();
    let mut jitter = 0.0;
    loop {
        let diagonal = 1.0 + noise_ratio * noise_ratio + jitter;
        for columns in batches(count) {
            observations.distances2_below(columns.clone(), length_scales, correlations);
            kernel.correlate(correlations);
            let mut rest = correlations.as_slice();
            for j in columns {
                if let [on, below @ ..] = dense.column_mut(j) {
                    let (column, others) = rest.split_at(below.len());
                    below.copy_from_slice(column);
                    *on = diagonal;
                    rest = others;
                }
            }
        }
        match dense.factor(diagonal) {
            Ok(()) => return Ok(jitter),
            Err(cause) if jitter >= JITTER_MAX => {
                return Err(CovarianceError::Indefinite { count, jitter, cause });
            }
            Err(_) => jitter = if jitter == 0.0 { 1e-15 } else { jitter * 10.0 },
        }
    }
}
