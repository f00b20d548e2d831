//! Integrated variance reduction by one more observation (Cohn, Ghahramani & Jordan 1996).

use super::observations::Observations;
use super::posterior::{Posterior, Scratch};
use crate::math::simd::widest_dot;

/// A posterior with the reference places at which its variance is summed.
pub struct VarianceReduction<'a> {
    posterior: &'a Posterior,
    references: Observations,
    /// Weight of each reference place.
    weights: Vec<f64>,
    /// L⁻¹·k(X, r) of each reference place r, one after the other.
    whitened: Vec<f64>,
}

impl<'a> VarianceReduction<'a> {
    /// Prepares for `references`: n² operations per reference.
    pub fn new<'b>(posterior: &'a Posterior, references: impl Iterator<Item = &'b [f64]>) -> Self {
        let mut places = Observations::new(posterior.observations().dimension());
        let mut whitened = Vec::new();
        let mut scratch = Scratch::default();
        for place in references {
            places.push_height(place, 0.0);
            posterior.whiten(place, &mut scratch);
            whitened.extend_from_slice(&scratch.solved);
        }
        Self { posterior, weights: vec![1.0; places.len()], references: places, whitened }
    }

    /// Sets a weight for each reference; missing weights are 0.
    pub fn weighted(mut self, mut weights: Vec<f64>) -> Self {
        weights.resize(self.references.len(), 0.0);
        self.weights = weights;
        self
    }

    /// Returns the mean reduction of the variance at the references by an observation at `place`,
    /// (1/m)·Σ_r w_r·k(r, x)² / (σ²(x) + noise²) with the posterior covariance k and variance σ²:
    /// n² + n·m operations.
    pub fn at(&self, place: &[f64], scratch: &mut Scratch) -> f64 {
        let explained = self.posterior.whiten(place, scratch);
        let Scratch { solved, slopes: correlations, .. } = scratch;
        correlations.resize(self.references.len(), 0.0);
        let hyperparameters = self.posterior.hyperparameters();
        let lengths = &hyperparameters.length_scales;
        self.references.distances2(place.iter().copied(), lengths, 0, correlations);
        self.posterior.kernel().correlate(correlations);
        let pairs = correlations.iter().zip(&self.weights).enumerate();
        let squares: f64 = pairs
            .map(|(r, (prior, weight))| weight * (prior - self.explained(r, solved)).powi(2))
            .sum();
        let signal2 = hyperparameters.signal_sd.powi(2);
        let noise2 = hyperparameters.noise_sd.powi(2) / signal2 + self.posterior.jitter();
        let variance = (1.0 - explained).max(0.0) + noise2;
        signal2 * squares / (variance * self.references.len().max(1) as f64)
    }

    /// Returns the part of the covariance of reference `r` with the place of `solved` that the
    /// observations explain.
    fn explained(&self, r: usize, solved: &[f64]) -> f64 {
        let start = r * solved.len();
        widest_dot(&self.whitened[start..start + solved.len()], solved)
    }
}
