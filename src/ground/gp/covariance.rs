//! The covariance of what was observed, factored with as little jitter as it needs.

use super::cholesky::NotPositiveDefinite;
use super::correlations::{Correlations, batches};
use super::dense::Dense;
use super::kernel::Kernel;
use super::observations::Observations;
use thiserror::Error;

/// Largest jitter tried, relative to the diagonal; beyond it the data contradict the kernel.
const JITTER_MAX: f64 = 1e-4;

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
/// smallest jitter of 0, 1e-15, 1e-14, … that works, and returns that jitter. `correlations` are
/// the buffer, and skip what they hold already.
///
/// # Errors
/// If an observation is not finite, or even the largest jitter does not help.
pub(super) fn factor(
    dense: &mut Dense,
    kernel: &dyn Kernel,
    observations: &Observations,
    length_scales: &[f64],
    noise_ratio: f64,
    correlations: &mut Correlations,
) -> Result<f64, CovarianceError> {
    if let Some(index) = observations.first_not_finite() {
        return Err(CovarianceError::NotFinite { index });
    }
    let count = observations.len();
    let mut jitter = 0.0;
    loop {
        let diagonal = 1.0 + noise_ratio * noise_ratio + jitter;
        for columns in batches(count) {
            let mut rest = correlations.of(kernel, observations, length_scales, &columns);
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
