//! The exact posterior of a zero-mean Gaussian process, Eq. 3 of Yi et al. 2016.

use super::cholesky::{Factor, NotPositiveDefinite};
use super::kernel::{Hyperparameters, Kernel, scaled_distance2};
use thiserror::Error;

/// Places and the heights observed there.
#[derive(Clone, Debug, Default)]
pub struct Observations {
    dimension: usize,
    inputs: Vec<f64>,
    heights: Vec<f64>,
}

impl Observations {
    /// None yet, with `dimension` inputs each.
    pub fn new(dimension: usize) -> Self {
        Self { dimension, ..Self::default() }
    }

    /// Adds one; `place` has `dimension` coordinates.
    pub fn push(&mut self, place: &[f64], height: f64) {
        self.inputs.extend_from_slice(&place[..self.dimension]);
        self.heights.push(height);
    }

    /// Number of inputs.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.heights.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.heights.is_empty()
    }

    /// Where observation `i` was made.
    pub fn place(&self, i: usize) -> &[f64] {
        &self.inputs[i * self.dimension..(i + 1) * self.dimension]
    }

    /// All places in order.
    pub fn places(&self) -> impl Iterator<Item = &[f64]> {
        self.inputs.chunks_exact(self.dimension.max(1))
    }

    /// All heights in order.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }
}

/// Largest jitter tried, relative to the diagonal; beyond it the data contradict the kernel.
const JITTER_MAX: f64 = 1e-4;

/// No jitter, however large, made the covariance positive definite.
#[derive(Clone, Debug, Error)]
#[error("covariance of {count} touches stays indefinite with jitter {jitter:e}: {cause}")]
pub struct Indefinite {
    /// Number of observations.
    pub count: usize,
    /// Largest jitter tried, relative to the diagonal.
    pub jitter: f64,
    /// What the factorisation met.
    pub cause: NotPositiveDefinite,
}

/// Factors C + (noise² + jitter)·I with the smallest jitter of 0, 1e-15, 1e-14, … that works.
///
/// `covariance(i, row)` writes C[i][0..=i], whose diagonal is `diagonal`; `noise2` and the
/// returned jitter are in units of that diagonal.
///
/// # Errors
/// [`Indefinite`] if even the largest jitter does not help.
pub(super) fn factor_with_jitter(
    factor: &mut Factor,
    count: usize,
    noise2: f64,
    row: &mut Vec<f64>,
    mut covariance: impl FnMut(usize, &mut [f64]),
) -> Result<f64, Indefinite> {
    let mut jitter = 0.0;
    loop {
        factor.clear();
        let outcome = (0..count).try_for_each(|i| {
            row.resize(i + 1, 0.0);
            covariance(i, row);
            row[i] += noise2 + jitter;
            factor.append(row)
        });
        match outcome {
            Ok(()) => return Ok(jitter),
            Err(cause) if jitter >= JITTER_MAX => return Err(Indefinite { count, jitter, cause }),
            Err(_) => jitter = if jitter == 0.0 { 1e-15 } else { jitter * 10.0 },
        }
    }
}

/// Buffers of a query, so that asking allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    slope: Vec<f64>,
    solved: Vec<f64>,
}

/// The belief after the observations: mean and variance of the height at any place.
#[derive(Clone)]
pub struct Posterior {
    kernel: &'static dyn Kernel,
    hyperparameters: Hyperparameters,
    observations: Observations,
    factor: Factor,
    weights: Vec<f64>,
    jitter: f64,
}

impl Posterior {
    /// Conditions the prior on `observations`: n³/3 operations.
    ///
    /// # Errors
    /// [`Indefinite`] if the covariance cannot be factored.
    pub fn new(
        kernel: &'static dyn Kernel,
        hyperparameters: Hyperparameters,
        observations: Observations,
    ) -> Result<Self, Indefinite> {
        let mut factor = Factor::default();
        let signal2 = hyperparameters.signal_sd.powi(2);
        let noise2 = (hyperparameters.noise_sd / hyperparameters.signal_sd).powi(2);
        let jitter = factor_with_jitter(
            &mut factor,
            observations.len(),
            noise2,
            &mut Vec::new(),
            |i, row| correlations(kernel, &hyperparameters, &observations, i, row),
        )?;
        let mut weights = observations.heights().to_vec();
        factor.solve_lower(&mut weights);
        factor.solve_upper(&mut weights);
        weights.iter_mut().for_each(|weight| *weight /= signal2);
        Ok(Self { kernel, hyperparameters, observations, factor, weights, jitter })
    }

    /// The hyperparameters it was made with.
    pub fn hyperparameters(&self) -> &Hyperparameters {
        &self.hyperparameters
    }

    /// What it was conditioned on.
    pub fn observations(&self) -> &Observations {
        &self.observations
    }

    /// Jitter the factorisation needed, relative to the diagonal signal_sd²; 0 if none.
    pub fn jitter(&self) -> f64 {
        self.jitter
    }

    /// Mean height k*ᵀ·K⁻¹·y at `place`.
    pub fn mean(&self, place: &[f64]) -> f64 {
        let signal2 = self.hyperparameters.signal_sd.powi(2);
        let lengths = &self.hyperparameters.length_scales;
        let sum: f64 = (self.observations.places().zip(&self.weights))
            .map(|(at, weight)| {
                self.kernel.correlation(scaled_distance2(place, at, lengths)) * weight
            })
            .sum();
        signal2 * sum
    }

    /// Variance of the surface (without touch noise) k** − k*ᵀ·K⁻¹·k* at `place`, in [0, k**].
    pub fn variance(&self, place: &[f64], scratch: &mut Scratch) -> f64 {
        let lengths = &self.hyperparameters.length_scales;
        scratch.solved.clear();
        scratch.solved.extend(
            self.observations
                .places()
                .map(|at| self.kernel.correlation(scaled_distance2(place, at, lengths))),
        );
        self.factor.solve_lower(&mut scratch.solved);
        let explained: f64 = scratch.solved.iter().map(|v| v * v).sum();
        self.hyperparameters.signal_sd.powi(2) * (1.0 - explained).max(0.0)
    }

    /// As [`variance`](Self::variance), and writes its gradient with respect to the place.
    pub fn variance_gradient(
        &self,
        place: &[f64],
        gradient: &mut [f64],
        scratch: &mut Scratch,
    ) -> f64 {
        let lengths = &self.hyperparameters.length_scales;
        let signal2 = self.hyperparameters.signal_sd.powi(2);
        scratch.solved.clear();
        scratch.slope.clear();
        for at in self.observations.places() {
            let r2 = scaled_distance2(place, at, lengths);
            let (correlation, slope) = self.kernel.correlation_slope(r2);
            scratch.solved.push(correlation);
            scratch.slope.push(slope);
        }
        self.factor.solve_lower(&mut scratch.solved);
        let explained: f64 = scratch.solved.iter().map(|v| v * v).sum();
        self.factor.solve_upper(&mut scratch.solved);
        gradient.fill(0.0);
        for (i, at) in self.observations.places().enumerate() {
            let factor = -4.0 * signal2 * scratch.solved[i] * scratch.slope[i];
            for (d, slope) in gradient.iter_mut().enumerate() {
                *slope += factor * (place[d] - at[d]) / (lengths[d] * lengths[d]);
            }
        }
        signal2 * (1.0 - explained).max(0.0)
    }
}

/// Writes the correlations of observation `i` with observations 0..=i.
fn correlations(
    kernel: &dyn Kernel,
    hyperparameters: &Hyperparameters,
    observations: &Observations,
    i: usize,
    row: &mut [f64],
) {
    for (j, entry) in row.iter_mut().enumerate() {
        let r2 = scaled_distance2(
            observations.place(i),
            observations.place(j),
            &hyperparameters.length_scales,
        );
        *entry = kernel.correlation(r2);
    }
}
