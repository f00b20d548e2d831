//! How sure a robust fit is if some residuals err together.

use super::least_squares::{Problem, huber_weight, jacobian};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Covariance of the parameters at `state`, A⁻¹ (Σ g gᵀ) A⁻¹ · n/(n − 1) with A = JᵀWJ and the
/// n clusters' gradients g = Σ Jᵢᵀ wᵢ rᵢ (Liang & Zeger 1986). Residuals without a cluster, those
/// of what was believed before, count in A only. None if A has no inverse.
pub fn covariance<P: Problem>(
    problem: &P,
    state: &P::State,
    cluster: impl Fn(usize) -> Option<usize>,
) -> Option<DMatrix<f64>> {
    let residuals = problem.residuals(state);
    let slopes = jacobian(problem, state, residuals.len());
    let weights = residuals.map(huber_weight);
    let mut weighted = slopes.clone();
    (weighted.row_iter_mut().zip(weights.iter())).for_each(|(mut row, weight)| row *= *weight);
    let inverse = (slopes.transpose() * &weighted).try_inverse()?;
    let mut gradients: BTreeMap<usize, DVector<f64>> = BTreeMap::new();
    for (i, residual) in residuals.iter().enumerate() {
        if let Some(cluster) = cluster(i) {
            let sum = gradients.entry(cluster).or_insert_with(|| DVector::zeros(slopes.ncols()));
            *sum += weighted.row(i).transpose() * *residual;
        }
    }
    let count = gradients.len() as f64;
    let parameters = slopes.ncols();
    let spread = (gradients.values())
        .fold(DMatrix::zeros(parameters, parameters), |sum, g| sum + g * g.transpose());
    Some(&inverse * spread * &inverse * (count / (count - 1.0).max(1.0)))
}
