//! What a Cholesky factorisation meets in a matrix that has no factor.

use thiserror::Error;

/// The matrix is not positive definite in floating point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("pivot {index} is not positive")]
pub struct NotPositiveDefinite {
    /// Row at which it was seen.
    pub index: usize,
}
