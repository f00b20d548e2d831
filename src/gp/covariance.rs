//! The covariance of what was observed, factored with as little jitter as it needs.

use super::correlations::{Correlations, batches};
use super::dense::Dense;
use super::indefinite::NotPositiveDefinite;
use super::kernel::Kernel;
use super::observations::{NoiseRatio, Observations};
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

/// Factors C + N + jitter·diag(C), where C are the correlations and N the noise, a diagonal, into
/// `dense` with the smallest jitter of 0, 1e-15, 1e-14, … that works, and returns that jitter.
/// `correlations` are the buffer, and skip what they hold already.
///
/// # Errors
/// If an observation is not finite, or even the largest jitter does not help.
pub(super) fn factor(
    dense: &mut Dense,
    kernel: &dyn Kernel,
    observations: &Observations,
    length_scales: &[f64],
    noise: NoiseRatio,
    correlations: &mut Correlations,
) -> Result<f64, CovarianceError> {
    if let Some(index) = observations.first_not_finite() {
        return Err(CovarianceError::NotFinite { index });
    }
    let count = observations.len();
    let mut jitter = 0.0;
    loop {
        let largest = match observations.has_slopes() {
            true => {
                let buffer = &mut *correlations;
                with_slopes(dense, kernel, observations, length_scales, (noise, jitter), buffer)
            }
            false => {
                for columns in batches(count) {
                    let mut rest = correlations.of(kernel, observations, length_scales, &columns);
                    for j in columns {
                        if let [on, below @ ..] = dense.column_mut(j) {
                            let (column, others) = rest.split_at(below.len());
                            below.copy_from_slice(column);
                            *on = 1.0 + observations.height_noise2(j, noise) + jitter;
                            rest = others;
                        }
                    }
                }
                1.0 + noise.height * noise.height + jitter
            }
        };
        match dense.factor(largest) {
            Ok(()) => return Ok(jitter),
            Err(cause) if jitter >= JITTER_MAX => {
                return Err(CovarianceError::Indefinite { count, jitter, cause });
            }
            Err(_) => jitter = if jitter == 0.0 { 1e-15 } else { jitter * 10.0 },
        }
    }
}

/// Writes the covariance of heights and slopes, and returns the largest diagonal entry without the
/// noise: a number of much noise must not make another's pivot look lost.
fn with_slopes(
    dense: &mut Dense,
    kernel: &dyn Kernel,
    observations: &Observations,
    length_scales: &[f64],
    (noise, jitter): (NoiseRatio, f64),
    Correlations { derivatives, row, .. }: &mut Correlations,
) -> f64 {
    row.resize(observations.order(), 0.0);
    let mut largest: f64 = 0.0;
    for j in 0..observations.len() {
        derivatives.correlate(kernel, observations, length_scales, observations.place(j), j);
        let start = observations.start(j);
        let row = &mut row[start..];
        for number in 0..observations.start(j + 1) - start {
            let axis = number.checked_sub(1);
            derivatives.covariances(observations, length_scales, axis, row);
            largest = largest.max(row[number]);
            let noise2 = match axis {
                None => observations.height_noise2(j, noise),
                Some(axis) => observations.slope_noise2(j, noise, length_scales[axis]),
            };
            row[number] += noise2 + jitter * row[number];
            dense.column_mut(start + number).copy_from_slice(&row[number..]);
        }
    }
    largest
}
