//! Hyperparameters by maximum likelihood: where they are sought, and what was found.

use super::kernel::{Hyperparameters, Kernel};
use super::mean::Mean;
use super::observations::{NoiseRatio, Observations};
use super::range::Range;
use super::search::Search;
use crate::math::optimize::Stop;
use serde::{Deserialize, Serialize};

/// The box in which hyperparameters are sought, and how the mean is chosen.
#[derive(Clone, Debug)]
pub struct SearchBox {
    /// How the mean is chosen.
    pub mean: Mean,
    /// Each length scale, in the unit of the inputs.
    pub length_scales: Vec<Range>,
    /// The noise, as a fraction of the signal's standard deviation. If the noise is known, what
    /// this range leaves of `signal_sd`.
    pub noise_ratio: Range,
    /// The slopes' noise, as a fraction of the signal's standard deviation, per unit of the inputs;
    /// none where no slopes are observed.
    pub slope_noise_ratio: Option<Range>,
    /// The signal's standard deviation, in the unit of the heights.
    pub signal_sd: Range,
    /// The touch noise's standard deviation, if it is known and not to be fitted.
    pub noise_sd: Option<f64>,
}

/// What a fit found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The most probable hyperparameters.
    #[serde(flatten)]
    pub hyperparameters: Hyperparameters,
    /// Their log marginal likelihood.
    pub log_likelihood: f64,
    /// How many covariance matrices were factored.
    pub factorisations: u32,
    /// With how many observations the whole box was last scanned, in this fit or one it began
    /// from.
    pub scanned_at: usize,
    /// Why the climb that won stopped.
    pub stop: Stop,
}

/// Up to this many observations each fit scans the whole box: few touches change their mind. Of
/// 672 fits of the toy's trials, 14 missed the global maximum when scans ended at 20, 6 at 32, and 2
/// do at 40.
const SCAN_ALWAYS: usize = 40;
/// Beyond, a fit scans once the observations have grown by this factor since the last scan, and
/// in between climbs from where it stood; chosen.
const SCAN_AGAIN: f64 = 1.2;

impl SearchBox {
    /// Maximises the marginal likelihood, times what priors there are, globally and
    /// deterministically.
    ///
    /// The likelihood is profiled over signal_sd, which has a closed form, so the search runs
    /// over (ln lengths, ln noise ratio, ln slope noise ratio if there is one) only. `last`, the fit before the newest touches, is one
    /// more start, or, while the box need not be scanned again, the only one beside shorter
    /// lengths. With no observations, or if no covariance can be factored, the middle of the box
    /// is returned with [`Stop::Failed`].
    pub fn fit(
        &self,
        kernel: &'static dyn Kernel,
        observations: &Observations,
        last: Option<&Fit>,
    ) -> Fit {
        let (lower, upper) = self.log_bounds();
        let mut search = Search::new(self, kernel, observations, &lower, &upper);
        let count = observations.len();
        let is_recent = |last: &&Fit| count as f64 <= SCAN_AGAIN * last.scanned_at as f64;
        let recent = last.filter(is_recent).filter(|_| count > SCAN_ALWAYS);
        if !observations.is_empty() {
            if let Some(last) = last {
                search.climb(&self.log_parameters(&last.hyperparameters));
            }
            match recent {
                Some(last) => {
                    let mut start = self.log_parameters(&last.hyperparameters);
                    self.shorten(&mut start, &lower, &upper);
                    search.climb(&start);
                }
                None => search.scan(),
            }
            search.cross_noise();
        }
        let mut fit = search.conclude().unwrap_or_else(|| self.prior(&lower, &upper));
        fit.factorisations = search.factorisations();
        fit.scanned_at = recent.map_or(count, |last| last.scanned_at);
        fit
    }

    /// The ranges searched over: lengths, then noise ratio, then slope noise ratio.
    pub(super) fn ranges(&self) -> impl Iterator<Item = Range> {
        // A known noise and a range of the signal leave a range of their ratio.
        let noise_ratio = match self.noise_sd {
            Some(noise_sd) => {
                (noise_sd / self.signal_sd.high, noise_sd / self.signal_sd.low).into()
            }
            None => self.noise_ratio,
        };
        self.length_scales.iter().copied().chain([noise_ratio]).chain(self.slope_noise_ratio)
    }

    fn log_bounds(&self) -> (Vec<f64>, Vec<f64>) {
        self.ranges().map(|range| (range.low.ln(), range.high.ln())).unzip()
    }

    /// What is believed before any touch: the geometric middle of the box.
    fn prior(&self, lower: &[f64], upper: &[f64]) -> Fit {
        let middle: Vec<f64> = lower.iter().zip(upper).map(|(l, u)| 0.5 * (l + u)).collect();
        let (length_scales, noise) = self.parameters(&middle);
        let signal_sd = match self.noise_sd {
            Some(noise_sd) => noise_sd / noise.height,
            None => (self.signal_sd.low * self.signal_sd.high).sqrt(),
        };
        Fit {
            hyperparameters: hyperparameters(signal_sd, length_scales, noise, 0.0),
            log_likelihood: 0.0,
            factorisations: 0,
            scanned_at: 0,
            stop: Stop::Failed,
        }
    }

    /// Lengths and noise ratios from their logarithms.
    pub(super) fn parameters(&self, logs: &[f64]) -> (Vec<f64>, NoiseRatio) {
        let mut lengths: Vec<f64> = logs.iter().map(|log| log.exp()).collect();
        let noises = lengths.split_off(self.length_scales.len().min(logs.len()));
        let noise = |i: usize| noises.get(i).copied().unwrap_or(0.0);
        (lengths, NoiseRatio { height: noise(0), slope: noise(1) })
    }

    fn log_parameters(&self, at: &Hyperparameters) -> Vec<f64> {
        let noise = at.noise_ratio();
        let slope = self.slope_noise_ratio.map(|range| noise.slope.clamp(range.low, range.high));
        let parameters = at.length_scales.iter().copied().chain([noise.height]).chain(slope);
        parameters.map(f64::ln).collect()
    }

    /// Moves to a third of the lengths and the middle noises: a start from which a fit that sits in a
    /// corner of its box finds out that new touches have shown a rougher surface.
    fn shorten(&self, logs: &mut [f64], lower: &[f64], upper: &[f64]) {
        let lengths = self.length_scales.len();
        logs.iter_mut().take(lengths).for_each(|log| *log -= 3f64.ln());
        for (noise, (lower, upper)) in logs.iter_mut().zip(lower.iter().zip(upper)).skip(lengths) {
            *noise = 0.5 * (lower + upper);
        }
    }
}

/// From a search's parameters.
pub(super) fn hyperparameters(
    signal_sd: f64,
    length_scales: Vec<f64>,
    noise: NoiseRatio,
    mean: f64,
) -> Hyperparameters {
    Hyperparameters {
        signal_sd,
        length_scales,
        noise_sd: noise.height * signal_sd,
        slope_noise_sd: noise.slope * signal_sd,
        mean,
    }
}
