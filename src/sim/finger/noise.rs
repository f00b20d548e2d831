//! Gaussian numbers out of a stream of bits, and counts with them.

use palpate_explore::robot::finger::frame::FULL_SCALE_COUNTS;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// A number from the standard normal distribution (Marsaglia & Tsang 2000, by `rand_distr`).
pub(crate) fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// What a converter sends of ideal counts with white noise of this standard deviation: a whole
/// number from 0 to 4095 if it quantises.
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
