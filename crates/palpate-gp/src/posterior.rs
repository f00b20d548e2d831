//! The exact posterior of a Gaussian process, Eq. 3 of Yi et al. 2016.

use super::cholesky::Factor;
use super::covariance;
use super::covariance::Correlations;
use super::covariance::CovarianceError;
use super::covariance::DerivativeCovariance;
use super::dense::DenseMatrix;
use super::dense::NotPositiveDefinite;
use super::kernel::{Hyperparameters, Kernel};
use super::observations::{Observation, Observations};
use crate::math::simd::widest_dot;

/// Buffers of a query, so that queries do not allocate.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) slopes: Vec<f64>,
    pub(super) solved: Vec<f64>,
    derivatives: DerivativeCovariance,
    row: Vec<f64>,
}

/// Posterior of a Gaussian process: mean and variance of the height at any place.
#[derive(Clone)]
pub struct Posterior {
    kernel: &'static dyn Kernel,
    hyperparameters: Hyperparameters,
    observations: Observations,
    /// For each observation the earlier one whose noise it makes smaller; otherwise itself.
    pub(super) bases: Vec<usize>,
    factor: Factor,
    /// L⁻¹·(y − m).
    whitened: Vec<f64>,
    weights: Vec<f64>,
    jitter: f64,
}

impl Posterior {
    /// Conditions the prior on `observations`: n³/3 operations.
    ///
    /// # Errors
    /// [`CovarianceError`] if the covariance cannot be factored.
    pub fn new(
        kernel: &'static dyn Kernel,
        hyperparameters: Hyperparameters,
        observations: Observations,
    ) -> Result<Self, CovarianceError> {
        let mut dense = DenseMatrix::new(observations.order());
        let noise_ratio = hyperparameters.noise_ratio();
        let lengths = &hyperparameters.length_scales;
        let buffer = &mut Correlations::default();
        let jitter =
            covariance::factor(&mut dense, kernel, &observations, lengths, noise_ratio, buffer)?;
        Ok(Self::factored(kernel, hyperparameters, observations, &dense, jitter))
    }

    /// Creates the posterior from observations whose covariance, including that of their errors, is
    /// already factored with this jitter.
    pub(super) fn factored(
        kernel: &'static dyn Kernel,
        hyperparameters: Hyperparameters,
        observations: Observations,
        covariance: &DenseMatrix,
        jitter: f64,
    ) -> Self {
        let factor = Factor::from(covariance);
        let (whitened, weights) = (Vec::new(), Vec::new());
        let bases = (0..observations.len()).collect();
        let mut new = Self {
            kernel,
            hyperparameters,
            observations,
            bases,
            factor,
            whitened,
            weights,
            jitter,
        };
        new.weigh();
        new
    }

    /// Adds one height without factoring again: n² operations. The hyperparameters are unchanged.
    ///
    /// # Errors
    /// If the enlarged covariance is not positive definite; the posterior is then unchanged, and
    /// [`new`](Self::new) would find the necessary jitter.
    pub fn add(&mut self, place: &[f64], height: f64) -> Result<(), NotPositiveDefinite> {
        self.push(&Observation::height(place, height))
    }

    /// Adds any observation, like [`add`](Self::add).
    ///
    /// # Errors
    /// The same as [`add`](Self::add).
    pub fn push(&mut self, observation: &Observation) -> Result<(), NotPositiveDefinite> {
        self.append(observation)?;
        self.weigh();
        Ok(())
    }

    /// Adds an observation; the weights are then those without it.
    pub(super) fn append(&mut self, observation: &Observation) -> Result<(), NotPositiveDefinite> {
        let order = self.observations.order();
        let noise = self.hyperparameters.noise_ratio();
        let mut scratch = Scratch::default();
        for number in 0..observation.order() {
            let axis = number.checked_sub(1);
            self.covariances(observation.place, axis, &mut scratch);
            let row = &mut scratch.solved;
            if axis.is_none() {
                self.observations.add_known_row(observation.known, noise, row);
            }
            // Errors of height and slope at one place are independent.
            row.resize(order + number, 0.0);
            row.push(match axis {
                None => 1.0 + observation.height_noise2(noise) + self.jitter,
                Some(axis) => {
                    let prior = self.kernel.slope_variance();
                    let length = self.hyperparameters.length_scales[axis];
                    prior + observation.slope_noise2(noise, length) + self.jitter * prior
                }
            });
            if let Err(indefinite) = self.factor.append(row) {
                self.factor.truncate(order);
                return Err(indefinite);
            }
        }
        self.bases.push(self.observations.len());
        self.observations.push(observation);
        Ok(())
    }

    /// Returns the posterior with the same observations and its length scales multiplied by
    /// `scale`: n³/3 operations.
    ///
    /// # Errors
    /// [`CovarianceError`] if the covariance cannot be factored.
    pub fn scaled(&self, scale: f64) -> Result<Self, CovarianceError> {
        let mut hyperparameters = self.hyperparameters.clone();
        hyperparameters.length_scales.iter_mut().for_each(|length| *length *= scale);
        Self::new(self.kernel, hyperparameters, self.observations.clone())
    }

    /// Returns the posterior conditioned also on fantasy touches at `places` with unknown heights:
    /// the variance, which does not depend on them, is that after these touches, and the mean is
    /// meaningless. n² operations per place.
    ///
    /// # Errors
    /// [`CovarianceError`] if the enlarged covariance cannot be factored.
    pub fn fantasize<'a>(
        &self,
        places: impl Iterator<Item = &'a [f64]> + Clone,
    ) -> Result<Self, CovarianceError> {
        let mut fantasy = self.clone();
        if fantasy.imagine(&places.clone().collect::<Vec<_>>()).is_ok() {
            return Ok(fantasy);
        }
        let mut observations = self.observations.clone();
        places.for_each(|place| observations.push_height(place, 0.0));
        Self::new(self.kernel, self.hyperparameters.clone(), observations)
    }

    /// Adds heights of zero at `places`, whose covariances with the observations are solved side by
    /// side; the weights are then those without them. After an error the factor has some of them.
    fn imagine(&mut self, places: &[&[f64]]) -> Result<(), NotPositiveDefinite> {
        let order = self.observations.order();
        let noise = self.hyperparameters.noise_ratio();
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(places.len());
        self.whitened(places, |lanes, _, count| {
            rows.extend((0..count).map(|lane| lanes.iter().map(|lanes| lanes[lane]).collect()));
        });
        let mut imagined = Observations::new(self.observations.dimension());
        for (row, place) in rows.iter_mut().zip(places) {
            row.resize(order + imagined.len(), 0.0);
            let (at, lengths) = (place.iter().copied(), &self.hyperparameters.length_scales);
            imagined.distances2(at, lengths, 0, &mut row[order..]);
            self.kernel.correlate(&mut row[order..]);
            let height = Observation::height(place, 0.0);
            row.push(1.0 + height.height_noise2(noise) + self.jitter);
            self.factor.append_solved(row, order)?;
            imagined.push(&height);
        }
        self.bases.extend(self.observations.len()..self.observations.len() + places.len());
        places.iter().for_each(|place| self.observations.push_height(place, 0.0));
        Ok(())
    }

    /// Replaces all heights and slopes by those that `values` returns for their numbers, and the
    /// hyperparameters by some of the same ratios.
    pub(super) fn revalue<'a>(
        &mut self,
        hyperparameters: Hyperparameters,
        values: impl Fn(usize) -> (f64, &'a [f64]),
    ) {
        self.hyperparameters = hyperparameters;
        self.observations.revalue(values);
        self.whitened.clear();
        self.weigh();
    }

    /// Returns yᵀA⁻¹y of the residuals y, and ln |A|, with the covariance s²·A.
    pub(super) fn evidence(&self) -> (f64, f64) {
        let pivot = |i: usize| self.factor.row(i)[i];
        let logs = (0..self.factor.order()).map(|i| 2.0 * pivot(i).ln());
        (widest_dot(&self.whitened, &self.whitened), logs.sum())
    }

    /// Computes the weights; for earlier observations only L⁻ᵀ is solved again.
    fn weigh(&mut self) {
        let Hyperparameters { mean, length_scales, .. } = &self.hyperparameters;
        self.observations.residuals(*mean, length_scales, &mut self.weights);
        for (i, observed) in self.weights.iter().enumerate().skip(self.whitened.len()) {
            let row = self.factor.row(i);
            let known = widest_dot(&row[..i], &self.whitened);
            self.whitened.push((observed - known) / row[i]);
        }
        self.weights.clone_from(&self.whitened);
        self.factor.solve_upper(&mut self.weights);
    }

    /// Writes into `scratch.solved` the covariances of the height at `place`, or of its slope along
    /// `axis` per length scale, with all observations; a slope's only if slopes were observed.
    fn covariances(&self, place: &[f64], axis: Option<usize>, scratch: &mut Scratch) {
        let lengths = &self.hyperparameters.length_scales;
        let Scratch { solved, derivatives, .. } = scratch;
        let at = place.iter().copied();
        solved.resize(self.observations.order(), 0.0);
        if self.observations.has_slopes() || axis.is_some() {
            derivatives.correlate(self.kernel, &self.observations, lengths, at, 0);
            derivatives.covariances(&self.observations, lengths, axis, solved);
        } else {
            self.observations.distances2(at, lengths, 0, solved);
            self.kernel.correlate(solved);
        }
    }

    /// Writes the gradient of Σ_i w_i·k(place, i), in units of the signal's variance, with respect
    /// to the place of the last call of [`covariances`](Self::covariances).
    fn gradient_with_slopes(
        &self,
        weights: &[f64],
        derivatives: &DerivativeCovariance,
        row: &mut Vec<f64>,
        gradient: &mut [f64],
    ) {
        let lengths = &self.hyperparameters.length_scales;
        row.resize(self.observations.order(), 0.0);
        for (axis, (slope, length)) in gradient.iter_mut().zip(lengths).enumerate() {
            derivatives.covariances(&self.observations, lengths, Some(axis), row);
            *slope = widest_dot(row, weights) / length;
        }
    }

    /// Writes the gradient of Σ_i w_i·k(place, i), in units of the signal's variance.
    pub(super) fn weighted_slopes(
        &self,
        place: &[f64],
        weights: &[f64],
        gradient: &mut [f64],
        scratch: &mut Scratch,
    ) {
        self.covariances(place, None, scratch);
        let Scratch { derivatives, row, .. } = scratch;
        self.gradient_with_slopes(weights, derivatives, row, gradient);
    }

    /// Returns the leave-one-out z-scores of the heights: z = (A⁻¹y)ᵢ / (s·√(A⁻¹)ᵢᵢ) with the
    /// covariance s²·A (Rasmussen & Williams 2006, Eqs. 5.10 to 5.12). Each is the deviation of a
    /// height from its prediction by all others, in standard deviations. n³/2 operations.
    pub fn loo_z_scores(&self) -> Vec<f64> {
        let mut unit = Vec::new();
        let z = |i: usize| {
            let at = self.observations.start(i);
            unit.clear();
            unit.resize(self.observations.order(), 0.0);
            unit[at] = 1.0;
            let inverse = self.factor.solve_lower(&mut unit);
            self.weights[at] / (self.hyperparameters.signal_sd * inverse.sqrt())
        };
        (0..self.observations.len()).map(z).collect()
    }

    /// Multiplies every standard deviation, of surface and noise, by `factor`; the means are
    /// unchanged.
    pub fn inflate(&mut self, factor: f64) {
        let Hyperparameters { signal_sd, noise_sd, slope_noise_sd, common_sd, .. } =
            &mut self.hyperparameters;
        let sds = [signal_sd, noise_sd, slope_noise_sd].into_iter().chain(common_sd);
        sds.for_each(|sd| *sd *= factor);
    }

    /// The hyperparameters of the posterior.
    pub fn hyperparameters(&self) -> &Hyperparameters {
        &self.hyperparameters
    }

    /// The observations of the posterior.
    pub fn observations(&self) -> &Observations {
        &self.observations
    }

    /// Jitter of the factorisation, relative to the diagonal signal_sd²; 0 if none.
    pub fn jitter(&self) -> f64 {
        self.jitter
    }

    /// Returns the mean height m + k*ᵀ·K⁻¹·(y − m) at `place`.
    pub fn mean(&self, place: &[f64], scratch: &mut Scratch) -> f64 {
        self.mean_with_correlations(place, scratch).0
    }

    /// Returns the mean, and the correlations of `place` with the observations.
    pub(super) fn mean_with_correlations<'a>(
        &self,
        place: &[f64],
        scratch: &'a mut Scratch,
    ) -> (f64, &'a [f64]) {
        self.covariances(place, None, scratch);
        let correlations = &scratch.solved;
        let mean = self.hyperparameters.mean + widest_dot(correlations, &self.weights);
        (mean, correlations)
    }

    /// Returns [`mean`](Self::mean) and writes its gradient with respect to the place.
    pub fn mean_gradient(&self, place: &[f64], gradient: &mut [f64], scratch: &mut Scratch) -> f64 {
        let lengths = &self.hyperparameters.length_scales;
        if self.observations.has_slopes() {
            self.covariances(place, None, scratch);
            let Scratch { solved, derivatives, row, .. } = scratch;
            self.gradient_with_slopes(&self.weights, derivatives, row, gradient);
            return self.hyperparameters.mean + widest_dot(solved, &self.weights);
        }
        let Scratch { solved, slopes, .. } = scratch;
        solved.resize(self.observations.len(), 0.0);
        slopes.resize(self.observations.len(), 0.0);
        self.observations.distances2(place.iter().copied(), lengths, 0, solved);
        self.kernel.correlate_slope(solved, slopes);
        for (axis, (slope, at)) in gradient.iter_mut().zip(place).enumerate() {
            let column = self.observations.column(axis);
            let terms = self.weights.iter().zip(slopes.iter()).zip(column);
            let sum: f64 = terms.map(|((weight, slope), x)| weight * slope * (at - x)).sum();
            *slope = 2.0 * sum / (lengths[axis] * lengths[axis]);
        }
        self.hyperparameters.mean + widest_dot(solved, &self.weights)
    }

    /// Returns the variance of the surface (without touch noise) k** − k*ᵀ·K⁻¹·k* at `place`, in
    /// [0, k**].
    pub fn variance(&self, place: &[f64], scratch: &mut Scratch) -> f64 {
        self.remaining(self.whiten(place, scratch))
    }

    /// Returns [`variance`](Self::variance) and writes its gradient with respect to the place.
    pub fn variance_gradient(
        &self,
        place: &[f64],
        gradient: &mut [f64],
        scratch: &mut Scratch,
    ) -> f64 {
        let lengths = &self.hyperparameters.length_scales;
        if self.observations.has_slopes() {
            let explained = self.whiten(place, scratch);
            let Scratch { solved, derivatives, row, .. } = scratch;
            self.factor.solve_upper(solved);
            self.gradient_with_slopes(solved, derivatives, row, gradient);
            let signal2 = self.hyperparameters.signal_sd.powi(2);
            gradient.iter_mut().for_each(|slope| *slope *= -2.0 * signal2);
            return self.remaining(explained);
        }
        let Scratch { solved, slopes, .. } = scratch;
        solved.resize(self.observations.len(), 0.0);
        slopes.resize(self.observations.len(), 0.0);
        self.observations.distances2(place.iter().copied(), lengths, 0, solved);
        self.kernel.correlate_slope(solved, slopes);
        let explained = self.factor.solve_lower(solved);
        self.factor.solve_upper(solved);
        let signal2 = self.hyperparameters.signal_sd.powi(2);
        for (axis, (slope, at)) in gradient.iter_mut().zip(place).enumerate() {
            let column = self.observations.column(axis);
            let terms = solved.iter().zip(slopes.iter()).zip(column);
            let sum: f64 = terms.map(|((solved, slope), x)| solved * slope * (at - x)).sum();
            *slope = -4.0 * signal2 * sum / (lengths[axis] * lengths[axis]);
        }
        self.remaining(explained)
    }

    /// Writes L⁻¹·k* into `scratch.solved`, and returns its squared norm: the fraction of the
    /// variance at `place` that the observations explain.
    pub(super) fn whiten(&self, place: &[f64], scratch: &mut Scratch) -> f64 {
        self.covariances(place, None, scratch);
        self.factor.solve_lower(&mut scratch.solved)
    }

    /// Solves A·x = `column` in place for the covariance s²·A of all observed numbers.
    pub(super) fn solve(&self, column: &mut [f64]) {
        self.factor.solve_lower(column);
        self.factor.solve_upper(column);
    }

    /// The weights A⁻¹·(y − m).
    pub(super) fn weights(&self) -> &[f64] {
        &self.weights
    }

    pub(super) fn kernel(&self) -> &'static dyn Kernel {
        self.kernel
    }

    pub(super) fn factor(&self) -> &Factor {
        &self.factor
    }

    /// Returns the variance that remains if the fraction `explained` of the prior's is known.
    pub(super) fn remaining(&self, explained: f64) -> f64 {
        self.hyperparameters.signal_sd.powi(2) * (1.0 - explained).max(0.0)
    }
}
