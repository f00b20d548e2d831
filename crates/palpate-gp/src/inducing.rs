//! Inducing points: the approximate posterior of many touches (Snelson & Ghahramani 2006).
//!
//! Given the surface at a few inducing touches, all other touches are assumed to be independent.
//! The posterior is then that of the inducing touches alone, with heights and correlated errors
//! that are found in one pass over all touches. For n touches and m inducing ones it takes n·m² +
//! 4m³/3 operations and memory for m² numbers.
//!
//! The residual variance of a touch, given the inducing ones, is added to its noise. The largest
//! residual is the error of the approximation.

use super::covariance::CovarianceError;
use super::dense::{DenseMatrix, NotPositiveDefinite};
use super::kernel::{Hyperparameters, Kernel};
use super::observations::Observations;
use super::posterior::Posterior;
use crate::math::simd::widest;

/// Residual variance, as a fraction of the noise variance, below which no inducing touch is added.
/// It applies to the largest residual variance of all other touches;
/// a heuristic: their errors are then those of their own noise.
const NEGLIGIBLE: f64 = 1e-4;
/// The same limit as a fraction of the signal variance, at the level of rounding error.
const ROUNDING: f64 = 1e-12;
/// Number of evenly spread candidates per inducing touch; a heuristic.
const CANDIDATES: usize = 2;
/// Number of touches processed together; a heuristic: a block of them stays in the cache.
const BLOCK: usize = 256;
/// Jitter of the precision of the inducing heights, as a fraction of its trace, so that it can be
/// factored.
const JITTER: f64 = 1e-15;

/// Approximate posterior from inducing touches.
pub struct InducingPosterior {
    /// Posterior given the inducing touches.
    pub posterior: Posterior,
    /// Largest residual standard deviation of another touch's height given the inducing ones, in
    /// the heights' unit.
    pub nystrom_residual_sd: f64,
}

impl Posterior {
    /// Conditions the prior on the heights of `observations` through at most `most` inducing ones.
    ///
    /// # Errors
    /// [`CovarianceError`] if an observation is not finite, or the covariance cannot be factored.
    pub fn with_inducing_points(
        most: usize,
        kernel: &'static dyn Kernel,
        hyperparameters: Hyperparameters,
        observations: &Observations,
    ) -> Result<InducingPosterior, CovarianceError> {
        if let Some(index) = observations.first_not_finite() {
            return Err(CovarianceError::NotFinite { index });
        }
        let (indices, factor) = choose(most, kernel, &hyperparameters, observations);
        let count = indices.len();
        let kept = observations.places(&indices);
        let (mut covariance, residuals, left_variance) =
            condition(kernel, &hyperparameters, observations, &kept, &factor)?;
        let largest = 1.0 + hyperparameters.noise_ratio().height.powi(2);
        covariance.factor(largest).map_err(|cause| indefinite(count, cause))?;
        let heights = residuals.iter().map(|height| hyperparameters.mean + height);
        let kept = kept.with_heights(heights.collect());
        let left_sd = hyperparameters.signal_sd * left_variance.sqrt();
        let posterior = Self::factored(kernel, hyperparameters, kept, &covariance, 0.0);
        Ok(InducingPosterior { posterior, nystrom_residual_sd: left_sd })
    }
}

fn indefinite(count: usize, cause: NotPositiveDefinite) -> CovarianceError {
    CovarianceError::Indefinite { count, jitter: 0.0, cause }
}

/// Selects the inducing touches from evenly spread candidates: repeatedly the most uncertain one (a
/// pivoted Cholesky factorisation), until none is uncertain. Returns their indices, and the factor
/// of the correlations of their heights.
fn choose(
    most: usize,
    kernel: &dyn Kernel,
    hyperparameters: &Hyperparameters,
    observations: &Observations,
) -> (Vec<usize>, DenseMatrix) {
    let lengths = &hyperparameters.length_scales;
    let candidates = spread(CANDIDATES * most, lengths, observations);
    let places = observations.places(&candidates);
    let noise2 = hyperparameters.noise_ratio().height.powi(2);
    let enough = (NEGLIGIBLE * noise2).max(ROUNDING);
    let mut left = vec![1.0f64; candidates.len()];
    // Rows of L⁻¹·K for all candidates.
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < most {
        let largest = (0..left.len()).max_by(|a, b| left[*a].total_cmp(&left[*b]));
        let Some(next) = largest.filter(|next| left[*next] > enough) else { break };
        let mut row = vec![0.0; candidates.len()];
        places.distances2(places.place(next), lengths, 0, &mut row);
        kernel.correlate(&mut row);
        let scale = left[next].sqrt().recip();
        widest(|| {
            for known in &rows {
                let pulled = known[next];
                row.iter_mut().zip(known).for_each(|(row, known)| *row -= pulled * known);
            }
            for (row, left) in row.iter_mut().zip(&mut left) {
                *row *= scale;
                *left -= *row * *row;
            }
        });
        left[next] = 0.0;
        chosen.push(next);
        rows.push(row);
    }
    let factor = DenseMatrix::from_fn(chosen.len(), |i, j| rows[j][chosen[i]]);
    (chosen.iter().map(|&i| candidates[i]).collect(), factor)
}

/// Returns up to `most` touches, each the farthest from all before it in units of the length
/// scales.
fn spread(most: usize, length_scales: &[f64], observations: &Observations) -> Vec<usize> {
    let mut distances2 = vec![f64::INFINITY; observations.len()];
    let mut from = vec![0.0; observations.len()];
    let mut chosen = Vec::new();
    while chosen.len() < most {
        let farthest = (0..from.len()).max_by(|a, b| distances2[*a].total_cmp(&distances2[*b]));
        let Some(next) = farthest.filter(|next| distances2[*next] > 0.0) else { break };
        observations.distances2(observations.place(next), length_scales, 0, &mut from);
        distances2.iter_mut().zip(&from).for_each(|(least, new)| *least = least.min(*new));
        chosen.push(next);
    }
    chosen
}

/// Returns the covariance of the inducing heights with their errors, in units of the signal's
/// variance, their heights above the mean, and the largest residual variance of any touch.
///
/// With `factor` the L of the correlations K = L·Lᵀ of the inducing touches, V = L⁻¹·K(inducing,
/// all) and D the noise of all touches, the information of all touches about L⁻¹ times the inducing
/// heights has the precision B = V·D⁻¹·Vᵀ = R·Rᵀ. Thus the errors of the inducing heights have the
/// covariance W·Wᵀ with W = L·R⁻ᵀ, and the heights are W·R⁻¹·V·D⁻¹·y.
fn condition(
    kernel: &dyn Kernel,
    hyperparameters: &Hyperparameters,
    observations: &Observations,
    kept: &Observations,
    factor: &DenseMatrix,
) -> Result<(DenseMatrix, Vec<f64>, f64), CovarianceError> {
    let lengths = &hyperparameters.length_scales;
    let (count, stride) = (kept.len(), factor.stride());
    let mut precision = DenseMatrix::new(count);
    let mut sums = vec![0.0; count];
    let mut left_variance: f64 = 0.0;
    // Vᵀ and V·D^(-1/2) of a block of touches.
    let mut solved = vec![0.0; BLOCK * factor.padded()];
    let mut weighted = vec![0.0; stride * BLOCK];
    let mut left = [0.0; BLOCK];
    for begin in (0..observations.len()).step_by(BLOCK) {
        let length = BLOCK.min(observations.len() - begin);
        for (j, column) in solved.chunks_exact_mut(BLOCK).take(count).enumerate() {
            let column = &mut column[..length];
            observations.distances2(kept.place(j), lengths, begin, column);
            kernel.correlate(column);
        }
        factor.solve_rows(&mut solved, BLOCK);
        left.fill(1.0);
        for column in solved.chunks_exact(BLOCK) {
            left.iter_mut().zip(column).for_each(|(left, entry)| *left -= entry * entry);
        }
        weighted.fill(0.0);
        for (at, column) in weighted.chunks_exact_mut(stride).take(length).enumerate() {
            let i = begin + at;
            let residual = observations.heights()[i] - hyperparameters.mean;
            let left = left[at].max(0.0);
            left_variance = left_variance.max(left);
            let noise2 = observations.height_noise2(i, hyperparameters.noise_ratio()) + left;
            let weight = noise2.sqrt().recip();
            for (j, (entry, sum)) in column.iter_mut().zip(&mut sums).enumerate() {
                *entry = weight * solved[j * BLOCK + at];
                *sum += *entry * (weight * residual);
            }
        }
        precision.subtract_square(&weighted);
    }
    let trace: f64 = (0..count).map(|i| -precision.column(i)[0]).sum();
    let regular = |i: usize, j: usize| {
        let jitter = if i == j { JITTER * trace } else { 0.0 };
        jitter - precision.column(j)[i - j]
    };
    let mut root = DenseMatrix::from_fn(count, regular);
    root.factor(0.0).map_err(|cause| indefinite(count, cause))?;
    // L, and W = L·R⁻ᵀ.
    let mut product = vec![0.0; stride * factor.padded()];
    for (j, column) in product.chunks_exact_mut(stride).take(count).enumerate() {
        column[j..count].copy_from_slice(factor.column(j));
    }
    let mut negative = DenseMatrix::new(count);
    negative.subtract_square(&product);
    root.solve_rows(&mut product, stride);
    negative.subtract_square(&product);
    root.solve_lower(&mut sums);
    let mut residuals = vec![0.0; count];
    for (column, sum) in product.chunks_exact(stride).zip(&sums) {
        residuals.iter_mut().zip(column).for_each(|(residual, entry)| *residual += entry * sum);
    }
    let covariance = DenseMatrix::from_fn(count, |i, j| -negative.column(j)[i - j]);
    Ok((covariance, residuals, left_variance))
}
