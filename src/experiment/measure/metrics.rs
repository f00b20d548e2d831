//! How near a belief is to the true surface.

use crate::math::normal::BAND_95;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Agreement of a belief with the truth on the grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Metrics {
    /// Eq. 5 of Yi et al. 2016: Σ f·f̂ / sqrt(Σ f² · Σ f̂²). Not centred: a constant scores
    /// high wherever the heights' mean outweighs their spread.
    pub r: f64,
    /// The same after subtracting each one's mean; 0 for a constant.
    pub centred_r: f64,
    /// Root mean square error.
    pub rmse_m: f64,
    /// Largest error.
    pub max_error_m: f64,
    /// Root mean square error in the outer tenth of the zone; none where no surface is there.
    pub edge_rmse_m: Option<f64>,
    /// Root mean square error where the finger can touch the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reachable_rmse_m: Option<f64>,
    /// Root mean square error where it cannot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unreachable_rmse_m: Option<f64>,
    /// Share of the truth that lies within 1.96 standard deviations of the mean. The variance is
    /// that of a touch, σ² + noise²: the noise stands for what a smooth surface cannot follow,
    /// and that is part of the truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Mean negative log density of the true heights (in m) under the same normal distributions,
    /// ½·ln(2π·s²) + ½·error²/s² with s² = σ² + noise²; lower is better.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nlpd: Option<f64>,
}

/// Running sum of squared errors.
#[derive(Clone, Copy, Default)]
pub(in crate::experiment) struct Errors {
    count: f64,
    squares: f64,
}

impl Errors {
    pub(in crate::experiment) fn add(&mut self, error: f64) {
        self.count += 1.0;
        self.squares += error * error;
    }

    pub(in crate::experiment) fn rmse(&self) -> Option<f64> {
        (self.count > 0.0).then(|| (self.squares / self.count).sqrt())
    }
}

/// Running sums of how errors compare with their believed variance.
#[derive(Default)]
pub(in crate::experiment) struct Calibration {
    count: f64,
    inside: f64,
    nlpd: f64,
}

impl Calibration {
    pub(in crate::experiment) fn add(&mut self, error: f64, variance: f64) {
        // A belief without any noise may be sure to the last bit.
        let variance = variance.max(f64::MIN_POSITIVE);
        self.count += 1.0;
        self.inside += f64::from(u8::from(error.abs() <= BAND_95 * variance.sqrt()));
        self.nlpd += 0.5 * (std::f64::consts::TAU * variance).ln() + 0.5 * error * error / variance;
    }

    /// Share inside the 95 % band, and mean negative log density.
    pub(in crate::experiment) fn told(&self) -> (Option<f64>, Option<f64>) {
        (self.mean(self.inside), self.mean(self.nlpd))
    }

    /// To four decimals: the rows keep one after every touch.
    fn mean(&self, sum: f64) -> Option<f64> {
        let mean = (1e4 * sum / self.count).round() / 1e4;
        mean.is_finite().then_some(mean)
    }
}

/// Running sums of true heights f and believed heights g. The centred ones are updated by
/// Welford's rule: a large common offset must not cancel what little the heights vary.
#[derive(Default)]
pub(in crate::experiment) struct Sums {
    count: f64,
    ff: f64,
    gg: f64,
    fg: f64,
    mean_f: f64,
    mean_g: f64,
    spread_f: f64,
    spread_g: f64,
    covariance: f64,
    errors: Errors,
    max_error: f64,
}

impl Sums {
    pub(in crate::experiment) fn add(&mut self, f: f64, g: f64) {
        self.count += 1.0;
        self.ff += f * f;
        self.gg += g * g;
        self.fg += f * g;
        let (from_f, from_g) = (f - self.mean_f, g - self.mean_g);
        self.mean_f += from_f / self.count;
        self.mean_g += from_g / self.count;
        self.spread_f += from_f * (f - self.mean_f);
        self.spread_g += from_g * (g - self.mean_g);
        self.covariance += from_f * (g - self.mean_g);
        self.errors.add(f - g);
        self.max_error = self.max_error.max((f - g).abs());
    }

    /// Everything, given the errors at the edge and where the finger reaches and does not.
    pub(in crate::experiment) fn metrics(
        &self,
        [edge, reachable, unreachable]: [Errors; 3],
        calibration: Calibration,
    ) -> Metrics {
        // A spread of rounding errors is none.
        let spread = |spread: f64, square: f64| {
            if spread > 1e3 * f64::EPSILON * f64::EPSILON * square { spread } else { 0.0 }
        };
        let spreads = spread(self.spread_f, self.ff) * spread(self.spread_g, self.gg);
        let (coverage, nlpd) = calibration.told();
        Metrics {
            r: ratio(self.fg, (self.ff * self.gg).sqrt()),
            centred_r: ratio(self.covariance, spreads.sqrt()),
            rmse_m: self.errors.rmse().unwrap_or(f64::NAN),
            max_error_m: self.max_error,
            edge_rmse_m: edge.rmse(),
            reachable_rmse_m: reachable.rmse(),
            unreachable_rmse_m: unreachable.rmse(),
            coverage,
            nlpd,
        }
    }
}

/// Eq. 5 of a constant with the sign of the heights f: |Σf| / sqrt(n · Σf²); none of no heights.
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

/// A constant has no direction: its correlation counts as 0.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { numerator / denominator } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compare(pairs: &[(f64, f64)]) -> Metrics {
        let mut sums = Sums::default();
        pairs.iter().for_each(|&(truth, mean)| sums.add(truth, mean));
        sums.metrics([Errors::default(); 3], Calibration::default())
    }

    /// Half of the toy is 1 and the other half has mean 1 and mean square 1.5, so a constant
    /// scores 1 / sqrt(1.25).
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

    /// Errors that are drawn from the believed distribution lie in its band 95 times in a hundred,
    /// and their mean negative log density is the distribution's entropy ½·ln(2πe·s²).
    #[test]
    fn honest_errors_are_covered_and_score_the_entropy() {
        let sd: f64 = 1e-3;
        let mut calibration = Calibration::default();
        let count = 20_000;
        for i in 0..count {
            // Quantiles of the normal distribution, by bisection.
            let share = (f64::from(i) + 0.5) / f64::from(count);
            let (mut low, mut high) = (-9.0, 9.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let is_below = crate::math::normal::cumulative(middle) < share;
                if is_below { low = middle } else { high = middle }
            }
            calibration.add(sd * low, sd * sd);
        }
        let coverage = calibration.mean(calibration.inside).unwrap();
        assert!((coverage - 0.95).abs() < 1e-9, "{coverage}");
        let entropy = 0.5 * (std::f64::consts::TAU * std::f64::consts::E * sd * sd).ln();
        assert!((calibration.mean(calibration.nlpd).unwrap() - entropy).abs() < 1e-3);
    }
}
