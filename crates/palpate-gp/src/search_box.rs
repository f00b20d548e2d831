//! Search box of the hyperparameters, their priors, and the models of mean and signal.
//!
//! A search runs over their logarithms: of each length scale, of the noise ratio, and of the slope
//! noise ratio if there is one. The signal's standard deviation follows from these.

use super::dense::DenseMatrix;
use super::kernel::Hyperparameters;
use super::observations::{NoiseRatio, Observations};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Bounds of the hyperparameters, and the model of the mean.
#[derive(Clone, Debug)]
pub struct SearchBox {
    /// Model of the prior mean.
    pub mean: MeanModel,
    /// Bounds of each length scale, in the unit of the inputs.
    pub length_scales: Vec<Range>,
    /// Bounds of the noise, as a fraction of the signal's standard deviation. If the noise is
    /// known, intersected with the range implied by `signal_sd`.
    pub noise_ratio: Range,
    /// Bounds of the slopes' noise, as a fraction of the signal's standard deviation, per unit of
    /// the inputs; `None` without slopes.
    pub slope_noise_ratio: Option<Range>,
    /// Bounds of the signal's standard deviation, in the unit of the heights.
    pub signal_sd: Range,
    /// Model of the touch noise.
    pub touch_noise: TouchNoise,
    /// Start of a search for the signal's standard deviation, which is needed for observations with
    /// errors of known size: these do not grow with the signal, so that it has no closed form.
    pub start_sd: Option<f64>,
    /// Bounds of the errors in common, as a fraction of the signal's standard deviation, where they
    /// are of unknown size: loadings are then in units of it. Only with a fitted touch noise and
    /// without a search for the signal.
    pub common_ratio: Option<Range>,
}

/// Model of the touch noise's standard deviation, in the unit of the heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchNoise {
    /// Fitted within the range of its ratio.
    Fitted,
    /// Known value.
    Known(f64),
    /// Lower bound (sensor noise); extra noise from the kernel's misfit is fitted where that gives
    /// more.
    AtLeast(f64),
}

impl SearchBox {
    /// Returns the searched ranges: lengths, then noise ratio, then slope noise ratio, and signal
    /// or errors in common, if they are searched.
    pub(super) fn ranges(&self) -> impl Iterator<Item = Range> {
        // A known noise and a range of the signal determine a range of their ratio.
        let noise_ratio = match self.touch_noise {
            TouchNoise::Known(noise_sd) => {
                (noise_sd / self.signal_sd.high, noise_sd / self.signal_sd.low).into()
            }
            TouchNoise::Fitted | TouchNoise::AtLeast(_) => self.noise_ratio,
        };
        let noises = [noise_ratio].into_iter().chain(self.slope_noise_ratio);
        let signal = self.is_signal_searched().then_some(self.signal_sd);
        self.length_scales.iter().copied().chain(noises).chain(signal).chain(self.common_ratio)
    }

    /// Whether the signal's standard deviation is a parameter of the search; with a known noise it
    /// follows from the noise ratio.
    pub(super) fn is_signal_searched(&self) -> bool {
        self.start_sd.is_some() && !matches!(self.touch_noise, TouchNoise::Known(_))
    }

    /// Returns the logarithms of the lower and upper bounds.
    pub(super) fn log_bounds(&self) -> (Vec<f64>, Vec<f64>) {
        self.ranges().map(|range| (range.low.ln(), range.high.ln())).unzip()
    }

    /// Returns lengths and noise ratios from their logarithms.
    pub(super) fn parameters(&self, logs: &[f64]) -> (Vec<f64>, NoiseRatio) {
        let lengths = &logs[..self.length_scales.len().min(logs.len())];
        (lengths.iter().map(|log| log.exp()).collect(), self.noise(logs))
    }

    /// Returns the noise ratios among [`parameters`](Self::parameters).
    pub(super) fn noise(&self, logs: &[f64]) -> NoiseRatio {
        let (noises, searched) = match &logs[self.length_scales.len().min(logs.len())..] {
            [noises @ .., last] if self.is_signal_searched() => (noises, Some((-last).exp())),
            [noises @ .., last] if self.common_ratio.is_some() => (noises, Some(last.exp())),
            noises => (noises, None),
        };
        let [height, slope] = [0, 1].map(|i| noises.get(i).map_or(0.0, |log: &f64| log.exp()));
        let known = match (self.touch_noise, searched) {
            (TouchNoise::Known(noise_sd), _) => height / noise_sd,
            (_, searched) => searched.unwrap_or(0.0),
        };
        NoiseRatio { height, slope, known }
    }

    /// Returns the logarithms of the parameters, the inverse of [`parameters`](Self::parameters).
    pub(super) fn log_parameters(&self, at: &Hyperparameters) -> Vec<f64> {
        let noise = at.noise_ratio();
        let slope = self.slope_noise_ratio.map(|range| noise.slope.clamp(range.low, range.high));
        let SearchBox { signal_sd, .. } = self;
        let signal = at.signal_sd.clamp(signal_sd.low, signal_sd.high);
        let signal = self.is_signal_searched().then_some(signal);
        let common = self.common_ratio.map(|range| noise.known.clamp(range.low, range.high));
        let noises = [noise.height].into_iter().chain(slope);
        let all = at.length_scales.iter().copied().chain(noises).chain(signal).chain(common);
        all.map(f64::ln).collect()
    }

    /// Indices of the noise ratios among the parameters.
    pub(super) fn noises(&self) -> std::ops::Range<usize> {
        let first = self.length_scales.len();
        first..first + 1 + usize::from(self.slope_noise_ratio.is_some())
    }

    /// Sets `logs` to a third of the lengths and the middle noises: a start from which a fit in a
    /// corner of its box detects a rougher surface.
    pub(super) fn shorter_lengths(&self, logs: &mut [f64], lower: &[f64], upper: &[f64]) {
        let lengths = self.length_scales.len();
        logs.iter_mut().take(lengths).for_each(|log| *log -= 3f64.ln());
        let noises = self.noises();
        for (noise, (lower, upper)) in
            logs.iter_mut().zip(lower.iter().zip(upper)).take(noises.end).skip(lengths)
        {
            *noise = 0.5 * (lower + upper);
        }
    }
}

/// Bounds of a positive hyperparameter and, optionally, its prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Prior, if given.
    pub prior: Option<LogNormal>,
}

impl From<(f64, f64)> for Range {
    fn from((low, high): (f64, f64)) -> Self {
        Self { low, high, prior: None }
    }
}

/// Log-normal prior: ln x is normal about ln `median`, and two thirds of x lie within a factor
/// `spread` of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogNormal {
    /// Median of the log-normal prior.
    pub median: f64,
    /// Geometric standard deviation: exp of the standard deviation of ln x; above 1.
    pub spread: f64,
}

impl LogNormal {
    /// Returns the prior with its median multiplied by `unit`.
    pub fn scaled(self, unit: f64) -> Self {
        Self { median: self.median * unit, ..self }
    }

    /// Returns the standard deviations of ln x from the median.
    fn deviations(&self, log: f64) -> f64 {
        (log - self.median.ln()) / self.spread.ln()
    }

    /// Returns the log density of ln x at `log`, up to a constant: −½·z².
    pub fn log_density(&self, log: f64) -> f64 {
        -0.5 * self.deviations(log).powi(2)
    }

    /// Returns the derivative of the log density with respect to ln x.
    pub fn slope(&self, log: f64) -> f64 {
        -self.deviations(log) / self.spread.ln()
    }
}

/// Model of the signal's standard deviation s, given the other hyperparameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SignalModel {
    /// Most probable s in a range, with the noise as a fraction of it.
    Profiled(Range),
    /// s follows from a known touch noise and its ratio.
    KnownNoise(f64),
    /// s is a parameter of the search: the inverse of the unit of known errors.
    Searched,
}

impl SignalModel {
    /// Returns s, given the fit F = yᵀA⁻¹y of `count` heights and the noise ratio.
    ///
    /// Maximises −½F/s² − n·ln s plus the log prior of s. Without a prior, s is sqrt(F/n); with
    /// one, the derivative decreases in ln s, and its zero is found by bisection.
    pub fn signal_sd(&self, fit: f64, count: usize, noise_ratio: impl Into<NoiseRatio>) -> f64 {
        let noise = noise_ratio.into();
        let range = match self {
            Self::KnownNoise(noise_sd) => return noise_sd / noise.height,
            Self::Searched => return 1.0 / noise.known,
            Self::Profiled(range) => range,
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

    /// Returns the log prior density of s.
    pub fn log_prior(&self, signal_sd: f64) -> f64 {
        match self {
            Self::Profiled(Range { prior: Some(prior), .. }) => prior.log_density(signal_sd.ln()),
            _ => 0.0,
        }
    }
}

/// Model of the prior mean in a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeanModel {
    /// Zero, as in Yi et al. 2016.
    #[default]
    Zero,
    /// Average of the observed heights.
    Data,
    /// Most likely constant, m = 1ᵀA⁻¹y / 1ᵀA⁻¹1 (generalised least squares).
    Constant,
}

impl MeanModel {
    /// Returns the mean of `observations` whose covariance is proportional to the factored matrix;
    /// the buffers are overwritten.
    pub(super) fn of(
        self,
        observations: &Observations,
        length_scales: &[f64],
        factored: &DenseMatrix,
        [weights, observed]: [&mut Vec<f64>; 2],
    ) -> f64 {
        let heights = observations.heights();
        if heights.is_empty() {
            return 0.0;
        }
        match self {
            Self::Zero => 0.0,
            Self::Data => heights.iter().sum::<f64>() / heights.len() as f64,
            Self::Constant => {
                observations.ones(weights);
                factored.solve_lower(weights);
                let ones: f64 = weights.iter().map(|v| v * v).sum();
                factored.solve_upper(weights);
                observations.residuals(0.0, length_scales, observed);
                weights.iter().zip(observed).map(|(weight, y)| weight * *y).sum::<f64>() / ones
            }
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
                let best = SignalModel::Profiled(range).signal_sd(fit, count, 0.1);
                let value = |s: f64| {
                    let prior = SignalModel::Profiled(range).log_prior(s);
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
