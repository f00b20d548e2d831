//! Gaussian-process regression with an exact posterior (Rasmussen & Williams 2006).
//!
//! A Gaussian process is a belief about a surface: at every place it has a mean height and a
//! standard deviation. Heights observed at some places, each with an error, pull the mean towards
//! them and make the standard deviation small near them. The range of this effect is the length
//! scale, one per coordinate; it, the signal's standard deviation and the noise's are the
//! [`Hyperparameters`], and a fit finds the most likely ones.
//!
//! Places and heights may be in any units; length scales and noise are in the same units.
//!
//! ```
//! use palpate_gp::kernel::SquaredExponential;
//! use palpate_gp::posterior::Scratch;
//! use palpate_gp::{MeanModel, Observations, Posterior, SearchBox, TouchNoise};
//!
//! // Heights of a wave 20 mm high, observed every 0.5 m over 4 m; all in metres.
//! let wave = |x_m: f64| 0.02 * (2.0 * x_m).sin();
//! let mut observations = Observations::new(1);
//! for i in 0..9 {
//!     let x_m = 0.5 * f64::from(i);
//!     observations.push_height(&[x_m], wave(x_m));
//! }
//!
//! // The most likely hyperparameters within these ranges: the length from 5 cm to 4 m, the noise
//! // from a ten-thousandth to a hundredth of the signal, the signal from 0.1 mm to 1 m.
//! let search_box = SearchBox {
//!     mean: MeanModel::Zero,
//!     length_scales: vec![(0.05, 4.0).into()],
//!     noise_ratio: (1e-4, 1e-2).into(),
//!     signal_sd: (1e-4, 1.0).into(),
//!     touch_noise: TouchNoise::Fitted,
//!     start_sd: None,
//!     common_ratio: None,
//!     slope_noise_ratio: None,
//! };
//! let fit = search_box.fit(&SquaredExponential, &observations);
//!
//! // Between two observations it is right to a millimetre, and knows it.
//! let belief = Posterior::new(&SquaredExponential, fit.hyperparameters, observations)?;
//! let mut scratch = Scratch::default();
//! let mean_m = belief.mean(&[1.25], &mut scratch);
//! let sd_m = belief.variance(&[1.25], &mut scratch).sqrt();
//! assert!((mean_m - wave(1.25)).abs() < 1e-3 && sd_m < 1e-3);
//!
//! // Far from all touches it returns to the prior: mean 0, the signal's standard deviation.
//! let far_m = belief.variance(&[100.0], &mut scratch).sqrt();
//! assert!((far_m - belief.hyperparameters().signal_sd).abs() < 1e-9);
//! # Ok::<(), palpate_gp::covariance::CovarianceError>(())
//! ```
//!
//! | module | content |
//! |---|---|
//! | [`kernel`] | correlation of the heights of two places, and the hyperparameters |
//! | [`observations`] | places, heights, and slopes if they are observed too |
//! | [`posterior`], [`batch`], [`means`] | mean, variance, gradients; batch evaluation |
//! | [`inducing`] | approximate posterior from inducing points |
//! | [`likelihood`] | log marginal likelihood of hyperparameters |
//! | [`fit`], [`search_box`] | maximum-likelihood hyperparameters and kernel, and their bounds |
//! | [`reduction`] | variance reduction by one more observation |
//! | [`covariance`], [`dense`], [`cholesky`] | the covariance, factored whole or row by row |

pub mod batch;
pub mod cholesky;
pub mod covariance;
pub mod dense;
mod extension;
pub mod fit;
pub mod inducing;
pub mod kernel;
pub mod likelihood;
pub mod math;
pub mod means;
pub mod observations;
pub mod posterior;
pub mod reduction;
mod scan;
pub mod search_box;
mod tiles;

pub use fit::{Fit, RefitSequence};
pub use kernel::{Hyperparameters, Kernel};
pub use observations::{KnownError, NoiseRatio, Observation, Observations, Slope};
pub use posterior::Posterior;
pub use search_box::{LogNormal, MeanModel, Range, SearchBox, SignalModel, TouchNoise};
