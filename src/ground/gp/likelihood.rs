//! The log marginal likelihood of hyperparameters and its gradient.

use super::cholesky::Factor;
use super::kernel::{Hyperparameters, Kernel, scaled_distance2};
use super::posterior::{Indefinite, Observations, factor_with_jitter};

/// Scores hyperparameters against fixed observations; keeps its buffers between calls.
///
/// With K = s²·A, A = C + g²·I (s the signal's standard deviation, C the correlations, g the
/// noise as a fraction of s) the log marginal likelihood is
/// −½·yᵀA⁻¹y / s² − n·ln s − ½·ln|A| − (n/2)·ln 2π.
pub struct Likelihood<'a> {
    kernel: &'static dyn Kernel,
    observations: &'a Observations,
    /// Correlations below the diagonal, packed by rows; kept while the length scales stay.
    correlations: Vec<f64>,
    slopes: Vec<f64>,
    at_lengths: Vec<f64>,
    factor: Factor,
    row: Vec<f64>,
    /// A⁻¹·y.
    weights: Vec<f64>,
    inverse: Vec<f64>,
    scratch: Vec<f64>,
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
        Self {
            kernel,
            observations,
            correlations: Vec::new(),
            slopes: Vec::new(),
            at_lengths: Vec::new(),
            factor: Factor::default(),
            row: Vec::new(),
            weights: Vec::new(),
            inverse: Vec::new(),
            scratch: Vec::new(),
            factorisations: 0,
        }
    }

    /// How many matrices were factored so far.
    pub fn factorisations(&self) -> u32 {
        self.factorisations
    }

    /// Log marginal likelihood; writes its gradient with respect to
    /// (ln signal_sd, ln length_1, …, ln length_d, ln noise_sd).
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
        let signal2 = at.signal_sd * at.signal_sd;
        let [by_signal, rest @ ..] = gradient else { return Ok(self.value(at.signal_sd, fit)) };
        self.gradient(signal2, noise_ratio, rest);
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
            self.gradient(signal_sd * signal_sd, noise_ratio, gradient);
        }
        Ok(Profile { log_likelihood: self.value(signal_sd, fit), signal_sd })
    }

    fn value(&self, signal_sd: f64, fit: f64) -> f64 {
        let n = self.observations.len() as f64;
        -0.5 * fit / (signal_sd * signal_sd)
            - n * signal_sd.ln()
            - 0.5 * self.factor.log_determinant()
            - 0.5 * n * (2.0 * std::f64::consts::PI).ln()
    }

    /// Factors A, solves for the weights, and returns yᵀA⁻¹y.
    fn factor(&mut self, length_scales: &[f64], noise_ratio: f64) -> Result<f64, Indefinite> {
        if self.at_lengths != length_scales {
            self.correlate(length_scales);
        }
        self.factorisations += 1;
        let correlations = &self.correlations;
        factor_with_jitter(
            &mut self.factor,
            self.observations.len(),
            noise_ratio * noise_ratio,
            &mut self.row,
            |i, row| {
                let begin = i * i.saturating_sub(1) / 2;
                row[..i].copy_from_slice(&correlations[begin..begin + i]);
                row[i] = 1.0;
            },
        )?;
        self.weights.clear();
        self.weights.extend_from_slice(self.observations.heights());
        self.factor.solve_lower(&mut self.weights);
        let fit = self.weights.iter().map(|v| v * v).sum();
        self.factor.solve_upper(&mut self.weights);
        Ok(fit)
    }

    fn correlate(&mut self, length_scales: &[f64]) {
        self.at_lengths.clear();
        self.at_lengths.extend_from_slice(length_scales);
        self.correlations.clear();
        self.slopes.clear();
        for i in 0..self.observations.len() {
            let place = self.observations.place(i);
            for other in self.observations.places().take(i) {
                let r2 = scaled_distance2(place, other, length_scales);
                let (correlation, slope) = self.kernel.correlation_slope(r2);
                self.correlations.push(correlation);
                self.slopes.push(slope);
            }
        }
    }

    /// With respect to the logarithms of the length scales and of the noise ratio, by
    /// ½·tr((w·wᵀ/s² − A⁻¹)·∂A), after [`factor`](Self::factor) at the same parameters.
    fn gradient(&mut self, signal2: f64, noise_ratio: f64, gradient: &mut [f64]) {
        self.factor.inverse(&mut self.scratch, &mut self.inverse);
        gradient.fill(0.0);
        let Some((by_noise, by_length)) = gradient.split_last_mut() else { return };
        let (mut entry, mut pair, mut trace) = (0, 0, 0.0);
        for i in 0..self.observations.len() {
            let place = self.observations.place(i);
            let weight = self.weights[i] / signal2;
            for (j, other) in self.observations.places().take(i).enumerate() {
                let pull = (weight * self.weights[j] - self.inverse[entry + j])
                    * (-2.0 * self.slopes[pair + j]);
                for (d, slope) in by_length.iter_mut().enumerate() {
                    let step = (place[d] - other[d]) / self.at_lengths[d];
                    *slope += pull * step * step;
                }
            }
            trace += weight * self.weights[i] - self.inverse[entry + i];
            entry += i + 1;
            pair += i;
        }
        *by_noise = noise_ratio * noise_ratio * trace;
    }
}
