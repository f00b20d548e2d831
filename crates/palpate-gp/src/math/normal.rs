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

/// Returns the z with Φ(z) = `p`, from −37 to 37: Newton's method on ln Φ, within a bracket.
pub fn quantile(p: f64) -> f64 {
    if p > 0.5 {
        return -quantile(1.0 - p);
    }
    let (mut low, mut high) = (-37.0, 0.0);
    let mut z = -1.0;
    for _ in 0..100 {
        let at = cumulative(z);
        match at > p {
            true => high = z,
            false => low = z,
        }
        let newton = z - (at / p).ln() * at / density(z);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - z).abs() <= 1e-15 * z.abs() {
            break;
        }
        z = next;
    }
    z
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

/// Returns the calibration factor of the 95 % band: the smallest that covers (n + 1)·95 % of the n
/// leave-one-out z-scores `z`, or all of them if that exceeds n, in units of 1.96. It is at least
/// 1, since a few contacts do not show the largest deviations.
pub fn band_factor(z: &[f64]) -> f64 {
    let mut far: Vec<f64> = z.iter().map(|z| z.abs()).collect();
    far.sort_by(f64::total_cmp);
    let held = (0.95 * (far.len() + 1) as f64).ceil() as usize;
    let last = far.get(held.saturating_sub(1)).or(far.last());
    let factor = last.map_or(1.0, |z| z / BAND_95);
    if factor.is_finite() { factor.max(1.0) } else { 1.0 }
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
    fn the_quantile_inverts_the_cumulative_probability() {
        for p in [1e-290, 1e-12, 0.01, 0.025, 0.3, 0.5, 0.8, 0.975, 1.0 - 1e-9] {
            let z = quantile(p);
            let error = if p < 0.5 { cumulative(z) / p - 1.0 } else { cumulative(z) - p };
            assert!(error.abs() < 1e-12 * (1.0 + z * z), "{p}: {error}");
        }
        assert!((quantile(0.975) - BAND_95).abs() < 1e-14);
    }

    #[test]
    fn the_inverse_mills_ratio_is_smooth_where_its_formula_changes() {
        let (above, below) = (inverse_mills(-30.0 + 1e-9), inverse_mills(-30.0 - 1e-9));
        assert!((above - below).abs() < 1e-6, "{above} {below}");
    }
}
