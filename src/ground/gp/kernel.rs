//! Stationary kernels with one length scale per input (automatic relevance determination).

use serde::{Deserialize, Serialize};

/// A correlation that depends on the scaled squared distance r² = Σ_d ((a_d − b_d) / l_d)².
///
/// A new kernel is one more implementation of this trait.
pub trait Kernel: Send + Sync {
    /// Correlation c(r²), with c(0) = 1.
    fn correlation(&self, r2: f64) -> f64;

    /// Correlation and its derivative dc/d(r²).
    fn correlation_slope(&self, r2: f64) -> (f64, f64);
}

/// The squared exponential exp(−r²/2), Eq. 2 of Yi et al. 2016.
#[derive(Clone, Copy, Debug)]
pub struct SquaredExponential;

impl Kernel for SquaredExponential {
    fn correlation(&self, r2: f64) -> f64 {
        (-0.5 * r2).exp()
    }

    fn correlation_slope(&self, r2: f64) -> (f64, f64) {
        let correlation = self.correlation(r2);
        (correlation, -0.5 * correlation)
    }
}

/// Every kernel by the name it has in an experiment file; one line to add one.
pub const KERNELS: &[(&str, &dyn Kernel)] = &[("squared_exponential", &SquaredExponential)];

/// The kernel called `name`.
pub fn by_name(name: &str) -> Option<&'static dyn Kernel> {
    KERNELS.iter().find(|(known, _)| *known == name).map(|(_, kernel)| *kernel)
}

/// What a fit chooses: k(a, b) = signal_sd² · c(r²(a, b)) + noise_sd² · [a is b].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hyperparameters {
    /// Standard deviation of the surface around its mean, in the unit of the heights.
    pub signal_sd: f64,
    /// Distance over which heights stay alike, one per input, in the unit of the inputs.
    pub length_scales: Vec<f64>,
    /// Standard deviation of one touch's error, in the unit of the heights.
    pub noise_sd: f64,
}

/// Scaled squared distance r² of two places.
pub fn scaled_distance2(a: &[f64], b: &[f64], length_scales: &[f64]) -> f64 {
    let mut r2 = 0.0;
    for ((a, b), length) in a.iter().zip(b).zip(length_scales) {
        let step = (a - b) / length;
        r2 += step * step;
    }
    r2
}
