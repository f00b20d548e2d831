//! Hyperparameters by maximum likelihood (Rasmussen & Williams 2006, section 5.4.1): a coarse scan
//! finds the local maxima of the profiled likelihood, and BFGS refines those that may be the
//! highest.

use super::kernel::{Hyperparameters, KERNELS, Kernel};
use super::likelihood::{Likelihood, ProfiledLikelihood};
use super::observations::Observations;
use super::scan::{Grid, Scan};
use super::search_box::{Range, SearchBox, SignalModel, TouchNoise};
use crate::math::bfgs::{BfgsClimb, BfgsOptions, climb};
use crate::math::optimize::{Bounds, Optimum, Stop};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Result of a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// Name of the most likely kernel, if there were several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kernel: Option<String>,
    /// Most probable hyperparameters.
    #[serde(flatten)]
    pub hyperparameters: Hyperparameters,
    /// Log marginal likelihood of the hyperparameters.
    pub log_likelihood: f64,
    /// Largest residual standard deviation of a touch given the inducing touches, if the posterior
    /// is approximate.
    #[serde(default, alias = "left_sd", skip_serializing_if = "Option::is_none")]
    pub nystrom_residual_sd: Option<f64>,
    /// Number of full covariance factorisations; rows appended during the scan are not counted.
    pub factorisations: u32,
    /// Number of observations at the last scan of the whole box.
    pub scanned_at: usize,
    /// Reason why the best BFGS run stopped.
    pub stop: Stop,
}

/// Number of heights up to which each fit scans the whole box; a
/// heuristic: the scans need 8 MB.
const SCAN_ALWAYS: usize = 128;
/// Growth of the observations since the last scan at which a larger fit, or one with slopes, scans
/// again; in between it climbs from the last optimum; a heuristic.
const SCAN_AGAIN: f64 = 1.2;
/// Number of observations above which the scan uses every second one, with twice as many every
/// fourth, and so on. A heuristic: with 150 of 300, surfaces of two scales and surfaces with edges
/// were confused.
const HALVED: usize = 1024;

/// Sequence of fits of growing observations with one kernel; each starts from the last one's
/// optimum.
#[derive(Clone)]
pub struct RefitSequence {
    kernel: &'static dyn Kernel,
    /// State of the search of the whole box, and of the search with the noise fixed at the
    /// sensor's.
    free: FitState,
    bound: FitState,
}

/// State that one fit passes to the next.
#[derive(Clone, Default)]
struct FitState {
    last: Option<Fit>,
    /// Negative second derivatives at the optimum of the last fit.
    curvature: Vec<f64>,
    /// Cached factors, shared because beliefs are cloned more often than fitted.
    scan: Arc<Scan>,
    /// Climbs of the last fit.
    tracks: Vec<Track>,
}

/// A climb that the next fit continues instead of starting it anew.
#[derive(Clone)]
struct Track {
    /// Place of the scan from which it started; `None` for shorter lengths than the last optimum's.
    hill: Option<Vec<f64>>,
    end: Vec<f64>,
    /// Negative second derivatives at its end.
    curvature: Vec<f64>,
    /// Rise from its start to its end, in nats per height, when it was last started anew.
    rise: f64,
}

impl RefitSequence {
    /// Creates an empty sequence.
    pub fn new(kernel: &'static dyn Kernel) -> Self {
        Self { kernel, free: FitState::default(), bound: FitState::default() }
    }

    /// Returns the kernel.
    pub fn kernel(&self) -> &'static dyn Kernel {
        self.kernel
    }

    /// Runs [`SearchBox::fit`] on at least the observations of the last call.
    ///
    /// The last optimum is an additional start, or, unless the box must be scanned again, the only
    /// one besides shorter lengths. Climbs from the same starts as in the last call are continued.
    pub fn fit(&mut self, sought: &SearchBox, observations: &Observations) -> Fit {
        let TouchNoise::AtLeast(least) = sought.touch_noise else {
            return self.free.fit(sought, self.kernel, observations);
        };
        let within = |touch_noise| SearchBox { touch_noise, ..sought.clone() };
        let free = self.free.fit(&within(TouchNoise::Fitted), self.kernel, observations);
        if free.hyperparameters.noise_sd >= least {
            return free;
        }
        let known = within(TouchNoise::Known(least));
        let bound = self.bound.fit(&known, self.kernel, observations);
        Fit { factorisations: free.factorisations + bound.factorisations, ..bound }
    }
}

impl FitState {
    fn fit(
        &mut self,
        sought: &SearchBox,
        kernel: &'static dyn Kernel,
        observations: &Observations,
    ) -> Fit {
        let (lower, upper) = sought.log_bounds();
        let mut search = Search::new(sought, kernel, observations, &lower, &upper);
        search.known = std::mem::take(&mut self.tracks);
        let count = observations.len();
        let is_recent = |last: &&Fit| count as f64 <= SCAN_AGAIN * last.scanned_at as f64;
        let last = self.last.as_ref();
        let is_searched = sought.is_signal_searched() || observations.has_known_errors();
        // Factors of heights alone are kept from scan to scan; others would be computed anew.
        let is_plain = !observations.has_slopes() && !is_searched;
        let is_cheap = count <= SCAN_ALWAYS && is_plain;
        let is_kept = last.is_some() && is_cheap;
        let recent = last.filter(is_recent).filter(|_| !is_cheap);
        let mut in_half = 0;
        if !observations.is_empty() {
            if let Some(last) = last {
                let start = sought.log_parameters(&last.hyperparameters);
                search.climb(&start, Some(&self.curvature));
            }
            match recent {
                Some(last) => {
                    let mut start = sought.log_parameters(&last.hyperparameters);
                    sought.shorter_lengths(&mut start, &lower, &upper);
                    let value = search.value(&start);
                    search.climb_again(None, &start, value);
                }
                // A single fit has no successor, and no state needs to be stored.
                None if is_kept => {
                    search.scan(Some(Arc::make_mut(&mut self.scan)));
                }
                None if count > HALVED => {
                    let half = sought.fit(kernel, &observations.subsample(2));
                    in_half = half.factorisations;
                    search.climb(&sought.log_parameters(&half.hyperparameters), None);
                }
                None => search.scan(None),
            }
            search.cross_noise();
        }
        let factorisations = in_half + search.likelihood.factorisations();
        self.tracks = search.tracks;
        let (hyperparameters, log_likelihood, stop) = match search.best {
            Some(Maximum { x, profile, stop, curvature, .. }) => {
                self.curvature = curvature;
                let (lengths, noise) = sought.parameters(&x);
                let at = Hyperparameters::new(profile.signal_sd, lengths, noise, profile.mean);
                let common_sd = sought.common_ratio.map(|_| noise.known * profile.signal_sd);
                (Hyperparameters { common_sd, ..at }, profile.log_likelihood, stop)
            }
            None => {
                self.curvature.clear();
                (sought.middle(&lower, &upper), 0.0, Stop::Failed)
            }
        };
        if !is_kept {
            self.scan = Arc::default();
        }
        let fit = Fit {
            kernel: None,
            hyperparameters,
            log_likelihood,
            nystrom_residual_sd: None,
            factorisations,
            scanned_at: recent.map_or(count, |last| last.scanned_at),
            stop,
        };
        self.last.insert(fit).clone()
    }
}

impl SearchBox {
    /// Maximises the marginal likelihood, times the priors if given, globally and
    /// deterministically.
    ///
    /// The likelihood is profiled over signal_sd, which has a closed form, so the search runs over
    /// (ln lengths, ln noise ratio, ln slope noise ratio if there is one) only. Without
    /// observations, or if no covariance can be factored, returns the middle of the box with
    /// [`Stop::Failed`].
    ///
    /// A noise with a lower bound (the sensor's) is fitted, and is set to the bound if less would
    /// be more likely.
    pub fn fit(&self, kernel: &'static dyn Kernel, observations: &Observations) -> Fit {
        RefitSequence::new(kernel).fit(self, observations)
    }

    /// Returns the hyperparameters before any touch: the geometric middle of the box.
    fn middle(&self, lower: &[f64], upper: &[f64]) -> Hyperparameters {
        let middle: Vec<f64> = lower.iter().zip(upper).map(|(l, u)| 0.5 * (l + u)).collect();
        let (length_scales, noise) = self.parameters(&middle);
        let signal_sd = match self.touch_noise {
            TouchNoise::Known(noise_sd) => noise_sd / noise.height,
            TouchNoise::Fitted | TouchNoise::AtLeast(_) => {
                (self.signal_sd.low * self.signal_sd.high).sqrt()
            }
        };
        Hyperparameters::new(signal_sd, length_scales, noise, 0.0)
    }
}

/// Options of a climb: it ends at a predicted gain of 1e-4 nat, which no data can resolve. The
/// first step is a third of the distance between two places of the scan; heuristics.
const MANNER: BfgsOptions =
    BfgsOptions { first_step: 0.05, gain: 1e-4, relative_gain: 0.0, budget: 100 };
/// Factor on the predicted gain; a climb is stopped if it would stay below the highest optimum even
/// then; a heuristic. See [`SearchBox::fit`] for the optima that this misses.
const HOPE: f64 = 4.0;
/// Distance from the highest optimum, in units of the box's sides, at which a lower climb stops.
const SAME_TOP: f64 = 0.02;
/// Step, in logarithms, to which the scan rounds bounds that follow the heights' scale.
// heuristic: a factor of ten, which the scale of a surface's heights rarely crosses.
const ROUNDED: f64 = std::f64::consts::LN_10;
/// Largest number of local maxima of the scan that are refined; a heuristic: of 1600 fits of the
/// toy, the bird and soft fingers on it, 2 % miss a higher one by more than a thousandth of a nat.
const CLIMBS: usize = 3;
/// Change of the rise from a climb's start to its end up to which the next fit continues it: nats,
/// and a share of the rise. A heuristic: the climbs are half of those without it, and as many
/// optima are missed.
const SAME_RISE: [f64; 2] = [0.3, 0.2];
/// Difference in nats below which optima are the same; a heuristic: above the likelihood's
/// rounding.
const GAIN_MIN: f64 = 1e-6;
/// Largest drop of the log likelihood, in nats, at another noise for which a climb from there is
/// worth trying; a heuristic.
const NEARLY_AS_LIKELY: f64 = 0.3;

/// Highest optimum so far.
struct Maximum {
    x: Vec<f64>,
    score: f64,
    profile: ProfiledLikelihood,
    /// Reason why the climb to the optimum stopped.
    stop: Stop,
    /// Negative second derivatives there, for the next climb in the same box.
    curvature: Vec<f64>,
}

impl Maximum {
    /// Whether a place in the box is beside it.
    fn is_beside(&self, x: &[f64], bounds: Bounds) -> bool {
        let mut sides = x.iter().zip(&self.x).zip(bounds.lower.iter().zip(bounds.upper));
        sides.all(|((x, top), (lower, upper))| (x - top).abs() <= SAME_TOP * (upper - lower))
    }
}

/// One search of a box, over (ln lengths, ln noise ratio, ln slope noise ratio if there is one).
struct Search<'a> {
    sought: &'a SearchBox,
    kernel: &'static dyn Kernel,
    observations: &'a Observations,
    likelihood: Likelihood<'a>,
    scale: SignalModel,
    bounds: Bounds<'a>,
    /// Highest optimum; `None` while no covariance could be factored.
    best: Option<Maximum>,
    /// Climbs of the last fit and of this one.
    known: Vec<Track>,
    tracks: Vec<Track>,
}

impl<'a> Search<'a> {
    /// Creates a search without results; `lower` and `upper` are the box's corners.
    fn new(
        sought: &'a SearchBox,
        kernel: &'static dyn Kernel,
        observations: &'a Observations,
        lower: &'a [f64],
        upper: &'a [f64],
    ) -> Self {
        let scale = match sought.touch_noise {
            TouchNoise::Known(noise_sd) => SignalModel::KnownNoise(noise_sd),
            _ if sought.is_signal_searched() => SignalModel::Searched,
            TouchNoise::Fitted | TouchNoise::AtLeast(_) => SignalModel::Profiled(sought.signal_sd),
        };
        let likelihood = Likelihood::new(kernel, sought.mean, observations);
        let bounds = Bounds { lower, upper };
        let (known, tracks) = (Vec::new(), Vec::new());
        Self { sought, kernel, observations, likelihood, scale, bounds, best: None, known, tracks }
    }

    /// Returns log likelihood plus log priors at `x`; NaN if the covariance cannot be factored.
    fn value(&mut self, x: &[f64]) -> f64 {
        score(self.sought, &mut self.likelihood, &self.scale, x, None, &mut None)
    }

    fn best_score(&self) -> f64 {
        self.best.as_ref().map_or(f64::NEG_INFINITY, |best| best.score)
    }

    /// Climbs from `start`, if possible with the curvature of an earlier optimum, and keeps the
    /// result if it is the highest so far. Returns the end and the curvature there.
    fn climb(&mut self, start: &[f64], curvature: Option<&[f64]>) -> (Optimum, Vec<f64>) {
        let Self { sought, likelihood, scale, bounds, best, .. } = self;
        let mut profile = None;
        let (mut here, mut highest) = (None, f64::NEG_INFINITY);
        let is_worth = |climb: &BfgsClimb| {
            let Some(best) = &best else { return true };
            let is_lower = climb.best().value < best.score;
            let is_hopeless =
                climb.has_curvature_estimate() && climb.upper_bound(HOPE) < best.score;
            !(is_lower && (is_hopeless || best.is_beside(&climb.best().x, *bounds)))
        };
        let start = BfgsClimb::new(*bounds, start, curvature, MANNER);
        let (top, curvature) = climb(start, is_worth, |x, gradient| {
            let value = score(sought, likelihood, scale, x, Some(gradient), &mut here);
            if value > highest {
                (highest, profile) = (value, here);
            }
            value
        });
        if let Some(profile) = profile.filter(|_| top.value > self.best_score() + GAIN_MIN) {
            let (x, score, stop) = (top.x.clone(), top.value, top.stop);
            self.best = Some(Maximum { x, score, profile, stop, curvature: curvature.clone() });
        }
        (top, curvature)
    }

    /// Climbs from a hill of the scan, or from shorter lengths: `place`, with score `value`.
    ///
    /// If the last fit did so, continues from the end of that climb, unless the rise to there has
    /// changed: then another end may be higher.
    fn climb_again(&mut self, hill: Option<Vec<f64>>, place: &[f64], value: f64) {
        let count = self.observations.order() as f64;
        let known = self.known.iter().position(|track| track.hill == hill);
        if let Some(track) = known.map(|at| self.known.swap_remove(at)) {
            let best = self.best.as_ref().filter(|best| best.is_beside(&track.end, self.bounds));
            let (end, curvature, score) = match best {
                Some(best) => (best.x.clone(), best.curvature.clone(), best.score),
                None => {
                    let (top, curvature) = self.climb(&track.end, Some(&track.curvature));
                    (top.x, curvature, top.value)
                }
            };
            let expected = count * track.rise;
            if (score - value - expected).abs() <= SAME_RISE[0] + SAME_RISE[1] * expected.abs() {
                self.tracks.push(Track { end, curvature, ..track });
                return;
            }
        }
        let (top, curvature) = self.climb(place, None);
        let rise = (top.value - value) / count;
        self.tracks.push(Track { hill, end: top.x, curvature, rise });
    }

    /// Evaluates a grid over the box and climbs its highest hills, except those that cannot exceed
    /// the best optimum. With a `scan`, reuses its cached factors.
    fn scan(&mut self, scan: Option<&mut Scan>) {
        // A searched signal starts at one value.
        let (noises, bounds) = (self.sought.noises(), self.bounds);
        let [mut lower, mut upper] =
            [bounds.lower, bounds.upper].map(|ends| ends[..noises.end].to_vec());
        if let TouchNoise::Known(_) = self.sought.touch_noise {
            // The ratio's bounds follow the heights' scale, which each touch changes. Rounded
            // outwards they are the same from touch to touch, and the cached factors remain valid.
            let (low, high) = (&mut lower[noises.start], &mut upper[noises.start]);
            (*low, *high) =
                ((*low / ROUNDED).floor() * ROUNDED, (*high / ROUNDED).ceil() * ROUNDED);
        }
        // Without kept factors each place is a factorisation: a climb's slope noise serves.
        if let Some(best) = self.best.as_ref().filter(|_| scan.is_none()) {
            let slopes = noises.start + 1..noises.end;
            lower[slopes.clone()].copy_from_slice(&best.x[slopes.clone()]);
            upper[slopes.clone()].copy_from_slice(&best.x[slopes.clone()]);
        }
        let grid =
            Grid::new(Bounds { lower: &lower, upper: &upper }, self.sought.length_scales.len());
        let signal = self.sought.start_sd.filter(|_| self.sought.is_signal_searched());
        let middle = |range: Range| (range.low * range.high).sqrt();
        let last = signal.or(self.sought.common_ratio.map(middle));
        let place = |index: usize| {
            let mut place = grid.place(index);
            let ends = bounds.lower.iter().zip(bounds.upper);
            place.iter_mut().zip(ends).for_each(|(at, (low, high))| *at = at.clamp(*low, *high));
            place.extend(last.map(f64::ln));
            place
        };
        let known = scan.map(|scan| {
            scan.profiles(self.sought, &grid, &self.scale, self.kernel, self.observations)
        });
        let Self { sought, likelihood, scale, .. } = self;
        let values: Vec<f64> = (0..grid.len())
            .map(|index| {
                let at = place(index);
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
                let place = place(hill);
                self.climb_again(Some(place.clone()), &place, values[hill]);
            }
        }
    }

    /// Climbs from the smallest and the largest noise with the best lengths, if the data are nearly
    /// as likely there: noise and lengths may trade off, and give two optima that differ little.
    fn cross_noise(&mut self) {
        let Some(best) = &self.best else { return };
        let (value, top, curvature) = (best.score, best.x.clone(), best.curvature.clone());
        for noise in self.sought.noises() {
            for level in [self.bounds.lower[noise], self.bounds.upper[noise]] {
                let mut at = top.clone();
                at[noise] = level;
                let is_near = (level - top[noise]).abs()
                    <= SAME_TOP * (self.bounds.upper[noise] - self.bounds.lower[noise]);
                if is_near {
                    continue;
                }
                if self.value(&at) > value - NEARLY_AS_LIKELY {
                    self.climb(&at, Some(&curvature));
                }
            }
        }
    }
}

/// Returns log likelihood plus log priors at `x`, with the gradient if requested; NaN if the
/// covariance cannot be factored.
fn score(
    sought: &SearchBox,
    likelihood: &mut Likelihood,
    scale: &SignalModel,
    x: &[f64],
    mut gradient: Option<&mut [f64]>,
    found: &mut Option<ProfiledLikelihood>,
) -> f64 {
    let (lengths, noise) = sought.parameters(x);
    let profile = likelihood.profile(&lengths, noise, scale, gradient.as_deref_mut());
    let Ok(profile) = profile else { return f64::NAN };
    *found = Some(profile);
    for (i, (range, &log)) in sought.ranges().zip(x).enumerate() {
        let Some(prior) = range.prior else { continue };
        if let Some(slope) = gradient.as_deref_mut().and_then(|gradient| gradient.get_mut(i)) {
            *slope += prior.slope(log);
        }
    }
    with_priors(sought, scale, x, &profile)
}

/// Returns log likelihood plus log priors at `x`.
fn with_priors(sought: &SearchBox, scale: &SignalModel, x: &[f64], at: &ProfiledLikelihood) -> f64 {
    let priors = sought.ranges().zip(x).filter_map(|(range, &log)| {
        let prior = range.prior?;
        Some(prior.log_density(log))
    });
    priors.fold(at.log_likelihood + scale.log_prior(at.signal_sd), |sum, prior| sum + prior)
}

/// One or several kernels, of which each fit selects the most likely.
#[derive(Clone)]
pub struct KernelSelection {
    /// Fits by kernel name.
    candidates: Vec<(&'static str, RefitSequence)>,
    chosen: usize,
}

impl KernelSelection {
    /// Creates a selection between the kernels of these names, the first one until there is a fit.
    /// Unknown names are skipped; if none is left, the kernel is the squared exponential.
    pub fn new(names: &[String]) -> Self {
        let candidate = |(name, kernel): &(&'static str, &'static dyn Kernel)| {
            (*name, RefitSequence::new(*kernel))
        };
        let known = KERNELS.iter().filter(|(name, _)| names.iter().any(|asked| asked == name));
        let mut candidates: Vec<_> = known.map(candidate).collect();
        if candidates.is_empty() {
            candidates.extend(KERNELS.first().map(candidate));
        }
        Self { candidates, chosen: 0 }
    }

    /// Returns the selected kernel.
    pub fn kernel(&self) -> &'static dyn Kernel {
        self.candidates[self.chosen].1.kernel()
    }

    /// Whether all kernels support slopes.
    pub fn has_slopes(&self) -> bool {
        self.candidates.iter().all(|(_, fits)| fits.kernel().has_slopes())
    }

    /// Fits all kernels and selects the most likely. The result names it if there are several; its
    /// factorisations are the sum over all.
    pub fn fit(&mut self, search_box: &SearchBox, observations: &Observations) -> Fit {
        let all = self.candidates.iter_mut();
        let fits: Vec<Fit> = all.map(|(_, fits)| fits.fit(search_box, observations)).collect();
        let likelihood = |i: &usize| fits[*i].log_likelihood;
        // The first of equally likely kernels.
        let likeliest =
            (0..fits.len()).rev().max_by(|a, b| likelihood(a).total_cmp(&likelihood(b)));
        self.chosen = likeliest.unwrap_or(0);
        let mut fit = fits[self.chosen].clone();
        fit.factorisations = fits.iter().map(|fit| fit.factorisations).sum();
        if let [_, _, ..] = self.candidates[..] {
            fit.kernel = Some(self.candidates[self.chosen].0.into());
        }
        fit
    }

    /// Selects the kernel of `fit`.
    pub fn select(&mut self, fit: &Fit) {
        let named =
            self.candidates.iter().position(|(name, _)| Some(*name) == fit.kernel.as_deref());
        self.chosen = named.unwrap_or(0);
    }
}
