//! Gaussian-process regression with an exact posterior (Rasmussen & Williams 2006, ch. 2 and 5).
//!
//! `kernel` says how alike two places are, `derivative_covariance` what slopes say of heights, `covariance` factors that of what was observed (whole
//! in `dense`, row by row in `cholesky`), `posterior` predicts (Eq. 3 of Yi et al. 2016), `likelihood` scores
//! hyperparameters, `fit` finds the best ones and `reduction` says what one more observation would
//! tell.

pub mod batch;
pub mod cholesky;
mod correlations;
pub mod covariance;
pub mod dense;
mod derivative_covariance;
pub mod fit;
pub mod indefinite;
pub mod kernel;
pub mod likelihood;
pub mod mean;
pub mod observations;
pub mod posterior;
pub mod range;
pub mod reduction;
mod search;
pub mod search_box;
mod unblocked;

pub use fit::Fit;
pub use kernel::{Hyperparameters, Kernel};
pub use mean::Mean;
pub use observations::{NoiseRatio, Observation, Observations, Slope};
pub use posterior::Posterior;
pub use range::{LogNormal, Range, Scale};
pub use search_box::SearchBox;
