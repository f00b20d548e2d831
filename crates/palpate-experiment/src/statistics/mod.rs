//! Statistics over trials.

pub mod comparison;
pub mod curve_table;
pub mod equal_error;
pub mod summary;

use palpate_gp::math::seed;
use rand::RngExt;

/// Mean and standard error; the error is `None` for a single value.
pub fn mean_and_error(values: &[f64]) -> (f64, Option<f64>) {
    let count = values.len() as f64;
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let error = (values.len() > 1).then(|| (squares / (count - 1.0) / count).sqrt());
    (mean, error)
}

/// Arithmetic mean; NaN for an empty slice.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Median: the middle value, or the mean of the two middle ones; `None` for an empty slice.
pub fn median(values: &[f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let mut values = values.to_vec();
    let (half, is_even) = (values.len() / 2, values.len().is_multiple_of(2));
    let (below, &mut upper, _) = values.select_nth_unstable_by(half, f64::total_cmp);
    let lower = below.iter().copied().max_by(f64::total_cmp).filter(|_| is_even);
    Some(0.5 * (lower.unwrap_or(upper) + upper))
}

/// Values with their ranks, so that the median of a sample is found by counting.
#[derive(Clone, Debug)]
pub(super) struct RankedValues {
    sorted: Vec<f64>,
    /// Index of each value in the sorted list.
    ranks: Vec<usize>,
}

impl RankedValues {
    pub(super) fn new(values: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        let mut ranks = vec![0; values.len()];
        order.iter().enumerate().for_each(|(rank, &index)| ranks[index] = rank);
        Self { sorted: order.iter().map(|&index| values[index]).collect(), ranks }
    }

    /// Median of the values at `sample`; `None` for an empty sample. `counts` is a buffer for as
    /// many numbers as there are values.
    pub(super) fn median(&self, sample: &[usize], counts: &mut Vec<u32>) -> Option<f64> {
        counts.clear();
        counts.resize(self.sorted.len(), 0);
        sample.iter().for_each(|&index| counts[self.ranks[index]] += 1);
        // The values are visited in order, each as often as it was drawn.
        let nth = |n: usize| {
            let mut seen = 0;
            let mut ranks = counts.iter().zip(&self.sorted);
            ranks.find_map(|(count, value)| {
                seen += *count as usize;
                (seen > n).then_some(*value)
            })
        };
        let half = sample.len() / 2;
        let upper = nth(half)?;
        let lower = if sample.len().is_multiple_of(2) { nth(half - 1)? } else { upper };
        Some(0.5 * (lower + upper))
    }
}

/// Number of bootstrap samples; Efron & Tibshirani 1993 recommend a thousand for an interval.
pub const RESAMPLES: usize = 1000;

/// 95 % interval of the mean of `values` by the percentile bootstrap (Efron & Tibshirani 1993, ch.
/// 13). Deterministic for a `seed`; `None` for fewer than two values.
pub fn mean_interval(values: &[f64], seed: u64) -> Option<[f64; 2]> {
    let mut drawn = vec![0.0; values.len()];
    let mean = |sample: &[usize]| {
        drawn.iter_mut().zip(sample).for_each(|(to, &index)| *to = values[index]);
        mean(&drawn)
    };
    let means = BootstrapSamples::new(values.len(), seed).each(mean);
    (values.len() > 1).then(|| central_95(means))
}

/// 95 % interval of the median, computed as in [`mean_interval`].
pub fn median_interval(values: &[f64], seed: u64) -> Option<[f64; 2]> {
    BootstrapSamples::new(values.len(), seed).median_interval(values)
}

/// Bootstrap samples: each has as many indices as there are values, drawn with replacement; empty
/// for a single value.
pub(super) struct BootstrapSamples {
    /// Number of values.
    pub(super) count: usize,
    indices: Vec<usize>,
}

impl BootstrapSamples {
    /// Draws the samples; deterministic for a `seed`.
    pub(super) fn new(count: usize, seed: u64) -> Self {
        let mut rng = seed::stream(seed, 0, "bootstrap");
        let samples = if count > 1 { RESAMPLES } else { 0 };
        let indices = (0..samples * count).map(|_| rng.random_range(0..count)).collect();
        Self { count, indices }
    }

    /// Computes a statistic of every sample.
    pub(super) fn each<T>(&self, statistic: impl FnMut(&[usize]) -> T) -> Vec<T> {
        self.indices.chunks_exact(self.count.max(1)).map(statistic).collect()
    }

    /// Interval of the median of `count` values; see [`median_interval`].
    pub(super) fn median_interval(&self, values: &[f64]) -> Option<[f64; 2]> {
        let (ranked, mut counts) = (RankedValues::new(values), Vec::new());
        let medians = self.each(|sample| ranked.median(sample, &mut counts).unwrap_or(f64::NAN));
        (!medians.is_empty()).then(|| central_95(medians))
    }
}

/// Returns the bounds of the middle 95 % of `found`, which must not be empty.
pub fn central_95(mut found: Vec<f64>) -> [f64; 2] {
    found.sort_by(f64::total_cmp);
    let cut = found.len() / 40;
    [found[cut], found[found.len() - 1 - cut]]
}

/// Paired difference between the errors of two planners in the same trials.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PairedDifference {
    /// Trials finished by both.
    pub trials: usize,
    /// Mean of error − other error.
    pub mean: f64,
    /// 95 % bootstrap interval of the mean.
    pub interval: Option<[f64; 2]>,
    /// Share of the trials with a smaller error; a tie counts half.
    pub won: f64,
}

impl PairedDifference {
    /// Computes the difference from pairs (error, other error); `None` for an empty slice.
    pub fn new(pairs: &[(f64, f64)], seed: u64) -> Option<Self> {
        let differences: Vec<f64> = pairs.iter().map(|(error, other)| error - other).collect();
        let win = |difference: &f64| match *difference {
            0.0 => 0.5,
            difference if difference < 0.0 => 1.0,
            _ => 0.0,
        };
        let wins: f64 = differences.iter().map(win).sum();
        let trials = differences.len();
        (trials > 0).then(|| Self {
            trials,
            mean: mean(&differences),
            interval: mean_interval(&differences, seed),
            won: wins / trials as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_gp::math::seed::stream;

    #[test]
    fn mean_error_and_median_are_the_textbooks() {
        let (mean, error) = mean_and_error(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(mean, 2.5);
        assert!((error.unwrap() - (5.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-15);
        assert_eq!(mean_and_error(&[3.0]), (3.0, None));
        assert_eq!(median(&[4.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(&[5.0]), Some(5.0));
        assert_eq!(median(&[]), None);
    }

    /// Nearly 95 % of the 95 % intervals contain the truth; the percentile bootstrap is slightly
    /// narrow for thirty values.
    #[test]
    fn intervals_contain_what_they_should() {
        let (mut means, mut medians, trials) = (0, 0, 400);
        for trial in 0..trials {
            let mut rng = stream(3, trial, "synthetic");
            // Exponential: mean 1, median ln 2.
            let values: Vec<f64> = (0..30).map(|_| -(1.0 - rng.random::<f64>()).ln()).collect();
            let contains = |interval: Option<[f64; 2]>, truth: f64| {
                let [low, high] = interval.unwrap();
                i32::from((low..=high).contains(&truth))
            };
            means += contains(mean_interval(&values, trial), 1.0);
            medians += contains(median_interval(&values, trial), 2f64.ln());
        }
        for (name, inside) in [("mean", means), ("median", medians)] {
            let share = f64::from(inside) / trials as f64;
            assert!((0.88..=0.98).contains(&share), "{name}: {share}");
        }
        let values = [1.0, 2.0, 4.0];
        assert_eq!(median_interval(&values, 5), median_interval(&values, 5));
        assert_eq!(mean_interval(&[1.0], 5), None);
        assert_eq!(mean_interval(&[2.0; 9], 5), Some([2.0, 2.0]));
    }

    /// The reference implementation sorts the sample's values.
    #[test]
    fn the_median_of_a_sample_is_that_of_its_values() {
        let mut rng = stream(3, 0, "sampled");
        for count in 1..40 {
            // Few distinct values, so that many are equal.
            let values: Vec<f64> =
                (0..count).map(|_| f64::from(rng.random_range(-4..4)) / 3.0).collect();
            let (ranked, mut counts) = (RankedValues::new(&values), Vec::new());
            for size in 0..2 * count {
                let sample: Vec<usize> = (0..size).map(|_| rng.random_range(0..count)).collect();
                let drawn: Vec<f64> = sample.iter().map(|&index| values[index]).collect();
                assert_eq!(ranked.median(&sample, &mut counts), median(&drawn), "{sample:?}");
            }
        }
    }

    #[test]
    fn pairs_are_compared_in_the_same_trial() {
        let paired =
            PairedDifference::new(&[(1.0, 2.0), (5.0, 6.0), (9.0, 9.0), (4.0, 3.0)], 1).unwrap();
        assert_eq!((paired.trials, paired.mean, paired.won), (4, -0.25, 0.625));
        let [low, high] = paired.interval.unwrap();
        assert!(low <= -0.25 && high >= -0.25 && low >= -1.0 && high <= 1.0);
        assert_eq!(PairedDifference::new(&[], 1), None);
    }
}
