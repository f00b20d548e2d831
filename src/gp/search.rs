//! How the most likely hyperparameters are sought: a coarse scan finds the hills of the profiled
//! likelihood, L-BFGS climbs those that may be the highest.

use super::kernel::{Hyperparameters, Kernel};
use super::likelihood::Likelihood;
use super::observations::Observations;
use super::range::Scale;
use super::search_box::{SearchBox, TouchNoise};
use crate::math::optimize;
use crate::math::optimize::{Optimum, Stop};

/// Evaluations allowed to one climb; most need a fifth of it.
const CLIMB_BUDGET: u32 = 100;
/// Hills of the scan that are climbed at most; chosen: enough for the fits of the toy that were
/// held against a dense grid.
const CLIMBS: usize = 2;
/// Noise levels of the scan, from the least to the largest; climbs find what lies between.
const NOISE_LEVELS: usize = 2;
/// Tops that differ by less nats are the same one; chosen above the likelihood's rounding.
const GAIN_MIN: f64 = 1e-6;
/// Where another noise makes the data less likely by up to this many nats, its own top may be the
/// higher one; chosen.
const NEARLY_AS_LIKELY: f64 = 0.3;

/// The highest top that a search found.
pub(super) struct Peak {
    pub hyperparameters: Hyperparameters,
    /// Their log marginal likelihood, without priors.
    pub log_likelihood: f64,
    /// Why the climb to it stopped.
    pub stop: Stop,
}

/// One search of a box, over (ln lengths, ln noise ratio, ln slope noise ratio if there is one).
pub(super) struct Search<'a> {
    sought: &'a SearchBox,
    likelihood: Likelihood<'a>,
    scale: Scale,
    bounds: optimize::Bounds<'a>,
    /// The highest top so far.
    best: Option<Optimum>,
}

impl<'a> Search<'a> {
    /// Nothing found yet; `lower` and `upper` are the box's corners.
    pub(super) fn new(
        sought: &'a SearchBox,
        kernel: &'static dyn Kernel,
        observations: &'a Observations,
        lower: &'a [f64],
        upper: &'a [f64],
    ) -> Self {
        let scale = match sought.touch_noise {
            TouchNoise::Known(noise_sd) => Scale::KnownNoise(noise_sd),
            TouchNoise::Fitted | TouchNoise::AtLeast(_) => Scale::Best(sought.signal_sd),
        };
        let likelihood = Likelihood::new(kernel, sought.mean, observations);
        let bounds = optimize::Bounds { lower, upper };
        Self { sought, likelihood, scale, bounds, best: None }
    }

    /// How many matrices were factored so far.
    pub(super) fn factorisations(&self) -> u32 {
        self.likelihood.factorisations()
    }

    fn best_score(&self) -> f64 {
        self.best.as_ref().map_or(f64::NEG_INFINITY, |best| best.value)
    }

    /// Climbs from `start` and keeps the top if it is the highest so far.
    pub(super) fn climb(&mut self, start: &[f64]) {
        let top = optimize::lbfgs(self.bounds, start, CLIMB_BUDGET, |x, gradient| {
            score(self.sought, &mut self.likelihood, &self.scale, x, Some(gradient))
        });
        if top.value > self.best_score() + GAIN_MIN {
            self.best = Some(top);
        }
    }

    /// Scores a grid over the box and climbs its highest hills, but for those that cannot reach
    /// what was found already.
    pub(super) fn scan(&mut self) {
        let levels = self.levels();
        let count: usize = levels.iter().product();
        let values: Vec<f64> = (0..count)
            .map(|index| {
                let at = self.grid_point(index, &levels);
                let score = score(self.sought, &mut self.likelihood, &self.scale, &at, None);
                if score.is_nan() { f64::NEG_INFINITY } else { score }
            })
            .collect();
        let mut hills: Vec<usize> =
            (0..count).filter(|&index| is_hill(index, &levels, &values)).collect();
        hills.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        for &hill in hills.iter().take(CLIMBS) {
            if values[hill] + rise(hill, &levels, &values) > self.best_score() {
                self.climb(&self.grid_point(hill, &levels));
            }
        }
    }

    /// Climbs from the least and the largest noise beside the best lengths, if the data are nearly
    /// as likely there: noise and lengths may trade, and leave two tops that differ little.
    pub(super) fn cross_noise(&mut self) {
        let Some(best) = &self.best else { return };
        let (value, top) = (best.value, best.x.clone());
        for noise in self.sought.length_scales.len()..top.len() {
            for level in [self.bounds.lower[noise], self.bounds.upper[noise]] {
                let mut at = top.clone();
                at[noise] = level;
                let score = score(self.sought, &mut self.likelihood, &self.scale, &at, None);
                if score > value - NEARLY_AS_LIKELY {
                    self.climb(&at);
                }
            }
        }
    }

    /// The highest top; none if no covariance could be factored.
    pub(super) fn conclude(&mut self) -> Option<Peak> {
        let best = self.best.as_ref().filter(|best| best.value > f64::MIN)?;
        let (length_scales, noise) = self.sought.parameters(&best.x);
        let profile = self.likelihood.profile(&length_scales, noise, &self.scale, None).ok()?;
        let (signal_sd, mean) = (profile.signal_sd, profile.mean);
        Some(Peak {
            hyperparameters: Hyperparameters::new(signal_sd, length_scales, noise, mean),
            log_likelihood: profile.log_likelihood,
            stop: best.stop,
        })
    }

    fn grid_point(&self, index: usize, levels: &[usize]) -> Vec<f64> {
        digits(index, levels)
            .zip(levels)
            .zip(self.bounds.lower.iter().zip(self.bounds.upper))
            .map(|((digit, &levels), (lower, upper))| {
                lower + (upper - lower) * digit as f64 / (levels.max(2) - 1) as f64
            })
            .collect()
    }

    /// Grid points per parameter, the noises last.
    fn levels(&self) -> Vec<usize> {
        let lengths = self.sought.length_scales.len();
        let per_length = match lengths {
            1 => 18,
            2 => 8,
            _ => 5,
        };
        let mut levels = vec![per_length; lengths];
        levels.resize(self.bounds.lower.len(), NOISE_LEVELS);
        levels
    }
}

/// Log likelihood plus log priors at `x`, with the gradient if asked; NaN where the covariance
/// cannot be factored.
fn score(
    sought: &SearchBox,
    likelihood: &mut Likelihood,
    scale: &Scale,
    x: &[f64],
    mut gradient: Option<&mut [f64]>,
) -> f64 {
    let (lengths, noise) = sought.parameters(x);
    let profile = likelihood.profile(&lengths, noise, scale, gradient.as_deref_mut());
    let Ok(profile) = profile else { return f64::NAN };
    let mut score = profile.log_likelihood + scale.log_prior(profile.signal_sd);
    for (i, (range, &log)) in sought.ranges().zip(x).enumerate() {
        let Some(prior) = range.prior else { continue };
        score += prior.log_density(log);
        if let Some(slope) = gradient.as_deref_mut().and_then(|gradient| gradient.get_mut(i)) {
            *slope += prior.slope(log);
        }
    }
    score
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
