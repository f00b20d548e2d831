//! The squared exponential exp(−r²/2), Eq. 2 of Yi et al. 2016: infinitely smooth surfaces.

use super::radial::Radial;
use crate::math::simd::exp_of_negative;

/// exp(−r²/2).
#[derive(Clone, Copy, Debug)]
pub struct SquaredExponential;

impl Radial for SquaredExponential {
    #[inline(always)]
    fn correlation_slope(r2: f64) -> (f64, f64) {
        let correlation = exp_of_negative(-0.5 * r2);
        (correlation, -0.5 * correlation)
    }

    const HAS_SLOPES: bool = true;

    #[inline(always)]
    fn curvatures(r2: f64) -> (f64, f64) {
        let correlation = exp_of_negative(-0.5 * r2);
        (0.25 * correlation, -0.125 * correlation)
    }
}
