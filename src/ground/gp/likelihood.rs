//! The log marginal likelihood of hyperparameters and its gradient.

use super::covariance::{self, Indefinite};
use super::dense::Dense;
use super::kernel::{Hyperparameters, Kernel};
use super::observations::Observations;
use crate::ground::simd::widest;

/// Scores hyperparameters against fixed observations; keeps its buffers between calls.
///
/// With K = s²·A, A = C + g²·I (s the signal's standard deviation, C the correlations, g the
/// noise as a fraction of s) the log marginal likelihood is
/// −½·yᵀA⁻¹y / s² − n·ln s − ½·ln|A| − (n/2)·ln 2π.
pub struct Likelihood<'a> {
    kernel: &'static dyn Kernel,
    observations: &'a Observations,
    dense: Dense,
    /// A⁻¹·y.
    weights: Vec<f64>,
    distances2: Vec<f64>,
    slopes: Vec<f64>,
    factorisations: u32,
}

/// A profiled score: the signal's standard deviation is the best one for its other parameters.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// Log marginal likelihood.
    pub log_likelihood: f64,
    /// The best signal standard deviation within its bounds, sqrt(yᵀA⁻¹y / n).
    pub signal_sd: f64,
}

impl<'a> Likelihood<'a> {
    /// Prepares to score hyperparameters against `observations`.
    pub fn new(kernel: &'static dyn Kernel, observations: &'a Observations) -> Self {
        let count = observations.len();
        Self {
            kernel,
            observations,
            dense: Dense::new(count),
            weights: Vec::with_capacity(count),
            distances2: vec![0.0; count],
            slopes: vec![0.0; count],
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
    /// [`Indefinite`] if the covariance cannot be factored.
    pub fn value_gradient(
        &mut self,
        at: &Hyperparameters,
        gradient: &mut [f64],
    ) -> Result<f64, Indefinite> {
        let noise_ratio = at.noise_sd / at.signal_sd;
        let fit = self.factor(&at.length_scales, noise_ratio)?;
        let [by_signal, rest @ ..] = gradient else { return Ok(self.value(at.signal_sd, fit)) };
        let signal2 = at.signal_sd * at.signal_sd;
        self.gradient(signal2, &at.length_scales, noise_ratio, rest);
        let by_noise = rest.last().copied().unwrap_or(0.0);
        *by_signal = fit / signal2 - self.observations.len() as f64 - by_noise;
        Ok(self.value(at.signal_sd, fit))
    }

    /// Log marginal likelihood with the best signal_sd in `signal_bounds`; with a `gradient`,
    /// writes it with respect to (ln length_1, …, ln length_d, ln noise_ratio).
    ///
    /// # Errors
    /// [`Indefinite`] if the covariance cannot be factored.
    pub fn profile(
        &mut self,
        length_scales: &[f64],
        noise_ratio: f64,
        signal_bounds: (f64, f64),
        gradient: Option<&mut [f64]>,
    ) -> Result<Profile, Indefinite> {
        let fit = self.factor(length_scales, noise_ratio)?;
        let best = (fit / self.observations.len().max(1) as f64).sqrt();
        let signal_sd = best.max(signal_bounds.0).min(signal_bounds.1);
        if let Some(gradient) = gradient {
            self.gradient(signal_sd * signal_sd, length_scales, noise_ratio, gradient);
        }
        Ok(Profile { log_likelihood: self.value(signal_sd, fit), signal_sd })
    }

    fn value(&self, signal_sd: f64, fit: f64) -> f64 {
        let n = self.observations.len() as f64;
        -0.5 * fit / (signal_sd * signal_sd)
            - n * signal_sd.ln()
            - 0.5 * self.dense.log_determinant()
            - 0.5 * n * (2.0 * std::f64::consts::PI).ln()
    }

    /// Factors A, solves for the weights, and returns yᵀA⁻¹y.
    fn factor(&mut self, length_scales: &[f64], noise_ratio: f64) -> Result<f64, Indefinite> {
        self.factorisations += 1;
        let (kernel, observations) = (self.kernel, self.observations);
        covariance::factor(&mut self.dense, kernel, observations, length_scales, noise_ratio)?;
        self.weights.clear();
        self.weights.extend_from_slice(observations.heights());
        Ok(self.dense.solve(&mut self.weights))
    }

    /// With respect to the logarithms of the length scales and of the noise ratio, by
    /// ½·tr((w·wᵀ/s² − A⁻¹)·∂A), after [`factor`](Self::factor) at the same parameters.
    fn gradient(&mut self, signal2: f64, lengths: &[f64], noise_ratio: f64, gradient: &mut [f64]) {
        self.dense.invert();
        gradient.fill(0.0);
        let Some((by_noise, by_length)) = gradient.split_last_mut() else { return };
        let observations = self.observations;
        let count = observations.len();
        let mut trace = 0.0;
        for j in 0..count {
            let weight = self.weights[j] / signal2;
            let [on, inverse @ ..] = self.dense.inverse_column(j) else { return };
            trace += weight * self.weights[j] - on;
            let below = j + 1..count;
            let distances2 = &mut self.distances2[below.clone()];
            let slopes = &mut self.slopes[below.clone()];
            observations.distances2(observations.place(j), lengths, j + 1, distances2);
            self.kernel.correlate_slope(distances2, slopes);
            let weights = &self.weights[below.clone()];
            widest(|| {
                for ((slope, other), inverse) in slopes.iter_mut().zip(weights).zip(inverse) {
                    *slope *= -2.0 * (weight * other - inverse);
                }
            });
            for (axis, (by_length, length)) in by_length.iter_mut().zip(lengths).enumerate() {
                let column = observations.column(axis);
                let at = column[j];
                let steps = column[below.clone()].iter().map(|x| (at - x) / length);
                *by_length += widest(|| {
                    slopes.iter().zip(steps).map(|(pull, step)| pull * step * step).sum::<f64>()
                });
            }
        }
        *by_noise = noise_ratio * noise_ratio * trace;
    }
}
