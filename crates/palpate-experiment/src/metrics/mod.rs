//! Errors of a belief relative to the true surface.

pub mod recognition;
pub mod shape;
pub mod silhouette;
pub mod truth;

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
    /// Share of the truth within the 95 % band: between the belief's quantiles at 0.025 and 0.975.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Coverage of the reachable surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reachable_coverage: Option<f64>,
    /// Coverage of the unreachable surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unreachable_coverage: Option<f64>,
    /// Mean interval score of the 95 % band (Gneiting & Raftery 2007, Eq. 43): lower is better.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_score_m: Option<f64>,
    /// Mean negative log density of the true heights (in m): ½·ln(2π·s²) + ½·error²/s², s² = σ² +
    /// noise²; lower is better.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nlpd: Option<f64>,
}

/// Root mean square of errors; `None` if there are none.
pub(crate) fn rmse(errors: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut count, mut squares) = (0.0, 0.0);
    for error in errors {
        count += 1.0;
        squares += error * error;
    }
    (count > 0.0).then(|| f64::sqrt(squares / count))
}

/// Returns the [NLPD](Metrics::nlpd) of errors with their predicted variances; `None` if there are
/// none.
pub(crate) fn nlpd(errors: impl IntoIterator<Item = (f64, f64)>) -> Option<f64> {
    mean(errors.into_iter().map(|(error, variance)| {
        // A belief without noise may have zero variance.
        let variance = f64::max(variance, f64::MIN_POSITIVE);
        0.5 * (std::f64::consts::TAU * variance).ln() + 0.5 * error * error / variance
    }))
    .map(round)
}

/// Returns the share of values within their band [low, high]; `None` if there are none.
pub(crate) fn coverage(banded: impl IntoIterator<Item = (f64, [f64; 2])>) -> Option<f64> {
    let is_inside = |(value, [low, high]): (f64, [f64; 2])| low <= value && value <= high;
    mean(banded.into_iter().map(|it| f64::from(u8::from(is_inside(it))))).map(round)
}

/// Share of the truth outside a 95 % band.
const OUTSIDE: f64 = 0.05;

/// Returns the mean [interval score](Metrics::interval_score_m) of values with their band [low,
/// high]; `None` if there are none.
pub(crate) fn interval_score(banded: impl IntoIterator<Item = (f64, [f64; 2])>) -> Option<f64> {
    mean(banded.into_iter().map(|(value, [low, high])| {
        let outside = (low - value).max(0.0) + (value - high).max(0.0);
        high - low + 2.0 / OUTSIDE * outside
    }))
}

/// Mean of finite values; `None` if there are none or it is not finite.
fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (count, sum) =
        values.into_iter().fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    Some(sum / count).filter(|mean: &f64| mean.is_finite())
}

/// Rounds to four decimals: each row stores one value per touch.
fn round(value: f64) -> f64 {
    (1e4 * value).round() / 1e4
}

impl Metrics {
    /// Compares true heights f with predicted heights g; leaves out calibration and the errors on
    /// parts of the zone. Welford's rule updates the centred sums, so that a large common offset
    /// does not cancel small variations of the heights.
    pub(crate) fn from_heights(heights: impl IntoIterator<Item = (f64, f64)>) -> Self {
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
            reachable_coverage: None,
            unreachable_coverage: None,
            interval_score_m: None,
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
    use palpate_gp::math::normal;

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

    /// Errors drawn from the predictive distribution lie in its band in 95 % of cases, their mean
    /// negative log density is the distribution's entropy ½·ln(2πe·s²), and no other band has a
    /// smaller interval score.
    #[test]
    fn honest_errors_are_covered_and_score_the_entropy() {
        let sd: f64 = 1e-3;
        let count = 20_000;
        let errors: Vec<f64> = (0..count)
            .map(|i| sd * normal::quantile((f64::from(i) + 0.5) / f64::from(count)))
            .collect();
        let banded = |factor: f64| {
            let half = factor * normal::BAND_95 * sd;
            errors.iter().map(move |error| (*error, [-half, half]))
        };
        let covered = coverage(banded(1.0)).unwrap();
        assert!((covered - 0.95).abs() < 1e-9, "{covered}");
        let entropy = 0.5 * (std::f64::consts::TAU * std::f64::consts::E * sd * sd).ln();
        let density = nlpd(errors.iter().map(|error| (*error, sd * sd))).unwrap();
        assert!((density - entropy).abs() < 1e-3);
        let score = interval_score(banded(1.0)).unwrap();
        assert!([0.5, 0.9, 1.1, 2.0].iter().all(|&it| interval_score(banded(it)).unwrap() > score));
    }

    /// Below the band by 1, inside, and above by 2: 40 times 3 over 3, plus the width.
    #[test]
    fn the_interval_score_adds_forty_times_the_distance_outside() {
        let values = [-1.0, 2.0, 6.0].map(|value| (value, [0.0, 4.0]));
        assert!((interval_score(values).unwrap() - 44.0).abs() < 1e-12);
        assert_eq!((interval_score([]), coverage([]), nlpd([])), (None, None, None));
    }
}
