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
use crate::math::simd::{dot, widest};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place as solve_lower;
use faer::{Accum, Mat, MatMut, MatRef, Par};

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
        let (covariance, residuals, left_variance) =
            condition(kernel, &hyperparameters, observations, &kept, factor.as_ref())?;
        let mut dense = dense(covariance.as_ref());
        let largest = 1.0 + hyperparameters.noise_ratio().height.powi(2);
        dense.factor(largest).map_err(|cause| indefinite(count, cause))?;
        let heights = residuals.iter().map(|height| hyperparameters.mean + height);
        let kept = kept.with_heights(heights.collect());
        let left_sd = hyperparameters.signal_sd * left_variance.sqrt();
        let posterior = Self::factored(kernel, hyperparameters, kept, &dense, 0.0);
        Ok(InducingPosterior { posterior, nystrom_residual_sd: left_sd })
    }
}

/// Copies the lower triangle into a dense matrix.
fn dense(matrix: MatRef<f64>) -> DenseMatrix {
    let mut dense = DenseMatrix::new(matrix.nrows());
    for (j, column) in matrix.col_iter().enumerate() {
        let below = column.iter().skip(j);
        dense.column_mut(j).iter_mut().zip(below).for_each(|(to, entry)| *to = *entry);
    }
    dense
}

/// Adds the lower triangle of a·b.
fn add_product(sum: &mut Mat<f64>, a: MatRef<f64>, b: MatRef<f64>) {
    let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    triangular::matmul(sum.as_mut(), lower, Accum::Add, a, whole, b, whole, 1.0, Par::Seq);
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
) -> (Vec<usize>, Mat<f64>) {
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
    let entry = |i: usize, j: usize| if j <= i { rows[j][chosen[i]] } else { 0.0 };
    let factor = Mat::from_fn(chosen.len(), chosen.len(), entry);
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
    factor: MatRef<f64>,
) -> Result<(Mat<f64>, Vec<f64>, f64), CovarianceError> {
    let count = kept.len();
    let mut precision = Mat::<f64>::zeros(count, count);
    let mut sums = Mat::<f64>::zeros(count, 1);
    let mut left_variance: f64 = 0.0;
    let mut block = Mat::<f64>::zeros(count, BLOCK);
    for begin in (0..observations.len()).step_by(BLOCK) {
        let length = BLOCK.min(observations.len() - begin);
        let mut solved = block.as_mut().subcols_mut(0, length);
        correlate(kernel, hyperparameters, observations, begin, kept, solved.as_mut());
        solve_lower(factor, solved.as_mut(), Par::Seq);
        for (at, mut column) in solved.as_mut().col_iter_mut().enumerate() {
            let i = begin + at;
            let residual = observations.heights()[i] - hyperparameters.mean;
            let Some(column) = column.as_mut().try_as_col_major_mut() else { continue };
            let column = column.as_slice_mut();
            let left = (1.0 - widest(|| dot(column, column))).max(0.0);
            left_variance = left_variance.max(left);
            let noise2 = observations.height_noise2(i, hyperparameters.noise_ratio()) + left;
            let weight = noise2.sqrt().recip();
            for (entry, sum) in column.iter_mut().zip(sums.col_as_slice_mut(0)) {
                *entry *= weight;
                *sum += *entry * (weight * residual);
            }
        }
        let solved = solved.as_ref();
        add_product(&mut precision, solved, solved.transpose());
    }
    let trace: f64 = (0..count).map(|i| precision[(i, i)]).sum();
    (0..count).for_each(|i| precision[(i, i)] += JITTER * trace);
    let mut root = dense(precision.as_ref());
    root.factor(0.0).map_err(|cause| indefinite(count, cause))?;
    let root = Mat::from_fn(count, count, |i, j| if j <= i { root.column(j)[i - j] } else { 0.0 });
    let mut transposed = factor.transpose().to_owned();
    solve_lower(root.as_ref(), transposed.as_mut(), Par::Seq);
    solve_lower(root.as_ref(), sums.as_mut(), Par::Seq);
    let residuals = transposed.transpose() * &sums;
    let mut covariance = Mat::<f64>::zeros(count, count);
    add_product(&mut covariance, transposed.transpose(), transposed.as_ref());
    add_product(&mut covariance, factor, factor.transpose());
    Ok((covariance, residuals.col_as_slice(0).to_vec(), left_variance))
}

/// Writes the correlations of the inducing touches with those from `begin` on, one column per
/// touch.
fn correlate(
    kernel: &dyn Kernel,
    hyperparameters: &Hyperparameters,
    observations: &Observations,
    begin: usize,
    kept: &Observations,
    mut out: MatMut<f64>,
) {
    let lengths = &hyperparameters.length_scales;
    for at in 0..out.ncols() {
        let Some(column) = out.as_mut().col_mut(at).try_as_col_major_mut() else { continue };
        let column = column.as_slice_mut();
        kept.distances2(observations.place(begin + at), lengths, 0, column);
        kernel.correlate(column);
    }
}
