//! Swept free space as an upper bound of the surface.
//!
//! Where the belief's mean exceeds the space swept by the finger, the bound is applied by assumed
//! density filtering, the first pass of expectation propagation (Minka 2001): the normal belief
//! N(μ, σ²) at that place is truncated at the bound b, softened by n, which gives (Rasmussen &
//! Williams 2006, Eq. 3.58, with z = (b − μ) / √(σ² + n²) and h = φ(z) / Φ(z))
//!
//! * mean μ − σ²·h / √(σ² + n²)
//! * variance σ² − σ⁴·h·(z + h) / (σ² + n²)
//!
//! A pseudo-observation of a height with noise is added that moves N(μ, σ²) to these moments. Mean
//! and variance then match the truncated distribution at that place, and follow from it elsewhere.
//! The noise of the pseudo-observation is at least n: a belief that contradicts the bound by many
//! standard deviations is wrong, and a sharp correction of it would oscillate elsewhere. Bounds
//! that the mean satisfies are omitted, though they too would lower it a little; the fit of the
//! hyperparameters ignores the bounds.
//!
//! A bound holds only where a surface is present. With the probability p of a surface, and Φ(z)
//! that it then lies below the bound, the odds of no surface are (1 − p) : p·Φ(z): beside an edge
//! on which the finger came to rest there is no surface, rather than one far below.

use super::evidence::FreeVolume;
use super::surface_evidence::Silhouette;
use crate::task::Zone;
use palpate_gp::math::normal;
use palpate_gp::means::FixedPlaceMeans;
use palpate_gp::posterior::Scratch;
use palpate_gp::{Hyperparameters, Observation, Posterior};
use serde::{Deserialize, Deserializer, Serialize};

/// Grid points per side at which the bound is stored; a heuristic: finer than a fingertip in any
/// zone that takes more than a few touches.
const PER_SIDE: usize = 41;

/// Largest number of places at which a
/// belief is truncated; a heuristic: a few for every touch whose bound can still be violated.
const CUTS_MAX: usize = 16;

/// Smallest softness of a bound, as a fraction of the signal's standard deviation; a heuristic: the
/// largest touch noise that is fitted by default.
const SOFTNESS_MIN: f64 = 1e-2;

/// Upper limit of the probability of a surface, since beliefs are overconfident at edges.
/// Heuristic, tuned on the suite's tuning objects: with 1 the error on the worst, a star, grows by
/// 9 %; with 0.75 almost no bound is applied.
const SURE: f64 = 0.92;

/// The lowest upper bound so far, on a grid over the zone.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct FreeSpaceBound {
    places: Vec<Vec<f64>>,
    #[serde(deserialize_with = "infinite_if_null")]
    heights_m: Vec<f64>,
}

/// Reads numbers from JSON, which has null in place of infinity.
fn infinite_if_null<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let values: Vec<Option<f64>> = Deserialize::deserialize(from)?;
    Ok(values.into_iter().map(|value| value.unwrap_or(f64::INFINITY)).collect())
}

impl FreeSpaceBound {
    /// Creates a bound without any free space.
    pub(super) fn new(zone: &Zone) -> Self {
        let places = zone.grid(PER_SIDE);
        Self { heights_m: vec![f64::INFINITY; places.len()], places }
    }

    /// Lowers the bound to the volume swept by one touch.
    pub(super) fn lower(&mut self, zone: &Zone, swept: &FreeVolume) {
        let ceilings_m = swept.upper_bounds_m(zone, self.places.iter().map(Vec::as_slice));
        for (height_m, ceiling_m) in self.heights_m.iter_mut().zip(ceilings_m) {
            *height_m = height_m.min(ceiling_m.unwrap_or(f64::INFINITY));
        }
    }

    /// Truncates the belief where its mean exceeds the bound by more than its softness, largest
    /// violation first, once per place. Places are skipped where the absence of a surface is more
    /// likely than a surface below the bound.
    pub(super) fn truncate(&self, belief: &mut Posterior, silhouette: &Silhouette) {
        let &Hyperparameters { noise_sd, signal_sd, .. } = belief.hyperparameters();
        let soft_sd = noise_sd.max(SOFTNESS_MIN * signal_sd);
        let mut scratch = Scratch::default();
        let mut bounds: Vec<Bound> = self.bounds().collect();
        let places = bounds.iter().map(|bound| bound.place);
        let mut means = FixedPlaceMeans::at(belief, places);
        for _ in 0..CUTS_MAX {
            let excess =
                means.update(belief).iter().zip(&bounds).map(|(mean, at)| mean - at.height_m);
            let mut above: Vec<(usize, f64)> = (excess.enumerate())
                .filter(|(i, excess)| *excess > soft_sd && !bounds[*i].is_done)
                .collect();
            above.sort_by(|a, b| b.1.total_cmp(&a.1));
            let mut there = |(i, excess): (usize, f64)| {
                let bound = &mut bounds[i];
                let chance =
                    SURE * *bound.chance.get_or_insert_with(|| silhouette.probability(bound.place));
                // The mean is above the bound, so the probability of a surface below it is at most
                // one half.
                if 0.5 * chance < 1.0 - chance {
                    bound.is_done = true;
                    return None;
                }
                let variance = belief.variance(bound.place, &mut scratch);
                let spread = (variance + soft_sd * soft_sd).sqrt();
                let is_there = chance * normal::cumulative(-excess / spread) >= 1.0 - chance;
                is_there.then_some((i, excess, variance))
            };
            let Some((worst, excess, variance)) = above.into_iter().find_map(&mut there) else {
                return;
            };
            bounds[worst].is_done = true;
            let Bound { place, height_m, .. } = bounds[worst];
            let Some((height, sd)) =
                pseudo_observation(height_m + excess, variance, height_m, soft_sd)
            else {
                continue;
            };
            let cut = Observation {
                place,
                height,
                noise: sd.max(soft_sd) / noise_sd,
                slope: None,
                known: None,
            };
            if belief.push(&cut).is_err() {
                return;
            }
        }
    }

    fn bounds(&self) -> impl Iterator<Item = Bound<'_>> {
        let all = self.places.iter().zip(self.heights_m.iter().copied());
        let known = all.filter(|(_, height_m)| height_m.is_finite());
        known.map(|(place, height_m)| Bound { place, height_m, chance: None, is_done: false })
    }
}

/// State of the bound at one place.
struct Bound<'a> {
    place: &'a [f64],
    height_m: f64,
    /// Probability of a surface, after the first evaluation.
    chance: Option<f64>,
    /// Whether the belief was truncated there, or never will be.
    is_done: bool,
}

/// Returns the pseudo-observation (height, standard deviation) that moves N(μ, σ²) to its moments
/// below a bound; `None` where the variance is too small to change.
fn pseudo_observation(mean: f64, variance: f64, bound: f64, soft_sd: f64) -> Option<(f64, f64)> {
    let spread = (variance + soft_sd * soft_sd).sqrt();
    let z = (bound - mean) / spread;
    let h = normal::inverse_mills(z);
    let share = variance / (spread * spread);
    let cut_mean = mean - variance * h / spread;
    let cut_variance = variance * (1.0 - share * h * (z + h));
    let precision = 1.0 / cut_variance - 1.0 / variance;
    let height = (cut_mean / cut_variance - mean / variance) / precision;
    let sd = precision.sqrt().recip();
    (height.is_finite() && sd.is_finite()).then_some((height, sd))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with a reference that integrates the truncated density.
    #[test]
    fn the_site_takes_a_normal_to_the_moments_of_its_cut() {
        for (mean, variance, bound, noise) in
            [(1.0, 0.25, 0.4, 0.1), (0.0, 1.0, -3.0, 0.2), (2.0, 0.01, 1.9, 1e-3)]
        {
            let sd = f64::sqrt(variance);
            let mut sums = [0.0; 3];
            for i in 0..400_000 {
                let x = mean + sd * (-10.0 + f64::from(i) * 5e-5);
                let weight =
                    normal::density((x - mean) / sd) * normal::cumulative((bound - x) / noise);
                [1.0, x, x * x].iter().zip(&mut sums).for_each(|(f, sum)| *sum += f * weight);
            }
            let twin_mean = sums[1] / sums[0];
            let twin_variance = sums[2] / sums[0] - twin_mean * twin_mean;
            let (height, site_sd) = pseudo_observation(mean, variance, bound, noise).unwrap();
            let precision = 1.0 / variance + site_sd.powi(-2);
            let ours = (mean / variance + height * site_sd.powi(-2)) / precision;
            assert!((ours - twin_mean).abs() < 1e-6, "{ours} {twin_mean}");
            assert!((1.0 / precision - twin_variance).abs() < 1e-5, "{twin_variance}");
        }
    }
}
