//! Belief of a whole object: a Gaussian process over space whose zero set is the surface, negative
//! inside (Williams & Fitzgibbon 2007).

mod like;

use super::evidence::{
    CameraPose, CommonError, ObservationModel, PriorMean, SpatialEvidence, half_axes_m,
};
use super::scope::ExplorationSetup;
use super::settings::{PriorShape, SpatialGpSettings};
use super::surface::Surface;
use crate::evidence::{End, Evidence, Outcome};
use crate::gp_settings::{COMMON_ERROR_M, COMMON_RANGE};
use crate::recognition::KnownShape;
use crate::task::{Aim, Ball, Target};
use crate::view::{LookOffer, RigidError, SeenSurface};
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;
use palpate_gp::kernel;
use palpate_gp::kernel::{Kernel, Matern52};
use palpate_gp::likelihood::Likelihood;
use palpate_gp::math::optimize::compass;
use palpate_gp::means::MeanField;
use palpate_gp::{
    Hyperparameters, LogNormal, MeanModel, NoiseRatio, Observations, Posterior, Range, SignalModel,
};
use serde::{Deserialize, Serialize};

/// Belief of one trial around a whole object.
#[derive(Clone, Serialize, Deserialize)]
pub struct ImplicitSurface {
    scope: ExplorationSetup,
    settings: SpatialGpSettings,
    #[serde(skip, default = "default_kernel")]
    kernel: &'static dyn Kernel,
    evidence: SpatialEvidence,
    asked: Vec<Aim>,
    fit: Option<Fit>,
    /// Hyperparameters that the last fit started from.
    start: Option<Hyperparameters>,
    /// Shapes that the object may be like, with their probabilities: the prior mean is theirs.
    #[serde(skip)]
    shapes: Vec<KnownShape>,
    #[serde(skip)]
    surface: Option<Surface>,
}

/// Kernel in place of that of a stored belief.
fn default_kernel() -> &'static dyn Kernel {
    &Matern52
}

/// Signal's standard deviation before the first fit, as a fraction of the radius of the ball around
/// the contacts, and its bounds. Heuristics:
/// the field is a distance,
/// and the object fills a part of the ball.
const SIGNAL: f64 = 0.5;
const SIGNAL_RANGE: [f64; 2] = [1e-2, 1e2];

/// Standard deviation of the difference between objects of a kind, as a fraction of their radius.
// heuristic: as for a shape near to one of the library, on an object for a hand.
const RELATED: LogNormal = LogNormal { median: 0.1, spread: 3.0 };

/// Largest length over which objects of a kind differ alike, as a fraction of their radius.
// heuristic: half the size of an object for a hand; few contacts would make it any length.
const ALIKE: f64 = 0.5;

/// Computational budget of a fit in cubed matrix sizes, with at least [`TRIED_MIN`] factorisations;
/// a heuristic: some ten milliseconds.
const CUBES: f64 = 2e8;
const TRIED_MIN: f64 = 3.0;
const TRIED_MAX: f64 = 60.0;

/// Bounds of the exponent of the object's extent along an axis in the length scale along it: with a
/// larger one, a flat object bends within its thickness and a long one slowly along its length.
const EXPONENT: [f64; 2] = [0.0, 1.0];

/// Number of rows of the covariance above which hyperparameters are kept until the observations
/// have grown by this factor since the last search.
// heuristic: a search costs four factorisations, 30 ms of this order; between, one is left.
const KEPT_ROWS: usize = 1000;
const SEARCH_AGAIN: f64 = 1.05;

/// Largest number of new rows with which a posterior is extended, as a fraction of all.
// heuristic: one after the other they take as long as a factorisation, which has a third of the
// operations for each, but many of them at once.
const NEW: f64 = 0.05;

/// Largest number of rows of the covariance with which hyperparameters are searched; of more, every
/// second observation is used, or every third, and so on.
// heuristic: a few hundred touches fix one length and three standard deviations.
const SEARCHED_ROWS: usize = 3000;

/// First step of the first fit, first step of later fits, and smallest step, in logarithms;
/// heuristics.
const STEP_FIRST: f64 = 0.7;
const STEP_NEXT: f64 = 0.35;
const STEP_LAST: f64 = 0.1;

/// Clearance from the estimated surface along an approach, and the lengths of the first and of
/// later steps along it, in fingertip radii; heuristics.
const ROOM: f64 = 0.7;
const FIRST: f64 = 1.5;
const STEP: f64 = 0.7;

/// Smallest distance between two points of a stroke, as a fraction of the ball's radius.
// heuristic: a few points for each length over which a surface changes.
const STROKE_STEP: f64 = 0.12;

impl ImplicitSurface {
    /// Creates a belief without data.
    pub fn new(scope: ExplorationSetup, settings: SpatialGpSettings) -> Self {
        let kernel = kernel::by_name(&settings.kernel).unwrap_or(&Matern52);
        let (evidence, asked) = (SpatialEvidence::default(), Vec::new());
        let (fit, start, shapes, surface) = (None, None, Vec::new(), None);
        Self { scope, settings, kernel, evidence, asked, fit, start, shapes, surface }
    }

    /// Adds what an action at `target` has shown; the belief changes at the next
    /// [`refit`](Self::refit). A target of another region shows nothing.
    pub fn observe(&mut self, target: &Target, outcome: &Outcome) {
        match (target.aim(), outcome.end) {
            (Some(aim), _) => self.asked.push(*aim),
            (None, End::Looked) => {}
            (None, _) => return,
        }
        outcome.evidence.iter().for_each(|evidence| self.add(evidence));
    }

    /// Adds evidence; the belief changes at the next [`refit`](Self::refit).
    pub fn add(&mut self, evidence: &Evidence) {
        self.evidence.add(evidence, STROKE_STEP * self.scope.ball.radius_m);
    }

    /// Returns what a look would show of `points` of the estimated surface with their normals;
    /// `None` before the first fit.
    pub fn imagined(
        &self,
        offer: &LookOffer,
        points: impl Iterator<Item = (Point3<f64>, UnitVector3<f64>)>,
    ) -> Option<SeenSurface> {
        let surface = self.surface()?;
        let hides_m = 2.0 * self.scope.ball.radius_m;
        let is_free = |p_w: &Point3<f64>| surface.value(p_w) > 0.0;
        let gradient = |normal_w: &UnitVector3<f64>| normal_w.into_inner();
        Some(SeenSurface::imagined(offer, points, hides_m, is_free, gradient))
    }

    /// The surfaces that cameras have seen, one per view.
    pub fn seen(&self) -> &[SeenSurface] {
        &self.evidence.seen
    }

    /// Returns the error of the camera's pose in each view, after a fit.
    pub fn rigid_errors(&self) -> Vec<RigidError> {
        self.seen().iter().map(SeenSurface::rigid_error).collect()
    }

    /// Fits the length scales' mean, the exponent of the extents in them, and the noises by maximum
    /// likelihood, and conditions on all touches.
    ///
    /// Coordinate search from the last optimum: a step along each parameter in turn, halved if none
    /// improves. The fit follows its optimum from touch to touch, and a large covariance is
    /// factored only three times; a very large one is searched again, with a part of the
    /// observations, after it has grown, and extended in between.
    ///
    /// # Errors
    /// If the covariance of the touches cannot be factored. The last fit stays, without a surface.
    pub fn refit(&mut self) -> Result<(&Fit, &Surface), CovarianceError> {
        let surface = self.surface.take();
        let start = self.fit.as_ref().map(|fit| fit.hyperparameters.clone());
        let (prior, observations) = self.observations(start.as_ref());
        let step = observations.order().div_ceil(SEARCHED_ROWS);
        let (fit, posterior) = match self.fit.clone().filter(|last| is_kept(last, &observations)) {
            Some(last) => self.keep(last, surface, &observations)?,
            None if step > 1 => {
                let found = self.search(start.as_ref(), &observations.subsample(step))?;
                let found = Fit { scanned_at: observations.len(), ..found };
                self.conditioned(found, &observations)?
            }
            None => (self.search(start.as_ref(), &observations)?, None),
        };
        self.conclude(prior, observations, start, fit, posterior)
    }

    /// Returns the last fit with its likelihood of `observations`, and the posterior, unless errors
    /// of cameras' poses are added to it. The last posterior is extended, if that is possible.
    fn keep(
        &self,
        last: Fit,
        surface: Option<Surface>,
        observations: &Observations,
    ) -> Result<(Fit, Option<Posterior>), CovarianceError> {
        let at = &last.hyperparameters;
        let is_whole = self.evidence.seen.is_empty();
        let known = surface.filter(|_| is_whole).map(Surface::into_posterior);
        let most = (NEW * observations.order() as f64) as usize;
        let extended = known.and_then(|known| known.extended(most, at.clone(), observations));
        if let Some((posterior, log_likelihood)) = extended {
            return Ok((Fit { log_likelihood, factorisations: 0, ..last }, Some(posterior)));
        }
        self.conditioned(Fit { factorisations: 0, ..last }, observations)
    }

    /// Returns the fit with its likelihood of `observations`, and the posterior, unless errors of
    /// cameras' poses are added to it.
    fn conditioned(
        &self,
        fit: Fit,
        observations: &Observations,
    ) -> Result<(Fit, Option<Posterior>), CovarianceError> {
        let at = &fit.hyperparameters;
        let mut likelihood = Likelihood::new(self.kernel, MeanModel::Zero, observations);
        let log_likelihood = likelihood.value_gradient(at, &mut [])?;
        let is_whole = self.evidence.seen.is_empty();
        let posterior = is_whole.then(|| likelihood.posterior(at.clone()));
        let factorisations = fit.factorisations + 1;
        Ok((Fit { log_likelihood, factorisations, ..fit }, posterior))
    }

    /// Conditions on all touches with the given fit, which started from `last`, e.g. to draw a
    /// recorded belief.
    ///
    /// # Errors
    /// If the covariance of the touches cannot be factored.
    pub fn condition(&mut self, last: Option<&Fit>, fit: &Fit) -> Result<(), CovarianceError> {
        self.condition_from(last.map(|last| last.hyperparameters.clone()), fit)
    }

    /// Conditions a stored belief again.
    ///
    /// # Errors
    /// If the covariance of the touches cannot be factored.
    pub(crate) fn restore(&mut self) -> Result<(), CovarianceError> {
        self.kernel = kernel::by_name(&self.settings.kernel).unwrap_or(&Matern52);
        let start = self.start.take();
        self.fit.take().map_or(Ok(()), |fit| self.condition_from(start, &fit))
    }

    fn condition_from(
        &mut self,
        start: Option<Hyperparameters>,
        fit: &Fit,
    ) -> Result<(), CovarianceError> {
        let (prior, observations) = self.observations(start.as_ref());
        self.conclude(prior, observations, start, fit.clone(), None).map(|_| ())
    }

    fn conclude(
        &mut self,
        prior: PriorMean,
        observations: Observations,
        start: Option<Hyperparameters>,
        fit: Fit,
        known: Option<Posterior>,
    ) -> Result<(&Fit, &Surface), CovarianceError> {
        let posterior = |all| Posterior::new(self.kernel, fit.hyperparameters.clone(), all);
        let (mut posterior, pose_errors) = match (known, self.evidence.seen.is_empty()) {
            (Some(known), _) => (known, Vec::new()),
            (None, true) => (posterior(observations)?, Vec::new()),
            (None, false) => {
                let (_, all) = self.observations_given(start.as_ref(), CameraPose::Certain);
                let given = posterior(all)?;
                let errors = self.pose_errors(&given, &observations);
                (given, errors)
            }
        };
        posterior.inflate(self.settings.sd_inflation);
        let offset_m = self.settings.offset_m.unwrap_or(self.scope.offset_m);
        let (scope, points) = (&self.scope, self.points());
        let parts = self.parts(start.as_ref(), &posterior);
        let surface = Surface::new(scope, prior, posterior, pose_errors, points.iter(), offset_m);
        let surface = surface.with_parts(parts);
        self.start = start;
        Ok((self.fit.insert(fit), self.surface.insert(surface)))
    }

    /// Returns the fields that the errors of the cameras' poses add to the mean of `given`, each
    /// with a standard normal factor. `uncertain` are the same observations with these errors.
    fn pose_errors(&self, given: &Posterior, uncertain: &Observations) -> Vec<MeanField> {
        let loadings = (0..self.seen().len()).flat_map(|number| uncertain.loadings(number));
        loadings.map(|column| MeanField::response(given, column)).collect()
    }

    /// Returns the ball around all that was touched or seen, and around the likeliest shape.
    pub fn estimated_ball(&self) -> Ball {
        let points = self.points();
        let corners = self.shapes.first().map(KnownShape::bounds);
        self.scope.ball_around(points.iter().chain(corners.iter().flatten()))
    }

    /// Registers the views, and returns the observations, in units of the noise of `last`.
    fn observations(&mut self, last: Option<&Hyperparameters>) -> (PriorMean, Observations) {
        self.evidence.register();
        self.observations_given(last, CameraPose::Uncertain)
    }

    /// Returns the observations for these poses of the cameras.
    ///
    /// A Gaussian process that infers the poses itself is misled by its prior: the surface may fit
    /// a smoother one if it is elsewhere. So the poses are those of registration, and their errors
    /// are added to the deviations: a cut of the inference (Plummer 2015).
    fn observations_given(
        &self,
        last: Option<&Hyperparameters>,
        pose: CameraPose,
    ) -> (PriorMean, Observations) {
        let prior = match self.shapes.is_empty() {
            true => {
                PriorMean::about(self.settings.prior, &self.estimated_ball(), self.points().iter())
            }
            false => PriorMean::Shapes(self.shapes.clone()),
        };
        let observations = self.relative_to(&prior, last, pose);
        (prior, observations)
    }

    /// Standard deviation of a contact that counts as exact, m: the noise before a fit.
    pub(super) fn noise_unit_m(&self, before: Option<&Hyperparameters>) -> f64 {
        let unknown_m = || SIGNAL * self.estimated_ball().radius_m * self.settings.noise[0];
        before.map_or_else(unknown_m, |before| before.noise_sd)
    }

    /// Hyperparameters before the last fit.
    pub(super) fn before(&self) -> Option<&Hyperparameters> {
        self.start.as_ref()
    }

    /// Returns the observations relative to a prior mean.
    fn relative_to(
        &self,
        prior: &PriorMean,
        last: Option<&Hyperparameters>,
        pose: CameraPose,
    ) -> Observations {
        let ball = self.estimated_ball();
        self.evidence.observations(&ObservationModel {
            prior,
            ball: &ball,
            noise_m: self.noise_unit_m(last),
            normals: self.normals(),
            free_space_samples: self.settings.free_space_samples,
            pose,
        })
    }

    /// Returns the logarithm of the object's extent along each axis, relative to their geometric
    /// mean.
    fn log_extents(&self, ball: &Ball) -> [f64; 3] {
        let Some((_, radii_m)) = half_axes_m(ball, self.points().iter()) else { return [0.0; 3] };
        let logs = radii_m.map(f64::ln);
        logs.map(|log| log - logs.mean()).into()
    }

    /// Whether normals are observed; false for a kernel without gradients.
    fn normals(&self) -> bool {
        self.settings.normals && self.kernel.has_slopes()
    }

    fn search(
        &self,
        start: Option<&Hyperparameters>,
        observations: &Observations,
    ) -> Result<Fit, CovarianceError> {
        let ball = self.estimated_ball();
        let radius_m = ball.radius_m;
        let (unit, extents) = match self.settings.prior {
            PriorShape::Star => (1.0, [0.0; 3]),
            _ => (radius_m, self.log_extents(&ball)),
        };
        let lengths_m =
            |exponent: f64, length_m: f64| extents.map(|log| length_m * (exponent * log).exp());
        let SpatialGpSettings { length_scale, noise, slope_noise, .. } = &self.settings;
        let longest = if self.shapes.is_empty() { f64::INFINITY } else { ALIKE };
        let length_scale = length_scale.map(|share| share.min(longest));
        let mut ranges = vec![length_scale.map(|share| share * unit), *noise];
        ranges.extend(self.normals().then_some(*slope_noise));
        // Errors of known size do not grow with the signal, which is then searched too.
        let signals_m = SIGNAL_RANGE.map(|share| share * radius_m);
        let common = self.evidence.common_error();
        ranges.extend(match common {
            CommonError::None | CommonError::Assumed => None,
            CommonError::Stated => Some(signals_m),
            CommonError::Learned => Some(COMMON_RANGE),
        });
        let logs = ranges.iter().map(|range| range.map(f64::ln));
        let ranges: Vec<[f64; 2]> = std::iter::once(EXPONENT).chain(logs).collect();
        let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
        let mut begin: Vec<f64> = match start {
            Some(start) => {
                let logs =
                    Vector3::from_fn(|i, _| start.length_scales.get(i).map_or(0.0, |it| it.ln()));
                let (length_m, ratio) = (logs.mean().exp(), start.noise_ratio());
                let extents = Vector3::from(extents);
                // Least squares.
                let exponent = logs.dot(&extents) / extents.norm_squared().max(f64::MIN_POSITIVE);
                let mut begin = vec![exponent, length_m.ln(), ratio.height.ln()];
                begin.extend(self.normals().then(|| (ratio.slope * length_m).ln()));
                begin.extend(match common {
                    CommonError::None | CommonError::Assumed => None,
                    CommonError::Stated => Some(start.signal_sd.ln()),
                    CommonError::Learned => Some(ratio.known.ln()),
                });
                begin
            }
            None => {
                std::iter::once(0.0).chain(ranges.iter().skip(1).copied().map(middle)).collect()
            }
        };
        // The object's extent may have grown since the last fit.
        begin.iter_mut().zip(&ranges).for_each(|(at, [low, high])| *at = at.clamp(*low, *high));
        let signal_sd = match common {
            CommonError::Stated => SignalModel::Searched,
            CommonError::None | CommonError::Learned | CommonError::Assumed => {
                let prior = (!self.shapes.is_empty()).then(|| RELATED.scaled(radius_m));
                let least_m = prior.map_or(signals_m[0], |prior| prior.median / prior.spread);
                SignalModel::Profiled(Range { low: least_m, high: signals_m[1], prior })
            }
        };
        let parameters = |logs: &[f64]| parameters(logs, common);
        let is_learned = common == CommonError::Learned;
        let mut likelihood = Likelihood::new(self.kernel, MeanModel::Zero, observations);
        let cube = (observations.order() as f64).powi(3);
        // Each fit starts with a different parameter, so that short fits cover all of them.
        let axis = observations.len() % begin.len();
        let steps = [if start.is_some() { STEP_NEXT } else { STEP_FIRST }, STEP_LAST];
        let budget = (CUBES / cube).clamp(TRIED_MIN, TRIED_MAX) as u32;
        let (found, signal_sd) = compass(begin, &ranges, axis, steps, budget, |logs| {
            let (exponent, length_m, ratio) = parameters(logs);
            let lengths_m = lengths_m(exponent, length_m);
            let found = likelihood.profile(&lengths_m, ratio, &signal_sd, None)?;
            let common_m = ratio.known * found.signal_sd;
            let prior = is_learned.then(|| COMMON_ERROR_M.log_density(common_m.ln()));
            let value = found.log_likelihood + prior.unwrap_or(0.0);
            Ok::<_, CovarianceError>((value, found.signal_sd))
        })?;
        let (exponent, length_m, ratio) = parameters(&found.x);
        let lengths_m = lengths_m(exponent, length_m).to_vec();
        let common_sd = match common {
            CommonError::Learned => Some(ratio.known * signal_sd),
            CommonError::Assumed => Some(COMMON_ERROR_M.median),
            CommonError::None | CommonError::Stated => None,
        };
        let at = Hyperparameters::new(signal_sd, lengths_m, ratio, 0.0);
        Ok(Fit {
            kernel: None,
            hyperparameters: Hyperparameters { common_sd, ..at },
            log_likelihood: found.value,
            nystrom_residual_sd: None,
            factorisations: found.evaluations,
            scanned_at: observations.len(),
            stop: found.stop,
        })
    }

    /// Whether the approach of `aim` outside the object is clear of the estimated surface, if there
    /// is one.
    pub fn has_room(&self, aim: &Aim) -> bool {
        let Some(surface) = self.surface() else { return true };
        let (ball, radius_m) = (&self.scope.ball, self.scope.radius_m);
        let back = |radii: f64| aim.p_w - aim.direction_w.scale(radii * radius_m);
        let mut radii = FIRST;
        while (back(radii) - ball.centre_w).norm() < ball.radius_m {
            if surface.value(&back(radii)) < ROOM * radius_m {
                return false;
            }
            radii += STEP;
        }
        true
    }

    /// The region and the finger.
    pub fn scope(&self) -> &ExplorationSetup {
        &self.scope
    }

    /// Points of contact in `W`, in order.
    pub fn contacts(&self) -> impl Iterator<Item = &Point3<f64>> + Clone {
        self.evidence.contacts()
    }

    /// Returns the points of contact, then those that cameras have seen, in `W`.
    pub fn points(&self) -> Vec<Point3<f64>> {
        self.evidence.points().collect()
    }

    /// Distance of `p_w` from all contacts and swept paths.
    pub fn distance_to_evidence_m(&self, p_w: &Point3<f64>) -> f64 {
        self.evidence.distance_to_evidence_m(p_w)
    }

    /// All aims so far.
    pub fn aims(&self) -> &[Aim] {
        &self.asked
    }

    /// Returns the result of the last [`refit`](Self::refit).
    pub fn fit(&self) -> Option<&Fit> {
        self.fit.as_ref()
    }

    /// The estimated surface, after the first fit.
    pub fn surface(&self) -> Option<&Surface> {
        self.surface.as_ref()
    }
}

/// Whether the hyperparameters of `last` are kept.
fn is_kept(last: &Fit, observations: &Observations) -> bool {
    let is_recent = (observations.len() as f64) < SEARCH_AGAIN * last.scanned_at as f64;
    observations.order() > KEPT_ROWS && is_recent
}

/// Returns the exponent of the extents, the geometric mean of the length scales, m, and the noise
/// ratios, from the exponent and the logarithms of the others; the slopes' noise is per length
/// scale. With errors in common of known size, the last is that of the signal; of unknown size, it
/// is their ratio to the signal.
fn parameters(logs: &[f64], common: CommonError) -> (f64, f64, NoiseRatio) {
    let (known, logs) = match (common, logs.split_last()) {
        (CommonError::Stated, Some((signal, logs))) => ((-signal).exp(), logs),
        (CommonError::Learned, Some((ratio, logs))) => (ratio.exp(), logs),
        _ => (0.0, logs),
    };
    let at = |i: usize| logs.get(i).map_or(0.0, |log| log.exp());
    let exponent = logs.first().copied().unwrap_or(0.0);
    (exponent, at(1), NoiseRatio { height: at(2), slope: at(3) / at(1), known })
}
