//! Gaussian numbers out of a stream of bits.

use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// A number from the standard normal distribution (Box & Muller 1958).
pub(crate) fn normal(rng: &mut impl Rng) -> f64 {
    let uniform = 1.0 - rng.random::<f64>();
    (-2.0 * uniform.ln()).sqrt() * (TAU * rng.random::<f64>()).cos()
}
