//! Space found free as an upper bound of the surface.
//!
//! Where the belief's mean rises above what the finger has swept, the bound is taken in by assumed
//! density filtering, expectation propagation's first pass (Minka 2001): at that place the normal
//! belief N(μ, σ²) is cut off at the bound b, softened by n, which leaves
//! (Rasmussen & Williams 2006, Eq. 3.58, with z = (b − μ) / √(σ² + n²) and h = φ(z) / Φ(z))
//!
//! * mean μ − σ²·h / √(σ² + n²)
//! * variance σ² − σ⁴·h·(z + h) / (σ² + n²)
//!
//! and the height with the noise that would have brought N(μ, σ²) there is observed. Mean and
//! variance are then those of the cut distribution at that place, and follow from it elsewhere;
//! unless that noise were below n, which it then is: a belief that contradicts the bound by many
//! standard deviations is wrong, and a sharp correction of it would swing elsewhere. Bounds that
//! the mean keeps are left out, though they too would lower it a little; the fit of the
//! hyperparameters does not see the bounds.
//!
//! A bound holds where there is a surface. With the probability p that there is one, and Φ(z) that
//! it then lies below the bound, there is none with the odds (1 − p) : p·Φ(z): beside an edge that
//! the finger came to rest on there is nothing, rather than a surface far below.

use super::presence::Silhouette;
use super::probe::Swept;
use crate::task::Zone;
use palpate_gp::math::normal;
use palpate_gp::means::Means;
use palpate_gp::posterior::Scratch;
use palpate_gp::{Hyperparameters, Observation, Posterior};

/// Places along each side at which the bound is kept; chosen, finer than a fingertip in any zone
/// that takes more than a few touches.
const PER_SIDE: usize = 41;

/// Places at which a belief is cut at most; chosen, a few for every touch that can still violate
/// one.
const CUTS_MAX: usize = 16;

/// Least softness of a bound, as a fraction of the signal's standard deviation; chosen, the largest
/// touch noise that is fitted by default.
const SOFTNESS_MIN: f64 = 1e-2;

/// The probability of a surface at most: beliefs are surer of it than edges allow. Chosen on the
/// suite's objects for choosing: with 1 the error on the worst, a star, grows by 9 %, with 0.75
/// next to no bound is taken in.
const SURE: f64 = 0.92;

/// The lowest bound so far, on a grid over the zone.
#[derive(Clone)]
pub(super) struct Ceiling {
    places: Vec<Vec<f64>>,
    heights_m: Vec<f64>,
}

impl Ceiling {
    /// Nothing is known to be free.
    pub(super) fn new(zone: &Zone) -> Self {
        let places = zone.grid(PER_SIDE);
        Self { heights_m: vec![f64::INFINITY; places.len()], places }
    }

    /// Takes in what one touch swept.
    pub(super) fn lower(&mut self, zone: &Zone, swept: &Swept) {
        let ceilings_m = swept.ceilings_m(zone, self.places.iter().map(Vec::as_slice));
        for (height_m, ceiling_m) in self.heights_m.iter_mut().zip(ceilings_m) {
            *height_m = height_m.min(ceiling_m.unwrap_or(f64::INFINITY));
        }
    }

    /// Cuts the belief where its mean is above the bound by more than its softness, where most
    /// first, at each place once; not where that there is no surface at all is likelier than that
    /// there is one below the bound.
    pub(super) fn cut(&self, belief: &mut Posterior, silhouette: &Silhouette) {
        let &Hyperparameters { noise_sd, signal_sd, .. } = belief.hyperparameters();
        let soft_sd = noise_sd.max(SOFTNESS_MIN * signal_sd);
        let mut scratch = Scratch::default();
        let mut bounds: Vec<Bound> = self.bounds().collect();
        let places = bounds.iter().map(|bound| bound.place);
        let mut means = Means::at(belief, places);
        for _ in 0..CUTS_MAX {
            let excess = means.of(belief).iter().zip(&bounds).map(|(mean, at)| mean - at.height_m);
            let mut above: Vec<(usize, f64)> = (excess.enumerate())
                .filter(|(i, excess)| *excess > soft_sd && !bounds[*i].is_done)
                .collect();
            above.sort_by(|a, b| b.1.total_cmp(&a.1));
            let mut there = |(i, excess): (usize, f64)| {
                let bound = &mut bounds[i];
                let chance = SURE * *bound.chance.get_or_insert_with(|| silhouette.at(bound.place));
                // The mean is above the bound, so the surface is no likelier below it than not.
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
            let Some((height, sd)) = site(height_m + excess, variance, height_m, soft_sd) else {
                continue;
            };
            let cut = Observation { place, height, noise: sd.max(soft_sd) / noise_sd, slope: None };
            if belief.take_in(&cut).is_err() {
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

/// What is known of one place.
struct Bound<'a> {
    place: &'a [f64],
    height_m: f64,
    /// The probability that there is a surface, once it was asked for.
    chance: Option<f64>,
    /// Whether the belief was cut there, or never will be.
    is_done: bool,
}

/// The observation (height, standard deviation) that takes N(μ, σ²) to its part below a bound;
/// none where the belief is too sure to be moved.
fn site(mean: f64, variance: f64, bound: f64, soft_sd: f64) -> Option<(f64, f64)> {
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

    /// The slow twin sums over the cut density.
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
            let (height, site_sd) = site(mean, variance, bound, noise).unwrap();
            let precision = 1.0 / variance + site_sd.powi(-2);
            let ours = (mean / variance + height * site_sd.powi(-2)) / precision;
            assert!((ours - twin_mean).abs() < 1e-6, "{ours} {twin_mean}");
            assert!((1.0 / precision - twin_variance).abs() < 1e-5, "{twin_variance}");
        }
    }
}
