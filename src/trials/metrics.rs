//! How near the belief's mean is to the true surface.

use crate::ground::gp::Posterior;
use crate::ground::gp::posterior::Scratch;
use crate::world::{World, Zone};
use serde::{Deserialize, Serialize};

/// True heights on the test grid of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The test places.
    pub places: Vec<Vec<f64>>,
    /// The true height at each, above the zone's datum; none where the zone looks past the
    /// object.
    pub heights_m: Vec<Option<f64>>,
    /// Whether each lies in the outer tenth of the zone.
    pub is_edge: Vec<bool>,
}

/// Agreement of the belief's mean with the truth on the grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
}

impl Truth {
    /// Reads the world's surface on a grid of `per_side` places along each side of the zone.
    pub fn sample(world: &World, per_side: usize) -> Self {
        let places = world.scene().zone.grid(per_side);
        let heights_m = places.iter().map(|place| world.true_height_m(place)).collect();
        Self::new(&world.scene().zone, places, heights_m)
    }

    /// From recorded heights.
    pub fn new(zone: &Zone, places: Vec<Vec<f64>>, heights_m: Vec<Option<f64>>) -> Self {
        let is_edge = places.iter().map(|place| zone.is_edge(place)).collect();
        Self { places, heights_m, is_edge }
    }

    /// How many test places have a surface.
    pub fn count(&self) -> usize {
        self.heights_m.iter().flatten().count()
    }

    /// Compares a belief's mean with the truth wherever there is a surface.
    pub fn compare(&self, belief: &Posterior) -> Metrics {
        let mut sums = Sums::default();
        let mut edge = Sums::default();
        let mut scratch = Scratch::default();
        for ((place, height), &is_edge) in
            self.places.iter().zip(&self.heights_m).zip(&self.is_edge)
        {
            let Some(truth) = *height else { continue };
            let mean = belief.mean(place, &mut scratch);
            sums.add(truth, mean);
            if is_edge {
                edge.add(truth, mean);
            }
        }
        sums.metrics((edge.count > 0.0).then(|| edge.rmse()))
    }
}

/// Running sums of true heights f and believed heights g. The centred ones are updated by
/// Welford's rule: a large common offset must not cancel what little the heights vary.
#[derive(Default)]
struct Sums {
    count: f64,
    ff: f64,
    gg: f64,
    fg: f64,
    mean_f: f64,
    mean_g: f64,
    spread_f: f64,
    spread_g: f64,
    covariance: f64,
    error2: f64,
    max_error: f64,
}

impl Sums {
    fn add(&mut self, f: f64, g: f64) {
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
        self.error2 += (f - g) * (f - g);
        self.max_error = self.max_error.max((f - g).abs());
    }

    fn rmse(&self) -> f64 {
        (self.error2 / self.count).sqrt()
    }

    fn metrics(&self, edge_rmse_m: Option<f64>) -> Metrics {
        // A spread of rounding errors is none.
        let spread = |spread: f64, square: f64| {
            if spread > 1e3 * f64::EPSILON * f64::EPSILON * square { spread } else { 0.0 }
        };
        let spreads = spread(self.spread_f, self.ff) * spread(self.spread_g, self.gg);
        Metrics {
            r: ratio(self.fg, (self.ff * self.gg).sqrt()),
            centred_r: ratio(self.covariance, spreads.sqrt()),
            rmse_m: self.rmse(),
            max_error_m: self.max_error,
            edge_rmse_m,
        }
    }
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
        sums.metrics(None)
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
}
