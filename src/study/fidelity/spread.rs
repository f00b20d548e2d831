//! How errors are spread: mean, quantile and largest.

use crate::experiment::statistics::{mean, mean_interval};

/// Mean, 95 % quantile and largest of some errors, with the mean's 95 % bootstrap interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Of the mean.
    pub interval: [f64; 2],
    /// 95 % lie at or below.
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// Of some values; none of nothing.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let max = *sorted.last()?;
        let rank = (0.95 * (sorted.len() - 1) as f64).ceil() as usize;
        let mean = mean(&sorted);
        let interval = mean_interval(&sorted, 0).unwrap_or([mean; 2]);
        Some(Self { mean, interval, p95: sorted[rank], max })
    }
}
