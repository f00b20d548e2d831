//! How the most likely hyperparameters are sought: a coarse scan finds the hills of the profiled
//! likelihood, climbs go up those that may be the highest.

use super::kernel::{Hyperparameters, Kernel};
use super::likelihood::{Likelihood, ProfiledLikelihood};
use super::observations::Observations;
use super::range::Scale;
use super::scan::{Grid, Scan};
use super::search_box::{SearchBox, TouchNoise};
use crate::math::climb::{Climb, Manner, climb};
use crate::math::optimize::{Bounds, Stop};

/// A climb ends where less than a ten-thousandth of a nat is to be won, which no data could tell;
/// most need a tenth of the budget. The first step is a third of the way between two places of
/// the scan; all chosen.
const MANNER: Manner = Manner { first_step: 0.05, gain: 1e-4, relative_gain: 0.0, budget: 100 };
/// A climb is given up that would stay below the highest top if it won so many times what its
/// parabola says; chosen, see [`SearchBox::fit`] for what that misses.
const HOPE: f64 = 4.0;
/// Nor does it go on this near to the highest top, in units of the box's sides, and below it.
const SAME_TOP: f64 = 0.02;
/// Hills of the scan that are climbed at most; chosen: enough for the fits of the toy that were
/// held against a dense grid.
const CLIMBS: usize = 2;
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
    /// Minus the second derivatives there, for the next climb in the same box.
    pub curvature: Vec<f64>,
}

/// The highest top so far.
struct Top {
    x: Vec<f64>,
    score: f64,
    profile: ProfiledLikelihood,
    stop: Stop,
    curvature: Vec<f64>,
}

/// One search of a box, over (ln lengths, ln noise ratio, ln slope noise ratio if there is one).
pub(super) struct Search<'a> {
    sought: &'a SearchBox,
    kernel: &'static dyn Kernel,
    observations: &'a Observations,
    likelihood: Likelihood<'a>,
    scale: Scale,
    bounds: Bounds<'a>,
    best: Option<Top>,
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
        let bounds = Bounds { lower, upper };
        Self { sought, kernel, observations, likelihood, scale, bounds, best: None }
    }

    /// How many matrices were factored so far.
    pub(super) fn factorisations(&self) -> u32 {
        self.likelihood.factorisations()
    }

    fn best_score(&self) -> f64 {
        self.best.as_ref().map_or(f64::NEG_INFINITY, |best| best.score)
    }

    /// Climbs from `start`, if possible with the curvature of an earlier top, and keeps the top if
    /// it is the highest so far.
    pub(super) fn climb(&mut self, start: &[f64], curvature: Option<&[f64]>) {
        let Self { sought, likelihood, scale, bounds, best, .. } = self;
        let mut profile = None;
        let (mut here, mut highest) = (None, f64::NEG_INFINITY);
        let is_worth = |climb: &Climb| {
            let Some(best) = &best else { return true };
            let is_lower = climb.top().value < best.score;
            let apart = |((x, top), (lower, upper)): ((&f64, &f64), (&f64, &f64))| {
                (x - top).abs() > SAME_TOP * (upper - lower)
            };
            let sides = bounds.lower.iter().zip(bounds.upper);
            let is_apart = climb.top().x.iter().zip(&best.x).zip(sides).any(apart);
            let is_hopeless = climb.is_measured() && climb.hope(HOPE) < best.score;
            !(is_lower && (is_hopeless || !is_apart))
        };
        let start = Climb::new(*bounds, start, curvature, MANNER);
        let (top, curvature) = climb(start, is_worth, |x, gradient| {
            let value = score(sought, likelihood, scale, x, Some(gradient), &mut here);
            if value > highest {
                (highest, profile) = (value, here);
            }
            value
        });
        if let Some(profile) = profile.filter(|_| top.value > self.best_score() + GAIN_MIN) {
            let (x, score, stop) = (top.x, top.value, top.stop);
            self.best = Some(Top { x, score, profile, stop, curvature });
        }
    }

    /// Scores a grid over the box and climbs its highest hills, but for those that cannot reach
    /// what was found already. With a `scan` it is asked what it knows of the grid.
    pub(super) fn scan(&mut self, scan: Option<&mut Scan>) {
        let grid = Grid::new(self.bounds, self.sought.length_scales.len());
        let known = scan.map(|scan| {
            scan.profiles(self.sought, (&grid, &self.scale), self.kernel, self.observations)
        });
        let Self { sought, likelihood, scale, .. } = self;
        let values: Vec<f64> = (0..grid.len())
            .map(|index| {
                let at = grid.place(index);
                let known = known.as_ref().and_then(|known| known[index]);
                let score = match known {
                    Some(profile) => with_priors(sought, scale, &at, &profile),
                    None => score(sought, likelihood, scale, &at, None, &mut None),
                };
                if score.is_nan() { f64::NEG_INFINITY } else { score }
            })
            .collect();
        for (hill, rise) in grid.hills(&values).into_iter().take(CLIMBS) {
            if values[hill] + rise > self.best_score() {
                self.climb(&grid.place(hill), None);
            }
        }
    }

    /// Climbs from the least and the largest noise beside the best lengths, if the data are nearly
    /// as likely there: noise and lengths may trade, and leave two tops that differ little.
    pub(super) fn cross_noise(&mut self) {
        let Some(best) = &self.best else { return };
        let (value, top) = (best.score, best.x.clone());
        for noise in self.sought.length_scales.len()..top.len() {
            for level in [self.bounds.lower[noise], self.bounds.upper[noise]] {
                let mut at = top.clone();
                at[noise] = level;
                let is_near = (level - top[noise]).abs()
                    <= SAME_TOP * (self.bounds.upper[noise] - self.bounds.lower[noise]);
                if is_near {
                    continue;
                }
                let score =
                    score(self.sought, &mut self.likelihood, &self.scale, &at, None, &mut None);
                if score > value - NEARLY_AS_LIKELY {
                    self.climb(&at, None);
                }
            }
        }
    }

    /// The highest top; none if no covariance could be factored.
    pub(super) fn conclude(&mut self) -> Option<Peak> {
        let Top { x, profile, stop, curvature, .. } = self.best.take()?;
        let (length_scales, noise) = self.sought.parameters(&x);
        let (signal_sd, mean) = (profile.signal_sd, profile.mean);
        Some(Peak {
            hyperparameters: Hyperparameters::new(signal_sd, length_scales, noise, mean),
            log_likelihood: profile.log_likelihood,
            stop,
            curvature,
        })
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
    told: &mut Option<ProfiledLikelihood>,
) -> f64 {
    let (lengths, noise) = sought.parameters(x);
    let profile = likelihood.profile(&lengths, noise, scale, gradient.as_deref_mut());
    let Ok(profile) = profile else { return f64::NAN };
    *told = Some(profile);
    for (i, (range, &log)) in sought.ranges().zip(x).enumerate() {
        let Some(prior) = range.prior else { continue };
        if let Some(slope) = gradient.as_deref_mut().and_then(|gradient| gradient.get_mut(i)) {
            *slope += prior.slope(log);
        }
    }
    with_priors(sought, scale, x, &profile)
}

/// Log likelihood plus log priors at `x`.
fn with_priors(sought: &SearchBox, scale: &Scale, x: &[f64], at: &ProfiledLikelihood) -> f64 {
    let priors = sought.ranges().zip(x).filter_map(|(range, &log)| {
        let prior = range.prior?;
        Some(prior.log_density(log))
    });
    priors.fold(at.log_likelihood + scale.log_prior(at.signal_sd), |sum, prior| sum + prior)
}
