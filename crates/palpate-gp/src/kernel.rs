//! Stationary kernels with one length scale per input (automatic relevance determination): the
//! formula of one correlation, and vectorised loops over many.

use super::observations::NoiseRatio;
use crate::math::simd::{exp_of_negative, widest_fn};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// All kernels by name; add one line per kernel.
pub const KERNELS: &[(&str, &dyn Kernel)] = &[
    ("squared_exponential", &SquaredExponential),
    ("matern_52", &Matern52),
    ("matern_32", &Matern32),
];

/// Returns the kernel called `name`.
pub fn by_name(name: &str) -> Option<&'static dyn Kernel> {
    KERNELS.iter().find(|(known, _)| *known == name).map(|(_, kernel)| *kernel)
}

/// Hyperparameters: k(a, b) = signal_sd² · c(r²(a, b)) + noise_sd² · [a is b].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Hyperparameters {
    /// Standard deviation of the surface around its mean, in the unit of the heights.
    pub signal_sd: f64,
    /// Correlation lengths of the heights, one per input, in the unit of the inputs.
    pub length_scales: Vec<f64>,
    /// Standard deviation of one touch's error, in the unit of the heights.
    pub noise_sd: f64,
    /// Standard deviation of an observed slope's error; 0 without observed slopes.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub slope_noise_sd: f64,
    /// Standard deviation of an error in common, where its size is fitted; `None` where
    /// observations state it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub common_sd: Option<f64>,
    /// Prior mean, to which the belief returns far from all observations.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mean: f64,
}

impl Hyperparameters {
    /// Creates hyperparameters from a noise in units of the signal.
    pub fn new(signal_sd: f64, length_scales: Vec<f64>, noise: NoiseRatio, mean: f64) -> Self {
        Self {
            signal_sd,
            length_scales,
            noise_sd: noise.height * signal_sd,
            slope_noise_sd: noise.slope * signal_sd,
            common_sd: None,
            mean,
        }
    }

    /// Standard deviation of the error of a touch that has none in common with those before: that
    /// of its own, and one in common whose size is fitted.
    pub fn touch_sd(&self) -> f64 {
        self.common_sd.map_or(self.noise_sd, |common_sd| self.noise_sd.hypot(common_sd))
    }

    /// Returns the noise in units of the signal.
    pub fn noise_ratio(&self) -> NoiseRatio {
        let [height, slope] =
            [self.noise_sd, self.slope_noise_sd].map(|noise_sd| noise_sd / self.signal_sd);
        NoiseRatio { height, slope, known: self.common_sd.unwrap_or(1.0) / self.signal_sd }
    }
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Squared exponential exp(−r²/2), Eq. 2 of Yi et al. 2016: infinitely smooth surfaces.
#[derive(Clone, Copy, Debug)]
pub struct SquaredExponential;

impl RadialKernel for SquaredExponential {
    #[inline(always)]
    fn exponent(r2: f64) -> f64 {
        0.5 * r2
    }

    #[inline(always)]
    fn correlation_slope(_: f64, decay: f64) -> (f64, f64) {
        (decay, -0.5 * decay)
    }

    const HAS_SLOPES: bool = true;

    #[inline(always)]
    fn curvatures(_: f64, decay: f64) -> (f64, f64) {
        (0.25 * decay, -0.125 * decay)
    }
}

/// Matérn kernel (1 + s)·exp(−s) with s = √3·r (Rasmussen & Williams 2006, Eq. 4.17): surfaces with
/// one derivative.
#[derive(Clone, Copy, Debug)]
pub struct Matern32;

impl RadialKernel for Matern32 {
    #[inline(always)]
    fn exponent(r2: f64) -> f64 {
        (3.0 * r2).sqrt()
    }

    #[inline(always)]
    fn correlation_slope(s: f64, decay: f64) -> (f64, f64) {
        ((1.0 + s) * decay, -1.5 * decay)
    }
}

/// Matérn kernel (1 + s + s²/3)·exp(−s) with s = √5·r: surfaces with two derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Matern52;

impl RadialKernel for Matern52 {
    #[inline(always)]
    fn exponent(r2: f64) -> f64 {
        (5.0 * r2).sqrt()
    }

    #[inline(always)]
    fn correlation_slope(s: f64, decay: f64) -> (f64, f64) {
        let line = 1.0 + s;
        (s.mul_add(s * (1.0 / 3.0), line) * decay, -5.0 / 6.0 * line * decay)
    }

    const HAS_SLOPES: bool = true;

    #[inline(always)]
    fn curvatures(s: f64, decay: f64) -> (f64, f64) {
        (25.0 / 12.0 * decay, -125.0 / 24.0 * decay / s.max(f64::MIN_POSITIVE.sqrt()))
    }
}

/// A correlation that depends on the scaled squared distance r² = Σ_d ((a_d − b_d) / l_d)² by way
/// of exp(−s) with an exponent s ≥ 0.
///
/// A new kernel is a type with this trait and one line in [`KERNELS`]. Its functions are
/// branch-free and `#[inline(always)]`, so that loops over them are vectorised.
pub trait RadialKernel: Send + Sync {
    /// Exponent s(r²), with s(0) = 0.
    fn exponent(r2: f64) -> f64;

    /// Correlation c, 1 at s = 0, and its derivative dc/d(r²), from s and exp(−s).
    fn correlation_slope(s: f64, decay: f64) -> (f64, f64);

    /// Whether the kernel's surfaces have continuous slopes, so that one slope is informative
    /// about others nearby. If so, it must define [`curvatures`](Self::curvatures).
    const HAS_SLOPES: bool = false;

    /// Returns the second and third derivative of c with respect to r². The third may be any number
    /// at 0, since it is multiplied by r⁴.
    #[inline(always)]
    fn curvatures(_s: f64, _decay: f64) -> (f64, f64) {
        (0.0, 0.0)
    }
}

/// Largest exponent: its decay is 0, and no product with it overflows.
const FARTHEST: f64 = 1e3;

/// A kernel, evaluated for many distances at a time.
pub trait Kernel: Send + Sync {
    /// Replaces each r² by c(r²).
    fn correlate(&self, r2: &mut [f64]);

    /// Replaces each r² by c(r²) and writes dc/d(r²) into `slopes`.
    fn correlate_slope(&self, r2: &mut [f64], slopes: &mut [f64]);

    /// Whether the kernel supports observed slopes; see [`RadialKernel::HAS_SLOPES`].
    fn has_slopes(&self) -> bool;

    /// Replaces each r² by c(r²) and writes its first three derivatives with respect to r².
    fn correlate_derivatives(&self, r2: &mut [f64], derivatives: [&mut [f64]; 3]);
}

/// Returns the exponent at r² and its decay.
#[inline(always)]
fn decay<R: RadialKernel>(r2: f64) -> (f64, f64) {
    let s = R::exponent(r2);
    // A place that is no number is as far as can be.
    let s = if s < FARTHEST { s } else { FARTHEST };
    (s, exp_of_negative(-s))
}

widest_fn! {
    fn correlate<'a, R: RadialKernel>(r2: &'a mut [f64]) -> () {
        for r2 in r2 {
            let (s, decay) = decay::<R>(*r2);
            *r2 = R::correlation_slope(s, decay).0;
        }
    }
}

widest_fn! {
    fn correlate_slope<'a, R: RadialKernel>(r2: &'a mut [f64], slopes: &'a mut [f64]) -> () {
        for (r2, slope) in r2.iter_mut().zip(slopes) {
            let (s, decay) = decay::<R>(*r2);
            (*r2, *slope) = R::correlation_slope(s, decay);
        }
    }
}

widest_fn! {
    /// Implements [`Kernel::correlate_derivatives`].
    fn correlate_derivatives<'a, R: RadialKernel>(
        r2: &'a mut [f64],
        first: &'a mut [f64],
        second: &'a mut [f64],
        third: &'a mut [f64],
    ) -> () {
        let derivatives = first.iter_mut().zip(second).zip(third);
        for (r2, ((first, second), third)) in r2.iter_mut().zip(derivatives) {
            let (s, decay) = decay::<R>(*r2);
            (*r2, *first) = R::correlation_slope(s, decay);
            (*second, *third) = R::curvatures(s, decay);
        }
    }
}

impl<R: RadialKernel> Kernel for R {
    fn correlate(&self, r2: &mut [f64]) {
        correlate::<R>(r2);
    }

    fn correlate_slope(&self, r2: &mut [f64], slopes: &mut [f64]) {
        correlate_slope::<R>(r2, slopes);
    }

    fn has_slopes(&self) -> bool {
        R::HAS_SLOPES
    }

    fn correlate_derivatives(&self, r2: &mut [f64], [first, second, third]: [&mut [f64]; 3]) {
        correlate_derivatives::<R>(r2, first, second, third);
    }
}

impl dyn Kernel {
    /// Prior variance of a slope per length scale, −2·c′(0), in units of the signal's variance.
    pub fn slope_variance(&self) -> f64 {
        let mut slope = [0.0];
        self.correlate_slope(&mut [0.0], &mut slope);
        -2.0 * slope[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kernel_is_one_at_zero_falls_and_has_its_central_difference_as_slope() {
        for (name, kernel) in KERNELS {
            let at = |r2: f64| {
                let (mut value, mut slope) = ([r2], [0.0]);
                kernel.correlate_slope(&mut value, &mut slope);
                let mut alone = [r2];
                kernel.correlate(&mut alone);
                assert_eq!(alone, value, "{name}");
                (value[0], slope[0])
            };
            assert_eq!(at(0.0).0, 1.0, "{name}");
            let mut last = 1.0;
            for i in 1..200 {
                let r2 = 0.05 * f64::from(i);
                let (value, slope) = at(r2);
                assert!(value > 0.0 && value < last, "{name} at {r2}");
                last = value;
                let twin = (at(r2 + 1e-6).0 - at(r2 - 1e-6).0) / 2e-6;
                assert!((slope - twin).abs() < 1e-8, "{name} at {r2}: {slope} {twin}");
            }
            if kernel.has_slopes() {
                let [below, here, above] = [-1e-4, 0.0, 1e-4].map(|by| {
                    let mut value = [0.3 + by];
                    let [mut first, mut second, mut third] = [[0.0]; 3];
                    let derivatives = [&mut first[..], &mut second, &mut third];
                    kernel.correlate_derivatives(&mut value, derivatives);
                    assert_eq!((value[0], first[0]), at(0.3 + by), "{name}");
                    [first[0], second[0], third[0]]
                });
                for order in 0..2 {
                    let twin = (above[order] - below[order]) / 2e-4;
                    assert!((here[order + 1] - twin).abs() < 1e-6, "{name}: {here:?} {twin}");
                }
            }
            assert!(at(1e9).0 < 1e-300 && at(f64::MAX).0 == 0.0, "{name}");
        }
    }
}
