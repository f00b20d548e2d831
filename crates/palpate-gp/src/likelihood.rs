//! The log marginal likelihood of hyperparameters and its gradient.

use super::covariance;
use super::covariance::CovarianceError;
use super::covariance::{Correlations, PairWeights, batches};
use super::dense::DenseMatrix;
use super::kernel::{Hyperparameters, Kernel};
use super::observations::{NoiseRatio, Observations};
use super::posterior::Posterior;
use super::search_box::MeanModel;
use super::search_box::SignalModel;
use crate::math::simd::{dot, widest_dot, widest_fn};
use std::ops::Range;

/// Log marginal likelihood of hyperparameters given fixed observations, with buffers kept between
/// calls.
///
/// With K = s²·A, A = C + g²·I (s the signal's standard deviation, C the correlations, g the noise
/// as a fraction of s) the log marginal likelihood is −½·yᵀA⁻¹y / s² − n·ln s − ½·ln|A| − (n/2)·ln
/// 2π, where y are the heights above the mean (Rasmussen & Williams 2006, Eq. 2.30). A slope counts
/// as an additional height, slope · length, with its own noise, and adds ln length, so that the
/// density is that of the slope.
pub struct Likelihood<'a> {
    kernel: &'static dyn Kernel,
    mean: MeanModel,
    observations: &'a Observations,
    dense: DenseMatrix,
    /// Buffer: L⁻¹·y, then A⁻¹·y if a gradient is requested.
    weights: Vec<f64>,
    scratch: Vec<f64>,
    /// Buffer.
    pair: PairWeights,
    correlations: Correlations,
    jitter: f64,
    factorisations: u32,
}

/// Profiled likelihood: the signal's standard deviation follows from the other parameters.
#[derive(Clone, Copy, Debug)]
pub struct ProfiledLikelihood {
    /// Log marginal likelihood.
    pub log_likelihood: f64,
    /// Signal standard deviation.
    pub signal_sd: f64,
    /// Prior mean according to the mean model.
    pub mean: f64,
}

/// Returns the log marginal likelihood of `order` heights, given yᵀA⁻¹y and ln |A|.
pub(super) fn of_height(fit: f64, signal_sd: f64, order: usize, log_determinant: f64) -> f64 {
    let n = order as f64;
    -0.5 * fit / (signal_sd * signal_sd)
        - n * signal_sd.ln()
        - 0.5 * log_determinant
        - 0.5 * n * (2.0 * std::f64::consts::PI).ln()
}

impl<'a> Likelihood<'a> {
    /// Prepares the likelihood of hyperparameters given `observations`.
    pub fn new(
        kernel: &'static dyn Kernel,
        mean: MeanModel,
        observations: &'a Observations,
    ) -> Self {
        let count = observations.order();
        Self {
            kernel,
            mean,
            observations,
            dense: DenseMatrix::new(count),
            weights: Vec::with_capacity(count),
            scratch: Vec::with_capacity(count),
            pair: PairWeights::default(),
            correlations: Correlations::default(),
            jitter: 0.0,
            factorisations: 0,
        }
    }

    /// Returns the number of matrices factored so far.
    pub fn factorisations(&self) -> u32 {
        self.factorisations
    }

    /// Returns the log marginal likelihood and writes its gradient with respect to (ln signal_sd,
    /// ln length_1, …, ln length_d, ln noise_sd), and ln slope_noise_sd if there is space, unless
    /// `gradient` is empty.
    ///
    /// # Errors
    /// [`CovarianceError`] if the covariance cannot be factored.
    pub fn value_gradient(
        &mut self,
        at: &Hyperparameters,
        gradient: &mut [f64],
    ) -> Result<f64, CovarianceError> {
        let lengths = &at.length_scales;
        let noise = at.noise_ratio();
        self.correlations.is_sloped = !gradient.is_empty();
        self.factor(lengths, noise)?;
        let fit = self.whiten(at.mean, lengths);
        let value = self.value(at.signal_sd, lengths, fit);
        let [by_signal, rest @ ..] = gradient else { return Ok(value) };
        let signal2 = at.signal_sd * at.signal_sd;
        self.gradient(signal2, lengths, noise, rest);
        let by_noise: f64 = rest.iter().skip(lengths.len()).sum();
        let by_known = self.by_known(signal2, noise);
        *by_signal = fit / signal2 - self.observations.order() as f64 - by_noise - by_known;
        Ok(value)
    }

    /// Returns the posterior at `at`, without factoring again after a
    /// [`value_gradient`](Self::value_gradient) there without a gradient.
    pub fn posterior(&self, at: Hyperparameters) -> Posterior {
        let observations = self.observations.clone();
        Posterior::factored(self.kernel, at, observations, &self.dense, self.jitter)
    }

    /// Returns the log marginal likelihood with signal_sd according to `scale`. A `gradient` is
    /// written with respect to (ln length_1, …, ln length_d, ln noise_ratio), and the logarithm of
    /// the slope noise ratio if there is space; it includes the prior of signal_sd. If signal_sd is
    /// searched, or the ratio of errors in common, its derivative is the last.
    ///
    /// # Errors
    /// [`CovarianceError`] if the covariance cannot be factored.
    pub fn profile(
        &mut self,
        length_scales: &[f64],
        noise_ratio: impl Into<NoiseRatio>,
        scale: &SignalModel,
        gradient: Option<&mut [f64]>,
    ) -> Result<ProfiledLikelihood, CovarianceError> {
        let noise = noise_ratio.into();
        self.correlations.is_sloped = gradient.is_some();
        let (fit, mean) = self.fit(length_scales, noise)?;
        let count = self.observations.order();
        let signal_sd = scale.signal_sd(fit, count, noise);
        if let Some(gradient) = gradient {
            let signal2 = signal_sd * signal_sd;
            self.gradient(signal2, length_scales, noise, gradient);
            // At the optimal signal_sd the value is stationary in it. Otherwise it changes by this,
            // with errors of known size, which do not grow with it.
            let by_signal =
                |all: &Self| fit / signal2 - count as f64 - all.by_known(signal2, noise);
            match scale {
                SignalModel::Profiled(_) if noise.known > 0.0 => {
                    let by_known = self.by_known(signal2, noise);
                    gradient.iter_mut().next_back().into_iter().for_each(|last| *last = by_known);
                }
                SignalModel::Profiled(_) => {}
                // With a known noise, signal_sd decreases as the ratio increases.
                SignalModel::KnownNoise(_) => {
                    let by_signal = by_signal(self);
                    gradient.iter_mut().skip(length_scales.len()).take(1).for_each(|by_noise| {
                        *by_noise -= by_signal;
                    });
                }
                SignalModel::Searched => {
                    let by_signal = by_signal(self);
                    gradient.iter_mut().next_back().into_iter().for_each(|last| *last = by_signal);
                }
            }
        }
        let log_likelihood = self.value(signal_sd, length_scales, fit);
        Ok(ProfiledLikelihood { log_likelihood, signal_sd, mean })
    }

    /// Returns the derivative with respect to the logarithm of the unit of known errors, after
    /// [`gradient`](Self::gradient).
    fn by_known(&self, signal2: f64, noise: NoiseRatio) -> f64 {
        let change = CovarianceGradient { dense: &self.dense, weights: &self.weights, signal2 };
        let mut sum = 0.0;
        self.observations.for_known(noise, |row, column, value| {
            sum += change.at(row, column) * value * if row == column { 1.0 } else { 2.0 };
        });
        sum
    }

    /// Factors the covariance, and returns yᵀA⁻¹y and the mean.
    fn fit(&mut self, lengths: &[f64], noise: NoiseRatio) -> Result<(f64, f64), CovarianceError> {
        self.factor(lengths, noise)?;
        let buffers = [&mut self.scratch, &mut self.weights];
        let mean = self.mean.of(self.observations, lengths, &self.dense, buffers);
        Ok((self.whiten(mean, lengths), mean))
    }

    fn value(&self, signal_sd: f64, length_scales: &[f64], fit: f64) -> f64 {
        let order = self.observations.order();
        let value = of_height(fit, signal_sd, order, self.dense.log_determinant());
        let logs: f64 = length_scales.iter().map(|length| length.ln()).sum();
        value + self.observations.slope_count() as f64 * logs
    }

    fn factor(&mut self, length_scales: &[f64], noise: NoiseRatio) -> Result<(), CovarianceError> {
        self.factorisations += 1;
        let (kernel, observations) = (self.kernel, self.observations);
        let buffer = &mut self.correlations;
        let dense = &mut self.dense;
        self.jitter =
            covariance::factor(dense, kernel, observations, length_scales, noise, buffer)?;
        Ok(())
    }

    /// Sets the weights to L⁻¹·y for the heights above `mean`, and returns the squared norm yᵀA⁻¹y.
    fn whiten(&mut self, mean: f64, length_scales: &[f64]) -> f64 {
        self.observations.residuals(mean, length_scales, &mut self.weights);
        self.dense.solve_lower(&mut self.weights);
        widest_dot(&self.weights, &self.weights)
    }

    /// Writes the gradient with respect to the logarithms of the length scales and of the noise
    /// ratio: ½·tr((w·wᵀ/s² − A⁻¹)·∂A) (Rasmussen & Williams 2006, Eq. 5.9), after
    /// [`whiten`](Self::whiten) at the same parameters. The mean is optimal or independent of them,
    /// so it does not contribute.
    fn gradient(&mut self, signal2: f64, lengths: &[f64], noise: NoiseRatio, gradient: &mut [f64]) {
        self.dense.solve_upper(&mut self.weights);
        self.dense.invert();
        gradient.fill(0.0);
        let Some((by_length, by_noise)) = gradient.split_at_mut_checked(lengths.len()) else {
            return;
        };
        if self.observations.has_slopes() {
            return self.gradient_with_slopes(signal2, lengths, noise, by_length, by_noise);
        }
        let observations = self.observations;
        let Self { kernel, dense, weights, scratch, correlations, .. } = self;
        let change = CovarianceGradient { dense, weights, signal2 };
        let mut trace = 0.0;
        for columns in batches(observations.len()) {
            let slopes = correlations.slopes_of(*kernel, observations, lengths, &columns);
            trace +=
                add_gradient(observations, lengths, columns, change, slopes, scratch, by_length);
        }
        let by_height = noise.height * noise.height * trace;
        by_noise.iter_mut().take(1).for_each(|by_noise| *by_noise = by_height);
    }

    /// Writes the gradient with observed slopes, by pairs of places; the slopes per length scale
    /// change with it too.
    fn gradient_with_slopes(
        &mut self,
        signal2: f64,
        lengths: &[f64],
        noise: NoiseRatio,
        by_length: &mut [f64],
        by_noise: &mut [f64],
    ) {
        let Self { observations, dense, weights, pair, correlations, kernel, .. } = self;
        let d = lengths.len();
        let gradient = CovarianceGradient { dense, weights, signal2 };
        let change = |row: usize, column: usize| gradient.at(row, column);
        observations.residuals(0.0, lengths, &mut self.scratch);
        for j in 0..observations.len() {
            let column = observations.start(j);
            by_noise.iter_mut().take(1).for_each(|by_noise| {
                *by_noise += change(column, column) * observations.height_noise2(j, noise);
            });
            for axis in 0..observations.slope(j).len() {
                let k = column + 1 + axis;
                let by_this = change(k, k) * observations.slope_noise2(j, noise, lengths[axis]);
                by_length[axis] += by_this + 1.0 - weights[k] * self.scratch[k] / signal2;
                by_noise.iter_mut().skip(1).for_each(|by_noise| *by_noise += by_this);
            }
            let derivatives = &mut correlations.derivatives;
            derivatives.correlate(*kernel, observations, lengths, observations.place(j), j);
            let slopes_of_j = observations.slope(j).len();
            for i in j + 1..observations.len() {
                let row = observations.start(i);
                if slopes_of_j + observations.slope(i).len() == 0 {
                    let change = change(row, column);
                    derivatives.add_height_gradient(observations, lengths, i, change, by_length);
                    continue;
                }
                pair.clear_slopes(d);
                for (axis, sum) in pair.slope_height.iter_mut().take(slopes_of_j).enumerate() {
                    *sum += change(row, column + 1 + axis);
                }
                for other in 0..observations.slope(i).len() {
                    pair.slope_height[other] -= change(row + 1 + other, column);
                    for axis in 0..slopes_of_j {
                        pair.slopes[axis * d + other] = change(row + 1 + other, column + 1 + axis);
                    }
                }
                pair.heights = change(row, column);
                derivatives.add_length_gradient(observations, lengths, i, pair, by_length);
            }
        }
    }
}

/// Gradient w·wᵀ/s² − A⁻¹ of twice the log marginal likelihood with respect to A.
#[derive(Clone, Copy)]
struct CovarianceGradient<'a> {
    /// A⁻¹.
    dense: &'a DenseMatrix,
    /// w = A⁻¹·y.
    weights: &'a [f64],
    /// s².
    signal2: f64,
}

impl CovarianceGradient<'_> {
    /// Returns an entry of the lower triangle.
    #[inline]
    fn at(self, row: usize, column: usize) -> f64 {
        let inverse = self.dense.inverse_column(column)[row - column];
        self.weights[row] * self.weights[column] / self.signal2 - inverse
    }
}

widest_fn! {
    /// Adds ½·tr((w·wᵀ/s² − A⁻¹)·∂A) by the length scales for some columns, and returns that by the
    /// noises of their heights. `slopes` are the derivatives of the correlations by the squared
    /// distances, which it overwrites; `squares` is a buffer for a column.
    fn add_gradient<'a>(
        observations: &'a Observations,
        lengths: &'a [f64],
        columns: Range<usize>,
        change: CovarianceGradient<'a>,
        slopes: &'a mut [f64],
        squares: &'a mut Vec<f64>,
        by_length: &'a mut [f64],
    ) -> f64 {
        let CovarianceGradient { dense, weights, signal2 } = change;
        let mut rest = slopes;
        let mut trace = 0.0;
        for j in columns {
            let weight = weights[j] / signal2;
            let [on, inverse @ ..] = dense.inverse_column(j) else { return trace };
            trace += (weight * weights[j] - on) * observations.height_noise2(j, 1.0.into());
            let (slopes, others) = rest.split_at_mut(inverse.len());
            rest = others;
            for ((slope, other), inverse) in slopes.iter_mut().zip(&weights[j + 1..]).zip(inverse) {
                *slope *= -2.0 * (weight * other - inverse);
            }
            squares.resize(slopes.len(), 0.0);
            for (axis, (by_length, length)) in by_length.iter_mut().zip(lengths).enumerate() {
                let column = observations.column(axis);
                let (at, per_length) = (column[j], 1.0 / length);
                for (square, x) in squares.iter_mut().zip(&column[j + 1..]) {
                    let step = (at - x) * per_length;
                    *square = step * step;
                }
                *by_length += dot(slopes, squares);
            }
        }
        trace
    }
}
