//! The log marginal likelihood of hyperparameters and its gradient.

use super::correlations::{Correlations, batches};
use super::covariance::{self, CovarianceError};
use super::dense::Dense;
use super::kernel::{Hyperparameters, Kernel};
use super::mean::Mean;
use super::observations::Observations;
use super::range::Scale;
use crate::ground::simd::{dot, widest};

/// Scores hyperparameters against fixed observations; keeps its buffers between calls.
///
/// With K = s²·A, A = C + g²·I (s the signal's standard deviation, C the correlations, g the
/// noise as a fraction of s) the log marginal likelihood is
/// −½·yᵀA⁻¹y / s² − n·ln s − ½·ln|A| − (n/2)·ln 2π, where y are the heights above the mean.
pub struct Likelihood<'a> {
    kernel: &'static dyn Kernel,
    mean: Mean,
    observations: &'a Observations,
    dense: Dense,
    /// L⁻¹·y, then A⁻¹·y where a gradient is asked for.
    weights: Vec<f64>,
    scratch: Vec<f64>,
    correlations: Correlations,
    factorisations: u32,
}

/// A profiled score: the signal's standard deviation follows from the other parameters.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// Log marginal likelihood.
    pub log_likelihood: f64,
    /// Signal standard deviation.
    pub signal_sd: f64,
    /// The mean that the model chooses.
    pub mean: f64,
}

impl<'a> Likelihood<'a> {
    /// Prepares to score hyperparameters against `observations`.
    pub fn new(kernel: &'static dyn Kernel, mean: Mean, observations: &'a Observations) -> Self {
        let count = observations.len();
        Self {
            kernel,
            mean,
            observations,
            dense: Dense::new(count),
            weights: Vec::with_capacity(count),
            scratch: Vec::with_capacity(count),
            correlations: Correlations::default(),
            factorisations: 0,
        }
    }

    /// How many matrices were factored so far.
    pub fn factorisations(&self) -> u32 {
        self.factorisations
    }

    /// Log marginal likelihood; writes its gradient with respect to
    /// (ln signal_sd, ln length_1, …, ln length_d, ln noise_sd), unless `gradient` is empty.
    ///
    /// # Errors
    /// [`CovarianceError`] if the covariance cannot be factored.
    pub fn value_gradient(
        &mut self,
        at: &Hyperparameters,
        gradient: &mut [f64],
    ) -> Result<f64, CovarianceError> {
        let noise_ratio = at.noise_sd / at.signal_sd;
        self.factor(&at.length_scales, noise_ratio)?;
        let fit = self.whiten(at.mean);
        let [by_signal, rest @ ..] = gradient else { return Ok(self.value(at.signal_sd, fit)) };
        let signal2 = at.signal_sd * at.signal_sd;
        self.gradient(signal2, &at.length_scales, noise_ratio, rest);
        let by_noise = rest.last().copied().unwrap_or(0.0);
        *by_signal = fit / signal2 - self.observations.len() as f64 - by_noise;
        Ok(self.value(at.signal_sd, fit))
    }

    /// Log marginal likelihood with the signal_sd that `scale` says; with a `gradient`, writes it
    /// with respect to (ln length_1, …, ln length_d, ln noise_ratio), the prior of signal_sd
    /// included.
    ///
    /// # Errors
    /// [`CovarianceError`] if the covariance cannot be factored.
    pub fn profile(
        &mut self,
        length_scales: &[f64],
        noise_ratio: f64,
        scale: &Scale,
        gradient: Option<&mut [f64]>,
    ) -> Result<Profile, CovarianceError> {
        self.factor(length_scales, noise_ratio)?;
        let mean = self.mean.of(self.observations.heights(), &self.dense, &mut self.scratch);
        let fit = self.whiten(mean);
        let count = self.observations.len();
        let signal_sd = scale.signal_sd(fit, count, noise_ratio);
        if let Some(gradient) = gradient {
            let signal2 = signal_sd * signal_sd;
            self.gradient(signal2, length_scales, noise_ratio, gradient);
            // The best signal_sd does not change the value to first order; a known noise makes
            // it fall as the ratio rises.
            if let (Scale::KnownNoise(_), Some(by_noise)) = (scale, gradient.last_mut()) {
                *by_noise -= fit / signal2 - count as f64;
            }
        }
        Ok(Profile { log_likelihood: self.value(signal_sd, fit), signal_sd, mean })
    }

    fn value(&self, signal_sd: f64, fit: f64) -> f64 {
        let n = self.observations.len() as f64;
        -0.5 * fit / (signal_sd * signal_sd)
            - n * signal_sd.ln()
            - 0.5 * self.dense.log_determinant()
            - 0.5 * n * (2.0 * std::f64::consts::PI).ln()
    }

    fn factor(&mut self, length_scales: &[f64], noise_ratio: f64) -> Result<(), CovarianceError> {
        self.factorisations += 1;
        let (kernel, observations) = (self.kernel, self.observations);
        let buffer = &mut self.correlations;
        let dense = &mut self.dense;
        covariance::factor(dense, kernel, observations, length_scales, noise_ratio, buffer)
            .map(|_| ())
    }

    /// Makes L⁻¹·y of the heights above `mean` the weights, and returns its square yᵀA⁻¹y.
    fn whiten(&mut self, mean: f64) -> f64 {
        self.weights.clear();
        self.weights.extend(self.observations.heights().iter().map(|y| y - mean));
        self.dense.solve_lower(&mut self.weights);
        widest(|| dot(&self.weights, &self.weights))
    }

    /// With respect to the logarithms of the length scales and of the noise ratio, by
    /// ½·tr((w·wᵀ/s² − A⁻¹)·∂A), after [`whiten`](Self::whiten) at the same parameters. The
    /// mean is the best one or does not depend on them, so it has no part in this.
    fn gradient(&mut self, signal2: f64, lengths: &[f64], noise_ratio: f64, gradient: &mut [f64]) {
        self.dense.solve_upper(&mut self.weights);
        self.dense.invert();
        gradient.fill(0.0);
        let Some((by_noise, by_length)) = gradient.split_last_mut() else { return };
        let observations = self.observations;
        let count = observations.len();
        let mut trace = 0.0;
        for columns in batches(count) {
            let mut rest =
                self.correlations.slopes_of(self.kernel, observations, lengths, &columns);
            for j in columns {
                let weight = self.weights[j] / signal2;
                let [on, inverse @ ..] = self.dense.inverse_column(j) else { return };
                trace += weight * self.weights[j] - on;
                let (slopes, others) = rest.split_at_mut(inverse.len());
                rest = others;
                let weights = &self.weights[j + 1..];
                widest(|| {
                    for ((slope, other), inverse) in slopes.iter_mut().zip(weights).zip(inverse) {
                        *slope *= -2.0 * (weight * other - inverse);
                    }
                });
                for (axis, (by_length, length)) in by_length.iter_mut().zip(lengths).enumerate() {
                    let column = observations.column(axis);
                    let (at, per_length) = (column[j], 1.0 / length);
                    self.scratch.resize(slopes.len(), 0.0);
                    *by_length += widest(|| {
                        for (square, x) in self.scratch.iter_mut().zip(&column[j + 1..]) {
                            let step = (at - x) * per_length;
                            *square = step * step;
                        }
                        dot(slopes, &self.scratch)
                    });
                }
            }
        }
        *by_noise = noise_ratio * noise_ratio * trace;
    }
}
