//! Matérn kernels (Rasmussen & Williams 2006, Eq. 4.17): surfaces with one or two derivatives.

use super::radial::Radial;
use crate::math::simd::exp_of_negative;

/// (1 + √3·r)·exp(−√3·r): one derivative.
#[derive(Clone, Copy, Debug)]
pub struct Matern32;

impl Radial for Matern32 {
    #[inline(always)]
    fn correlation_slope(r2: f64) -> (f64, f64) {
        let s = (3.0 * r2).sqrt();
        let decay = exp_of_negative(-s);
        (bounded((1.0 + s) * decay), -1.5 * decay)
    }
}

/// (1 + √5·r + 5r²/3)·exp(−√5·r): two derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Matern52;

impl Radial for Matern52 {
    #[inline(always)]
    fn correlation_slope(r2: f64) -> (f64, f64) {
        let s = (5.0 * r2).sqrt();
        let decay = exp_of_negative(-s);
        let correlation = bounded((1.0 + s + s * s / 3.0) * decay);
        (correlation, bounded(-5.0 / 6.0 * (1.0 + s) * decay))
    }

    const HAS_SLOPES: bool = true;

    #[inline(always)]
    fn curvatures(r2: f64) -> (f64, f64) {
        let s = (5.0 * r2).sqrt();
        let decay = exp_of_negative(-s);
        (25.0 / 12.0 * decay, -125.0 / 24.0 * decay / s.max(f64::MIN_POSITIVE.sqrt()))
    }
}

/// 0 where ∞·0 gave NaN: at distances whose square overflows.
#[inline(always)]
fn bounded(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value }
}
