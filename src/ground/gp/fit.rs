//! Hyperparameters by maximum likelihood: a coarse scan finds the hills, L-BFGS climbs them.

use super::kernel::{Hyperparameters, Kernel};
use super::likelihood::Likelihood;
use super::mean::Mean;
use super::observations::Observations;
use super::range::{Range, Scale};
use crate::ground::optimize::{self, Stop};
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

/// Where a climb may begin.
struct Hill {
    start: Vec<f64>,
    /// What its top can be expected to score at most.
    at_most: f64,
}

impl Hill {
    fn unknown(start: Vec<f64>) -> Self {
        Self { start, at_most: f64::INFINITY }
    }
}

/// Evaluations allowed to one climb; most need a fifth of it.
const CLIMB_BUDGET: u32 = 100;
/// Hills of the scan that are climbed, besides the last fit's; chosen: enough for every fit of
/// the toy that was held against a dense grid.
const CLIMBS: usize = 3;
/// Up to this many observations each fit scans the whole box: few touches change their mind. On
/// the toy, 13 of 524 fits missed the global maximum when scans ended at 32, and 4 do with a scan
/// each time.
const SCAN_ALWAYS: usize = 50;
/// Beyond, a fit scans once the observations have grown by this factor since the last scan, and
/// in between climbs from where it stood; chosen.
const SCAN_AGAIN: f64 = 1.2;
/// Noise levels of the scan, spread over the logarithm of their range.
const NOISE_LEVELS: usize = 3;

impl SearchBox {
    /// Maximises the marginal likelihood, times what priors there are, globally and
    /// deterministically.
    ///
    /// The likelihood is profiled over signal_sd, which has a closed form, so the search runs
    /// over (ln lengths, ln noise ratio) only. `last`, the fit before the newest touches, is one
    /// more start, or, while the box need not be scanned again, the only one beside shorter
    /// lengths. With no observations, or if no covariance can be factored, the middle of the box
    /// is returned with [`Stop::Failed`].
    pub fn fit(
        &self,
        kernel: &'static dyn Kernel,
        observations: &Observations,
        last: Option<&Fit>,
    ) -> Fit {
        let mut likelihood = Likelihood::new(kernel, self.mean, observations);
        let scale = match self.noise_sd {
            Some(noise_sd) => Scale::KnownNoise(noise_sd),
            None => Scale::Best(self.signal_sd),
        };
        let (lower, upper) = self.log_bounds();
        let count = observations.len();
        let is_recent = |last: &&Fit| count as f64 <= SCAN_AGAIN * last.scanned_at as f64;
        let recent = last.filter(is_recent).filter(|_| count > SCAN_ALWAYS);
        let scanned_at = recent.map_or(count, |last| last.scanned_at);
        let (mut best, mut best_score) = (None, f64::NEG_INFINITY);
        if !observations.is_empty() {
            let mut starts: Vec<Hill> = last
                .map(|last| Hill::unknown(log_parameters(&last.hyperparameters)))
                .into_iter()
                .collect();
            match recent {
                Some(last) => {
                    starts.push(Hill::unknown(shorter(&last.hyperparameters, &lower, &upper)));
                }
                None => starts.extend(self.hills(&mut likelihood, &scale, &lower, &upper)),
            }
            for Hill { start, at_most } in starts {
                if at_most < best_score {
                    continue;
                }
                let bounds = optimize::Bounds { lower: &lower, upper: &upper };
                let top = optimize::lbfgs(bounds, &start, CLIMB_BUDGET, |x, gradient| {
                    self.score(&mut likelihood, &scale, x, Some(gradient))
                });
                if top.value > best_score {
                    best_score = top.value;
                    best = self.conclude(&mut likelihood, &scale, &top.x, top.stop).or(best);
                }
            }
        }
        let mut best = best.unwrap_or_else(|| self.prior(&scale, &lower, &upper));
        best.factorisations = likelihood.factorisations();
        best.scanned_at = scanned_at;
        best
    }

    /// The ranges searched over: lengths, then noise ratio.
    fn ranges(&self) -> impl Iterator<Item = Range> {
        // A known noise and a range of the signal leave a range of their ratio.
        let noise_ratio = match self.noise_sd {
            Some(noise_sd) => {
                (noise_sd / self.signal_sd.high, noise_sd / self.signal_sd.low).into()
            }
            None => self.noise_ratio,
        };
        self.length_scales.iter().copied().chain([noise_ratio])
    }

    fn log_bounds(&self) -> (Vec<f64>, Vec<f64>) {
        self.ranges().map(|range| (range.low.ln(), range.high.ln())).unzip()
    }

    /// Log likelihood plus log priors at `x`, with the gradient if asked; NaN where the
    /// covariance cannot be factored.
    fn score(
        &self,
        likelihood: &mut Likelihood,
        scale: &Scale,
        x: &[f64],
        mut gradient: Option<&mut [f64]>,
    ) -> f64 {
        let (lengths, noise_ratio) = parameters(x);
        let profile = likelihood.profile(&lengths, noise_ratio, scale, gradient.as_deref_mut());
        let Ok(profile) = profile else { return f64::NAN };
        let mut score = profile.log_likelihood + scale.log_prior(profile.signal_sd);
        for (i, (range, &log)) in self.ranges().zip(x).enumerate() {
            let Some(prior) = range.prior else { continue };
            score += prior.log_density(log);
            if let Some(slope) = gradient.as_deref_mut().and_then(|gradient| gradient.get_mut(i)) {
                *slope += prior.slope(log);
            }
        }
        score
    }

    fn conclude(
        &self,
        likelihood: &mut Likelihood,
        scale: &Scale,
        x: &[f64],
        stop: Stop,
    ) -> Option<Fit> {
        let (length_scales, noise_ratio) = parameters(x);
        let profile = likelihood.profile(&length_scales, noise_ratio, scale, None).ok()?;
        let hyperparameters = Hyperparameters {
            signal_sd: profile.signal_sd,
            length_scales,
            noise_sd: noise_ratio * profile.signal_sd,
            mean: profile.mean,
        };
        Some(Fit {
            hyperparameters,
            log_likelihood: profile.log_likelihood,
            factorisations: 0,
            scanned_at: 0,
            stop,
        })
    }

    /// What is believed before any touch: the geometric middle of the box.
    fn prior(&self, scale: &Scale, lower: &[f64], upper: &[f64]) -> Fit {
        let middle: Vec<f64> = lower.iter().zip(upper).map(|(l, u)| 0.5 * (l + u)).collect();
        let (length_scales, noise_ratio) = parameters(&middle);
        let signal_sd = match scale {
            Scale::KnownNoise(noise_sd) => noise_sd / noise_ratio,
            Scale::Best(range) => (range.low * range.high).sqrt(),
        };
        Fit {
            hyperparameters: Hyperparameters {
                signal_sd,
                length_scales,
                noise_sd: noise_ratio * signal_sd,
                mean: 0.0,
            },
            log_likelihood: 0.0,
            factorisations: 0,
            scanned_at: 0,
            stop: Stop::Failed,
        }
    }

    /// The highest local maxima of the profiled likelihood on a grid over the box.
    fn hills(
        &self,
        likelihood: &mut Likelihood,
        scale: &Scale,
        lower: &[f64],
        upper: &[f64],
    ) -> Vec<Hill> {
        let levels = self.levels();
        let count: usize = levels.iter().product();
        let point = |index: usize| -> Vec<f64> {
            digits(index, &levels)
                .zip(&levels)
                .zip(lower.iter().zip(upper))
                .map(|((digit, &levels), (lower, upper))| {
                    lower + (upper - lower) * digit as f64 / (levels.max(2) - 1) as f64
                })
                .collect()
        };
        let values: Vec<f64> = (0..count)
            .map(|index| {
                let score = self.score(likelihood, scale, &point(index), None);
                if score.is_nan() { f64::NEG_INFINITY } else { score }
            })
            .collect();
        let mut hills: Vec<usize> =
            (0..count).filter(|&index| is_hill(index, &levels, &values)).collect();
        hills.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        hills.truncate(CLIMBS);
        let hill = |index| {
            let at_most = values[index] + rise(index, &levels, &values);
            Hill { start: point(index), at_most }
        };
        hills.into_iter().map(hill).collect()
    }

    /// Grid points per parameter, the noise last.
    fn levels(&self) -> Vec<usize> {
        let per_length = match self.length_scales.len() {
            1 => 24,
            2 => 8,
            _ => 5,
        };
        let mut levels = vec![per_length; self.length_scales.len()];
        levels.push(NOISE_LEVELS);
        levels
    }
}

/// The place of grid point `index` along each parameter, the last varying fastest.
fn digits(index: usize, levels: &[usize]) -> impl Iterator<Item = usize> {
    let mut stride: usize = levels.iter().product();
    let mut rest = index;
    levels.iter().map(move |levels| {
        stride /= levels;
        let digit = rest / stride;
        rest %= stride;
        digit
    })
}

/// The values of the neighbours of grid point `index`, parameter by parameter.
fn neighbours(
    index: usize,
    levels: &[usize],
    values: &[f64],
) -> impl Iterator<Item = [Option<f64>; 2]> {
    let mut stride = values.len();
    digits(index, levels).zip(levels).map(move |(digit, levels)| {
        stride /= levels;
        let below = (digit > 0).then(|| values[index - stride]);
        let above = (digit + 1 < *levels).then(|| values[index + stride]);
        [below, above]
    })
}

/// Whether no neighbour along any parameter is higher.
fn is_hill(index: usize, levels: &[usize], values: &[f64]) -> bool {
    let mut beside = neighbours(index, levels, values).flatten().flatten();
    beside.all(|value| value <= values[index])
}

/// What a hill may rise above its highest grid point: along each parameter a quarter of its fall
/// to the lower neighbour, where a parabola's top is at most an eighth of it higher.
fn rise(index: usize, levels: &[usize], values: &[f64]) -> f64 {
    let lowest =
        |beside: [Option<f64>; 2]| beside.into_iter().flatten().fold(values[index], f64::min);
    neighbours(index, levels, values).map(|beside| 0.25 * (values[index] - lowest(beside))).sum()
}

fn parameters(logs: &[f64]) -> (Vec<f64>, f64) {
    let mut lengths: Vec<f64> = logs.iter().map(|log| log.exp()).collect();
    let noise_ratio = lengths.pop().unwrap_or(0.0);
    (lengths, noise_ratio)
}

/// A third of the lengths and the middle noise: a start from which a fit that sits in a corner of
/// its box finds out that new touches have shown a rougher surface.
fn shorter(at: &Hyperparameters, lower: &[f64], upper: &[f64]) -> Vec<f64> {
    let mut logs = log_parameters(at);
    logs.iter_mut().for_each(|log| *log -= 3f64.ln());
    if let (Some(noise), Some(lower), Some(upper)) = (logs.last_mut(), lower.last(), upper.last()) {
        *noise = 0.5 * (lower + upper);
    }
    logs
}

fn log_parameters(at: &Hyperparameters) -> Vec<f64> {
    at.length_scales.iter().copied().chain([at.noise_sd / at.signal_sd]).map(f64::ln).collect()
}
