//! Bound of the root mean square error that a belief has, by its own account.
//!
//! With the deviations s_i of the heights at the places i, from the band, the probabilities w_i of
//! a surface there, and the posterior's correlations ρ, the mean square error Q has the mean
//! E = Σ w_i s_i² / Σ w and about the distribution of E χ²_ν / ν with
//! ν = (Σ w_i s_i²)² / Σ w_i w_j ρ_ij² s_i² s_j² (Satterthwaite 1946); its quantiles are those of
//! Wilson & Hilferty (1931).

use palpate_gp::math::normal;

/// Number of places at which errors are predicted.
// heuristic: a mean over them is within a few percent.
pub const BOUNDED_AT: usize = 200;

/// Returns the correlations of covariances.
pub fn correlations(mut covariances: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let diagonal = covariances.iter().enumerate().map(|(i, row)| row[i]);
    let sds: Vec<f64> = diagonal.map(|variance| variance.max(f64::MIN_POSITIVE).sqrt()).collect();
    for (row, sd) in covariances.iter_mut().zip(&sds) {
        row.iter_mut().zip(&sds).for_each(|(value, other)| *value /= sd * other);
    }
    covariances
}

/// Returns the quantile of the root mean square error at a probability; `correlations` are the rows
/// of a matrix. Without any weight it is 0.
pub fn rms_quantile(
    weights: &[f64],
    sds: &[f64],
    correlations: &[Vec<f64>],
    probability: f64,
) -> f64 {
    let parts: Vec<f64> = weights.iter().zip(sds).map(|(w, sd)| w * sd * sd).collect();
    let (whole, weight) = (parts.iter().sum::<f64>(), weights.iter().sum::<f64>());
    if whole <= 0.0 || weight <= 0.0 {
        return 0.0;
    }
    let of_row = |(row, part): (&Vec<f64>, &f64)| -> f64 {
        let others = row.iter().zip(&parts).map(|(rho, other)| rho * rho * other);
        part * others.sum::<f64>()
    };
    let freedom = whole * whole / correlations.iter().zip(&parts).map(of_row).sum::<f64>();
    // Rounding may take it below that of one error in common.
    let spread = 2.0 / (9.0 * freedom.max(1.0));
    let root = 1.0 - spread + normal::quantile(probability) * spread.sqrt();
    (whole / weight * root.max(0.0).powi(3)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_gp::math::seed;
    use rand::RngExt;
    use rand_distr::{Distribution, StandardNormal};

    /// Errors in common have one degree of freedom, independent ones as many as there are, and no
    /// others lie outside of these.
    #[test]
    fn independent_errors_average_out() {
        let (weights, sds) = (vec![1.0; 50], vec![2.0; 50]);
        let row = |i: usize, rho: f64| (0..50).map(|j| if i == j { 1.0 } else { rho }).collect();
        let matrix = |rho: f64| (0..50).map(|i| row(i, rho)).collect::<Vec<Vec<f64>>>();
        let [alike, apart] = [1.0, 0.0].map(|rho| rms_quantile(&weights, &sds, &matrix(rho), 0.95));
        assert!((alike / 2.0 - 1.96).abs() < 0.03, "{alike}");
        // The square root of χ²_50 at 0.95, 67.50, over 50.
        assert!((apart / 2.0 - 1.162).abs() < 2e-3, "{apart}");
        let half = [[0.0; 25], [1.0; 25]].concat();
        assert!(rms_quantile(&half, &sds, &matrix(0.0), 0.95) > apart);
        assert_eq!(rms_quantile(&[0.0; 50], &sds, &matrix(0.0), 0.95), 0.0);
    }

    /// A share of draws equal to the probability lies below, whatever the weights and correlations.
    #[test]
    fn draws_lie_below_as_often_as_stated() {
        let mut random = seed::stream(1, 0, "error bound");
        for _ in 0..6 {
            let length = random.random_range(1.0..12.0);
            let rho = |i: usize, j: usize| (-(i as f64 - j as f64).abs() / length).exp();
            let correlations: Vec<Vec<f64>> =
                (0..40).map(|i| (0..40).map(|j| rho(i, j)).collect()).collect();
            let weights: Vec<f64> = (0..40).map(|_| random.random_range(0.0..1.0)).collect();
            let sds: Vec<f64> = (0..40).map(|_| random.random_range(0.5..2.0)).collect();
            let weight: f64 = weights.iter().sum();
            let mut rms = || {
                // A first-order process has these correlations.
                let (step, mut at) = (rho(0, 1), StandardNormal.sample(&mut random));
                let squares = weights.iter().zip(&sds).map(|(w, sd): (&f64, &f64)| {
                    let error: f64 = at;
                    let fresh: f64 = StandardNormal.sample(&mut random);
                    at = step * at + (1.0 - step * step).sqrt() * fresh;
                    w * (sd * error).powi(2)
                });
                (squares.sum::<f64>() / weight).sqrt()
            };
            let draws: Vec<f64> = (0..4000).map(|_| rms()).collect();
            for probability in [0.8, 0.9, 0.95] {
                let bound = rms_quantile(&weights, &sds, &correlations, probability);
                let below = draws.iter().filter(|rms| **rms <= bound).count() as f64 / 4000.0;
                assert!((below - probability).abs() < 0.025, "{below} for {probability}");
            }
        }
    }
}
