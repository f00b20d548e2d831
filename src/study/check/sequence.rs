//! Confidence sequence of a mean: an interval that is valid at every size of a growing sample, so
//! that sampling may stop at any time.
//!
//! For normal values of unknown variance, the mixture of t likelihood ratios over effect sizes with
//! a normal prior of mean 0 and variance g is a martingale if the mean is the hypothesised one (Lai
//! 1976; Wang & Ramdas 2024, "Anytime-valid t-tests and confidence sequences for Gaussian means
//! with unknown variance"). With n values, x = t²/(n − 1) and k = 1 + n g:
//!
//! E = k^(−1/2) ((1 + x) / (1 + x/k))^(n/2)
//!
//! By Ville's inequality E exceeds 1/α at any time with probability at most α.

use crate::experiment::statistics::{mean, mean_and_error};

/// Prior variance of effect sizes, in units of the values' variance.
// heuristic: narrowest interval where the mean is about one standard deviation, as for a 5 % error.
const G: f64 = 1.0;

/// Upper bound on the number of trials.
const TRIALS_MAX: usize = 100_000;

/// Confidence sequence of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfidenceSequence {
    /// Number of values.
    pub count: usize,
    /// Mean of the values.
    pub mean: f64,
    /// Bounds of the interval; infinite if undetermined.
    pub interval: [f64; 2],
    /// Standard deviation; `None` for a single value.
    pub sd: Option<f64>,
    /// Whether all values are 0.
    pub is_zero: bool,
    /// Anytime-valid p-value for a mean of 0: 1/E, at most 1.
    pub p: f64,
}

impl ConfidenceSequence {
    /// Computes the sequence of `values` in order of arrival, with miss probability `alpha`,
    /// evaluated after every `batch` values and at the end.
    pub fn new(values: &[f64], batch: usize, alpha: f64) -> Self {
        let mut interval = [f64::NEG_INFINITY, f64::INFINITY];
        let mut p = 1.0_f64;
        let looks = (1..=values.len()).filter(|n| n.is_multiple_of(batch) || *n == values.len());
        for n in looks {
            let (mean, error) = mean_and_error(&values[..n]);
            let Some(error) = error else { continue };
            let half = error * width(n, alpha);
            interval = [interval[0].max(mean - half), interval[1].min(mean + half)];
            p = p.min(probability(n, mean, error));
        }
        let count = values.len();
        let error = if count > 1 { mean_and_error(values).1 } else { None };
        Self {
            count,
            mean: mean(values),
            interval,
            sd: error.map(|error| error * (count as f64).sqrt()),
            is_zero: values.iter().all(|value| *value == 0.0),
            p,
        }
    }

    /// Number of values for an interval with half width `half`; `None` if the spread is unknown or
    /// the number exceeds 100 000.
    pub fn sample_size(&self, half: f64, alpha: f64) -> Option<usize> {
        let sd = self.sd?;
        (2..TRIALS_MAX).find(|&n| sd * width(n, alpha) <= half * (n as f64).sqrt())
    }
}

/// Half width of the interval divided by the standard error.
fn width(n: usize, alpha: f64) -> f64 {
    let (n, k) = (n as f64, 1.0 + n as f64 * G);
    let r = (k.sqrt() / alpha).powf(2.0 / n);
    match r < k {
        true => ((n - 1.0) * (r - 1.0) / (1.0 - r / k)).sqrt(),
        false => f64::INFINITY,
    }
}

/// Returns 1/E for a mean of 0.
fn probability(n: usize, mean: f64, error: f64) -> f64 {
    if error == 0.0 {
        return if mean == 0.0 { 1.0 } else { 0.0 };
    }
    let (n, k) = (n as f64, 1.0 + n as f64 * G);
    let x = (mean / error).powi(2) / (n - 1.0);
    let log = 0.5 * n * ((1.0 + x) / (1.0 + x / k)).ln() - 0.5 * k.ln();
    (-log).exp().min(1.0)
}
