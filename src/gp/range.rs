//! What a hyperparameter may be, and what it probably is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Bounds of a positive hyperparameter and, if something is known of it, its prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// What it probably is.
    pub prior: Option<LogNormal>,
}

impl From<(f64, f64)> for Range {
    fn from((low, high): (f64, f64)) -> Self {
        Self { low, high, prior: None }
    }
}

/// A log-normal prior: ln x is normal about ln `median`, and two thirds of x lie within a factor
/// `spread` of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogNormal {
    /// Half of the values are smaller.
    pub median: f64,
    /// Factor of one standard deviation, above 1.
    pub spread: f64,
}

impl LogNormal {
    /// The same with its median in another unit.
    pub fn scaled(self, unit: f64) -> Self {
        Self { median: self.median * unit, ..self }
    }

    /// Standard deviations of ln x from the middle.
    fn deviations(&self, log: f64) -> f64 {
        (log - self.median.ln()) / self.spread.ln()
    }

    /// Log density of ln x at `log`, but for a constant: −½·z².
    pub fn log_density(&self, log: f64) -> f64 {
        -0.5 * self.deviations(log).powi(2)
    }

    /// Its derivative with respect to ln x.
    pub fn slope(&self, log: f64) -> f64 {
        -self.deviations(log) / self.spread.ln()
    }
}

/// How the signal's standard deviation s follows from the other hyperparameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// The most probable s in a range, given the noise as a fraction of it.
    Best(Range),
    /// The touch noise is known, so its fraction of s says what s is.
    KnownNoise(f64),
}

impl Scale {
    /// s, given the fit F = yᵀA⁻¹y of `count` heights and the noise ratio.
    ///
    /// Maximises −½F/s² − n·ln s plus the log prior of s. Without a prior that is sqrt(F/n); with
    /// one the slope falls in ln s, so its zero is bisected.
    pub fn signal_sd(&self, fit: f64, count: usize, noise_ratio: f64) -> f64 {
        let range = match self {
            Self::KnownNoise(noise_sd) => return noise_sd / noise_ratio,
            Self::Best(range) => range,
        };
        let n = count.max(1) as f64;
        let Some(prior) = range.prior else {
            return (fit / n).sqrt().max(range.low).min(range.high);
        };
        let slope = |log: f64| fit * (-2.0 * log).exp() - n + prior.slope(log);
        let (mut low, mut high) = (range.low.ln(), range.high.ln());
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if slope(middle) > 0.0 { low = middle } else { high = middle }
        }
        (0.5 * (low + high)).exp()
    }

    /// Log prior density of s.
    pub fn log_prior(&self, signal_sd: f64) -> f64 {
        match self {
            Self::Best(Range { prior: Some(prior), .. }) => prior.log_density(signal_sd.ln()),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_probable_scale_is_the_peak_of_its_slow_twin() {
        let prior = Some(LogNormal { median: 0.5, spread: 1.5 });
        for prior in [None, prior] {
            let range = Range { low: 1e-3, high: 1e3, prior };
            for (fit, count) in [(3.0, 7), (1e-9, 2), (40.0, 1)] {
                let best = Scale::Best(range).signal_sd(fit, count, 0.1);
                let value = |s: f64| {
                    let prior = Scale::Best(range).log_prior(s);
                    -0.5 * fit / (s * s) - count as f64 * s.ln() + prior
                };
                for factor in [0.5, 0.99, 1.01, 2.0] {
                    let other = (best * factor).clamp(range.low, range.high);
                    assert!(value(best) >= value(other) - 1e-9, "{fit} {count} {prior:?}");
                }
            }
        }
    }
}
