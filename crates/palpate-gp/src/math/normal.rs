//! The standard normal distribution.

use std::f64::consts::{PI, SQRT_2};

/// Standard deviations that contain 95 % of a normal distribution.
pub const BAND_95: f64 = 1.959_963_984_540_054;

/// Returns the density φ(z).
pub fn density(z: f64) -> f64 {
    (-0.5 * z * z).exp() / (2.0 * PI).sqrt()
}

/// Returns the cumulative probability Φ(z).
pub fn cumulative(z: f64) -> f64 {
    0.5 * libm::erfc(-z / SQRT_2)
}

/// Returns φ(z) / Φ(z). For z below −30, where Φ approaches the smallest numbers, it uses the first
/// terms of the series −z − 1/z + 2/z³; both agree to 1e-6 there.
pub fn inverse_mills(z: f64) -> f64 {
    if z > -30.0 {
        return density(z) / cumulative(z);
    }
    let u = 1.0 / z;
    -z - u + 2.0 * u * u * u
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert!((cumulative(BAND_95) - 0.975).abs() < 1e-15);
        assert!((cumulative(-5.0) - 2.866_515_718_791_939e-7).abs() < 1e-20);
        assert!((density(1.0) - 0.241_970_724_519_143_37).abs() < 1e-16);
    }

    #[test]
    fn the_inverse_mills_ratio_is_smooth_where_its_formula_changes() {
        let (above, below) = (inverse_mills(-30.0 + 1e-9), inverse_mills(-30.0 - 1e-9));
        assert!((above - below).abs() < 1e-6, "{above} {below}");
    }
}
