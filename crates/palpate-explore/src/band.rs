//! Two-sided band of the heights, learned from objects.
//!
//! A finger rests on the highest point under its hull. The surface that it cannot reach therefore
//! lies below the mean, and how far below does not show in the contacts. A [`LearnedBand`] has two
//! half-widths, each log-linear in features of the posterior and fitted by quantile regression
//! (Koenker & Bassett 1978) to objects whose surface is known. With the standard deviation σ of a
//! touch, the signal's standard deviation s, n contacts, length scales l, the height d of the mean
//! above the lowest contact (below the highest one for the upper half-width), and its rise
//! g = √(Σ_i (l_i ∂_i mean)²) over a length scale:
//!
//! ln(w/s) = c₀ + c₁ ln(σ/s) + c₂ ln(n/15) + c₃ ln(d/s + 0.1) + c₄ ln(g/s + 0.1)
//!
//! The quantile at the probability p < ½ is mean − w (ln(½/p) / ln 20)^tail, so that w is the
//! half-width of the 95 % band. Physics limits both sides: the surface lies below the swept space,
//! and between the nearest and the farthest depth of the zone.

use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Number of coefficients of a half-width.
pub const COEFFICIENTS: usize = 5;

/// Number of contacts and smallest height, in units of the signal, at which a feature is zero or
/// no longer changes; heuristics.
const CONTACTS: f64 = 15.0;
const LEAST: f64 = 0.1;

/// Smallest and largest logarithm of a half-width in units of the signal; far beyond any belief.
const LOG_RANGE: [f64; 2] = [-12.0, 6.0];

/// Half-widths of the band, learned from objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LearnedBand {
    /// Objects that the constants were learned from.
    pub learned_from: Cow<'static, str>,
    /// Coefficients c₀ to c₄ of the lower half-width.
    pub below: [f64; COEFFICIENTS],
    /// Coefficients c₀ to c₄ of the upper half-width.
    pub above: [f64; COEFFICIENTS],
    /// Exponent of the tails; 0.5 for those of a normal distribution, 1 for exponential ones.
    pub tail: f64,
}

/// Band `objects`: what `palpate calibrate --band experiments/suite/choosing.toml --set touches=60`
/// prints, to three decimals.
pub static OBJECTS: LearnedBand = LearnedBand {
    learned_from: Cow::Borrowed("experiments/suite/choosing.toml"),
    below: [1.408, 0.621, -0.195, 0.383, 0.529],
    above: [2.148, 1.183, -0.799, -0.233, 0.179],
    tail: 1.75,
};

impl Validate for LearnedBand {
    fn check(&self, rules: &mut Rules) {
        rules.numbers("below", &self.below, -100.0..=100.0);
        rules.numbers("above", &self.above, -100.0..=100.0);
        rules.number("tail", self.tail, 0.1..=10.0);
    }
}

impl LearnedBand {
    /// Returns the lower and upper half-width of the 95 % band, m.
    pub fn half_widths_m(&self, at: &BandFeatures) -> [f64; 2] {
        let [below, above] = at.features();
        [(self.below, below), (self.above, above)]
            .map(|(constants, features)| at.signal_sd * relative_width(&constants, &features))
    }

    /// Returns the quantile at the probability `p`, m above the datum, within the limits.
    pub fn quantile_m(&self, at: &BandFeatures, p: f64) -> f64 {
        self.tail(p).quantile_m(at, self.half_widths_m(at))
    }

    /// Returns the quantiles at each of `probabilities`, m above the datum, within the limits.
    pub fn quantiles_m(&self, all: &[BandFeatures], probabilities: &[f64]) -> Vec<Vec<f64>> {
        let tails: Vec<Tail> = probabilities.iter().map(|p| self.tail(*p)).collect();
        let row = |at| {
            let half_widths_m = self.half_widths_m(at);
            tails.iter().map(|tail| tail.quantile_m(at, half_widths_m)).collect()
        };
        all.iter().map(row).collect()
    }

    fn tail(&self, p: f64) -> Tail {
        match p < 0.5 {
            true => Tail { is_upper: false, share: tail_share(p, self.tail) },
            false => Tail { is_upper: true, share: tail_share(1.0 - p, self.tail) },
        }
    }
}

/// A tail of the distribution of heights, from a probability on.
struct Tail {
    is_upper: bool,
    /// Deviation from the mean at the probability, in units of the half-width.
    share: f64,
}

impl Tail {
    fn quantile_m(&self, at: &BandFeatures, [below_m, above_m]: [f64; 2]) -> f64 {
        let height_m = match self.is_upper {
            false => at.mean_m - below_m * self.share,
            true => at.mean_m + above_m * self.share,
        };
        let [low_m, high_m] = at.limits_m;
        height_m.min(high_m).max(low_m)
    }
}

/// Returns a half-width in units of the signal's standard deviation, from its coefficients and
/// features.
pub fn relative_width(coefficients: &[f64], features: &[f64; COEFFICIENTS]) -> f64 {
    let log: f64 = coefficients.iter().zip(features).map(|(c, feature)| c * feature).sum();
    log.clamp(LOG_RANGE[0], LOG_RANGE[1]).exp()
}

/// Returns the deviation at which a share `p` ≤ ½ of a tail lies beyond, in units of the half-width
/// of the 95 % band.
fn tail_share(p: f64, tail: f64) -> f64 {
    ((0.5 / p.max(f64::MIN_POSITIVE)).ln().max(0.0) / 20f64.ln()).powf(tail)
}

/// Features of a belief at a place, from which a learned band follows.
#[derive(Clone, Debug, PartialEq)]
pub struct BandFeatures {
    /// Mean height above the datum, m.
    pub mean_m: f64,
    /// Standard deviation of a touch, √(σ² + noise²), m.
    pub sd_m: f64,
    /// Standard deviation of the signal, m.
    pub signal_sd: f64,
    /// Norm of the mean's gradient, each derivative times the length scale, m.
    pub rise_m: f64,
    /// Heights of the lowest and the highest contact, m.
    pub contacts_m: [f64; 2],
    /// Number of contacts.
    pub contacts: usize,
    /// Lowest and highest possible height, m: zone and swept space.
    pub limits_m: [f64; 2],
}

impl BandFeatures {
    /// Returns the features of the lower and of the upper half-width.
    pub fn features(&self) -> [[f64; COEFFICIENTS]; 2] {
        let Self { mean_m, sd_m, signal_sd, rise_m, contacts_m: [low_m, high_m], .. } = *self;
        let log = |part_m: f64| (part_m.max(0.0) / signal_sd + LEAST).ln();
        let of_sd = (sd_m / signal_sd).max(f64::MIN_POSITIVE).ln();
        let of_count = (self.contacts as f64 / CONTACTS).max(f64::MIN_POSITIVE).ln();
        let of_rise = log(rise_m);
        [mean_m - low_m, high_m - mean_m].map(|away_m| [1.0, of_sd, of_count, log(away_m), of_rise])
    }
}
