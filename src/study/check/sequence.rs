//! An interval of a mean that holds at every moment of a growing sample, so that one may stop
//! when one has seen enough.
//!
//! Of values with unknown spread: the mixture of t likelihood ratios over effect sizes, a normal
//! of variance g around none, is a martingale wherever the mean is what it is said to be (Lai 1976;
//! Wang & Ramdas 2024, "Anytime-valid t-tests and confidence sequences for Gaussian means with
//! unknown variance"). With n values, x = t²/(n − 1) and k = 1 + n g:
//!
//! E = k^(−1/2) ((1 + x) / (1 + x/k))^(n/2)
//!
//! By Ville's inequality E exceeds 1/α at any time with probability at most α.

use crate::experiment::statistics::{mean, mean_and_error};

/// Variance of plausible effect sizes, in units of the values' spread; chosen: it costs least where
/// the mean is about a spread away from none, which five percent of error are.
const G: f64 = 1.0;

/// More trials than anybody makes.
const MOST: usize = 100_000;

/// What a growing sample has told of its mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sequence {
    /// Values so far.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Ends of the interval; infinite while there is nothing to say.
    pub interval: [f64; 2],
    /// Their standard deviation, of more than one.
    pub sd: Option<f64>,
    /// Whether all of them are none.
    pub is_zero: bool,
    /// How improbable such values are at any time if the mean were none: 1/E, at most 1.
    pub p: f64,
}

impl Sequence {
    /// Of `values` in the order in which they came, with intervals that fail with probability
    /// `alpha`, looked at whenever there were a multiple of `batch` of them, and at the end.
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

    /// How many values an interval wants that is as wide to each side as `half`; none if their
    /// spread is not known yet, or more than anybody makes.
    pub fn wanted(&self, half: f64, alpha: f64) -> Option<usize> {
        let sd = self.sd?;
        (2..MOST).find(|&n| sd * width(n, alpha) <= half * (n as f64).sqrt())
    }
}

/// Half of the interval's width over the standard error.
fn width(n: usize, alpha: f64) -> f64 {
    let (n, k) = (n as f64, 1.0 + n as f64 * G);
    let r = (k.sqrt() / alpha).powf(2.0 / n);
    match r < k {
        true => ((n - 1.0) * (r - 1.0) / (1.0 - r / k)).sqrt(),
        false => f64::INFINITY,
    }
}

/// 1/E for a mean of none.
fn probability(n: usize, mean: f64, error: f64) -> f64 {
    if error == 0.0 {
        return if mean == 0.0 { 1.0 } else { 0.0 };
    }
    let (n, k) = (n as f64, 1.0 + n as f64 * G);
    let x = (mean / error).powi(2) / (n - 1.0);
    let log = 0.5 * n * ((1.0 + x) / (1.0 + x / k)).ln() - 0.5 * k.ln();
    (-log).exp().min(1.0)
}
