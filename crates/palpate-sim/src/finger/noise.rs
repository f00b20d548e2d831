//! Gaussian random numbers, and noisy counts.

use palpate_explore::robot::finger::frame::FULL_SCALE_COUNTS;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Draws a number from the standard normal distribution (Marsaglia & Tsang 2000, by `rand_distr`).
pub(crate) fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Returns the converter's output for ideal counts with white noise of the given standard
/// deviation: a whole number from 0 to 4095 if it quantises.
pub(super) fn converted(
    mut counts: f64,
    noise_counts: f64,
    quantise: bool,
    rng: &mut impl Rng,
) -> f64 {
    if noise_counts > 0.0 {
        counts += noise_counts * normal(rng);
    }
    if quantise { counts.round().clamp(0.0, FULL_SCALE_COUNTS) } else { counts }
}
