//! The covariance of what was observed, factored with as little jitter as it needs.

use super::cholesky::NotPositiveDefinite;
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
/// smallest jitter of 0, 1e-15, 1e-14, … that works, and returns that jitter.
///
/// # Errors
/// If an observation is not finite, or even the largest jitter does not help.
pub fn factor(
    dense: &mut Dense,
    kernel: &dyn Kernel,
    observations: &Observations,
    length_scales: &[f64],
    noise_ratio: f64,
) -> Result<f64, CovarianceError> {
    if let Some(index) = observations.first_not_finite() {
        return Err(CovarianceError::NotFinite { index });
    }
    let count = observations.len();
    let mut jitter = 0.0;
    loop {
        let diagonal = 1.0 + noise_ratio * noise_ratio + jitter;
        for j in 0..count {
            if let [on, below @ ..] = dense.column_mut(j) {
                observations.distances2(observations.place(j), length_scales, j + 1, below);
                kernel.correlate(below);
                *on = diagonal;
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
