//! Gaussian numbers out of a stream of bits.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// A number from the standard normal distribution (Marsaglia & Tsang 2000, by `rand_distr`).
pub(crate) fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}
