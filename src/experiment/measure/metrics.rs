//! Errors of a belief relative to the true surface.

use palpate_gp::math::normal::BAND_95;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Agreement of a belief with the ground truth on the grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Metrics {
    /// R of Eq. 5, Yi et al. 2016: Σ f·f̂ / sqrt(Σ f² · Σ f̂²). Not centred, so a constant can
    /// score high.
    pub r: f64,
    /// R of the heights minus their means; 0 for a constant.
    pub centred_r: f64,
    /// Root mean square error.
    pub rmse_m: f64,
    /// Largest absolute error.
    pub max_error_m: f64,
    /// Root mean square error in the outer tenth of the zone; `None` without a surface there.
    pub edge_rmse_m: Option<f64>,
    /// Root mean square error on the reachable surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reachable_rmse_m: Option<f64>,
    /// Root mean square error on the unreachable surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unreachable_rmse_m: Option<f64>,
    /// Share of the truth within 1.96·sqrt(σ² + noise²) of the mean; the noise includes errors that
    /// a smooth surface cannot represent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Mean negative log density of the true heights (in m): ½·ln(2π·s²) + ½·error²/s², s² = σ² +
    /// noise²; lower is better.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nlpd: Option<f64>,
}

/// Root mean square of errors; `None` if there are none.
pub(in crate::experiment) fn rmse(errors: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut count, mut squares) = (0.0, 0.0);
    for error in errors {
        count += 1.0;
        squares += error * error;
    }
    (count > 0.0).then(|| f64::sqrt(squares / count))
}

/// Returns [coverage](Metrics::coverage) and [NLPD](Metrics::nlpd) of errors with their predicted
/// variances; `None` if there are none.
pub(in crate::experiment) fn calibration(
    errors: impl IntoIterator<Item = (f64, f64)>,
) -> (Option<f64>, Option<f64>) {
    let (mut count, mut inside, mut nlpd) = (0.0, 0.0, 0.0);
    for (error, variance) in errors {
        // A belief without noise may have zero variance.
        let variance = f64::max(variance, f64::MIN_POSITIVE);
        count += 1.0;
        inside += f64::from(u8::from(f64::abs(error) <= BAND_95 * variance.sqrt()));
        nlpd += 0.5 * (std::f64::consts::TAU * variance).ln() + 0.5 * error * error / variance;
    }
    // Rounded to four decimals: each row stores one per touch.
    let mean = |sum: f64| Some((1e4 * sum / count).round() / 1e4).filter(|mean| mean.is_finite());
    (mean(inside), mean(nlpd))
}

impl Metrics {
    /// Compares true heights f with predicted heights g; leaves out calibration and the errors on
    /// parts of the zone. Welford's rule updates the centred sums, so that a large common offset
    /// does not cancel small variations of the heights.
    pub(in crate::experiment) fn from_heights(
        heights: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let (mut count, mut squares, mut max_error_m) = (0.0, 0.0, 0.0_f64);
        let [mut ff, mut gg, mut fg] = [0.0; 3];
        let [mut mean_f, mut mean_g] = [0.0; 2];
        let [mut spread_f, mut spread_g, mut covariance] = [0.0; 3];
        for (f, g) in heights {
            count += 1.0;
            ff += f * f;
            gg += g * g;
            fg += f * g;
            let (from_f, from_g) = (f - mean_f, g - mean_g);
            mean_f += from_f / count;
            mean_g += from_g / count;
            spread_f += from_f * (f - mean_f);
            spread_g += from_g * (g - mean_g);
            covariance += from_f * (g - mean_g);
            squares += (f - g) * (f - g);
            max_error_m = max_error_m.max((f - g).abs());
        }
        // A spread of rounding errors counts as 0.
        let spread = |spread: f64, square: f64| {
            if spread > 1e3 * f64::EPSILON * f64::EPSILON * square { spread } else { 0.0 }
        };
        let spreads = spread(spread_f, ff) * spread(spread_g, gg);
        Self {
            r: ratio(fg, f64::sqrt(ff * gg)),
            centred_r: ratio(covariance, spreads.sqrt()),
            rmse_m: f64::sqrt(squares / count),
            max_error_m,
            edge_rmse_m: None,
            reachable_rmse_m: None,
            unreachable_rmse_m: None,
            coverage: None,
            nlpd: None,
        }
    }
}

/// Eq. 5 of a constant with the sign of the heights f: |Σf| / sqrt(n · Σf²); `None` without
/// heights.
pub fn constant_r<'a>(heights_m: impl IntoIterator<Item = &'a f64>) -> Option<f64> {
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for f in heights_m {
        count += 1.0;
        sum += f;
        squares += f * f;
    }
    let r = f64::abs(sum) / f64::sqrt(count * squares);
    r.is_finite().then_some(r)
}

/// Returns numerator / denominator, 0 if the denominator is 0: the correlation of a constant counts
/// as 0.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { numerator / denominator } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compare(pairs: &[(f64, f64)]) -> Metrics {
        Metrics::from_heights(pairs.iter().copied())
    }

    /// Half of the toy is 1 and the other half has mean 1 and mean square 1.5, so a constant scores
    /// 1 / sqrt(1.25).
    #[test]
    fn a_constant_scores_high_in_r_and_zero_when_centred() {
        let toy = |x: f64| {
            if x.abs() <= 1.0 { (4.0 * std::f64::consts::PI * x).sin() + 1.0 } else { 1.0 }
        };
        let places = (0..4000).map(|i| -2.0 + (f64::from(i) + 0.5) / 1000.0);
        let constant: Vec<(f64, f64)> = places.map(|x| (toy(x), 0.7)).collect();
        let metrics = compare(&constant);
        let heights: Vec<f64> = constant.iter().map(|(height, _)| *height).collect();
        assert!((constant_r(&heights).unwrap() - metrics.r).abs() < 1e-12);
        assert_eq!(constant_r(&[]), None);
        assert!((metrics.r - 1.25f64.powf(-0.5)).abs() < 1e-6, "{}", metrics.r);
        assert!(metrics.centred_r.abs() < 1e-6);
    }

    #[test]
    fn a_perfect_belief_scores_one_and_an_offset_shows_in_rmse_only_when_centred() {
        let perfect = compare(&[(1.0, 1.0), (2.0, 2.0), (4.0, 4.0)]);
        assert!((perfect.r - 1.0).abs() < 1e-15 && (perfect.centred_r - 1.0).abs() < 1e-15);
        assert_eq!((perfect.rmse_m, perfect.max_error_m), (0.0, 0.0));
        let offset = compare(&[(1.0, 2.0), (2.0, 3.0), (4.0, 5.0)]);
        assert!((offset.centred_r - 1.0).abs() < 1e-14 && offset.r < 1.0);
        assert!((offset.rmse_m - 1.0).abs() < 1e-15 && (offset.max_error_m - 1.0).abs() < 1e-15);
    }

    #[test]
    fn an_offset_of_a_kilometre_changes_no_digit_that_counts() {
        let pairs: Vec<(f64, f64)> = (0..400)
            .map(|i| (1e-3 * f64::from(i).sin(), 1e-3 * (f64::from(i) + 0.3).sin()))
            .collect();
        let moved: Vec<(f64, f64)> = pairs.iter().map(|(f, g)| (f + 1e3, g + 1e3)).collect();
        assert!((compare(&pairs).centred_r - compare(&moved).centred_r).abs() < 1e-9);
        assert!((compare(&pairs).centred_r - 0.3f64.cos()).abs() < 0.01);
        let flat = vec![(0.65, 0.65); 1681];
        assert_eq!(compare(&flat).centred_r, 0.0);
    }

    #[test]
    fn a_zero_belief_scores_zero_not_nan() {
        let zero = compare(&[(1.0, 0.0), (2.0, 0.0)]);
        assert_eq!((zero.r, zero.centred_r), (0.0, 0.0));
    }

    /// Errors drawn from the predictive distribution lie in its band in 95 % of cases, and their
    /// mean negative log density is the distribution's entropy ½·ln(2πe·s²).
    #[test]
    fn honest_errors_are_covered_and_score_the_entropy() {
        let sd: f64 = 1e-3;
        let count = 20_000;
        let errors = (0..count).map(|i| {
            // Quantiles of the normal distribution, by bisection.
            let share = (f64::from(i) + 0.5) / f64::from(count);
            let (mut low, mut high) = (-9.0, 9.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let is_below = palpate_gp::math::normal::cumulative(middle) < share;
                if is_below { low = middle } else { high = middle }
            }
            (sd * low, sd * sd)
        });
        let (coverage, nlpd) = calibration(errors);
        let coverage = coverage.unwrap();
        assert!((coverage - 0.95).abs() < 1e-9, "{coverage}");
        let entropy = 0.5 * (std::f64::consts::TAU * std::f64::consts::E * sd * sd).ln();
        assert!((nlpd.unwrap() - entropy).abs() < 1e-3);
    }
}
