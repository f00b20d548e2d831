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

#[derive(Default)]
struct Sums {
    count: f64,
    f: f64,
    g: f64,
    ff: f64,
    gg: f64,
    fg: f64,
    error2: f64,
    max_error: f64,
}

impl Sums {
    fn add(&mut self, f: f64, g: f64) {
        self.count += 1.0;
        self.f += f;
        self.g += g;
        self.ff += f * f;
        self.gg += g * g;
        self.fg += f * g;
        self.error2 += (f - g) * (f - g);
        self.max_error = self.max_error.max((f - g).abs());
    }

    fn rmse(&self) -> f64 {
        (self.error2 / self.count).sqrt()
    }

    fn metrics(&self, edge_rmse_m: Option<f64>) -> Metrics {
        let (mean_f, mean_g) = (self.f / self.count, self.g / self.count);
        let covariance = self.fg - self.f * mean_g;
        let spreads = (self.ff - self.f * mean_f) * (self.gg - self.g * mean_g);
        Metrics {
            r: ratio(self.fg, (self.ff * self.gg).sqrt()),
            centred_r: ratio(covariance, spreads.max(0.0).sqrt()),
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
    fn a_zero_belief_scores_zero_not_nan() {
        let zero = compare(&[(1.0, 0.0), (2.0, 0.0)]);
        assert_eq!((zero.r, zero.centred_r), (0.0, 0.0));
    }
}
