//! Stationary kernels with one length scale per input (automatic relevance determination).

mod matern;
mod radial;
mod squared_exponential;

pub use matern::{Matern32, Matern52};
pub use radial::{Kernel, Radial};
pub use squared_exponential::SquaredExponential;

use super::observations::NoiseRatio;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Every kernel by name; one line adds one.
pub const KERNELS: &[(&str, &dyn Kernel)] = &[
    ("squared_exponential", &SquaredExponential),
    ("matern_52", &Matern52),
    ("matern_32", &Matern32),
];

/// The kernel called `name`.
pub fn by_name(name: &str) -> Option<&'static dyn Kernel> {
    KERNELS.iter().find(|(known, _)| *known == name).map(|(_, kernel)| *kernel)
}

/// What a fit chooses: k(a, b) = signal_sd² · c(r²(a, b)) + noise_sd² · [a is b].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Hyperparameters {
    /// Standard deviation of the surface around its mean, in the unit of the heights.
    pub signal_sd: f64,
    /// Distance over which heights stay alike, one per input, in the unit of the inputs.
    pub length_scales: Vec<f64>,
    /// Standard deviation of one touch's error, in the unit of the heights.
    pub noise_sd: f64,
    /// Standard deviation of an observed slope's error; 0 where no slopes are observed.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub slope_noise_sd: f64,
    /// Height that the belief returns to away from all observations.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mean: f64,
}

impl Hyperparameters {
    /// From the noise in units of the signal.
    pub fn new(signal_sd: f64, length_scales: Vec<f64>, noise: NoiseRatio, mean: f64) -> Self {
        Self {
            signal_sd,
            length_scales,
            noise_sd: noise.height * signal_sd,
            slope_noise_sd: noise.slope * signal_sd,
            mean,
        }
    }

    /// The noise in units of the signal.
    pub fn noise_ratio(&self) -> NoiseRatio {
        let [height, slope] =
            [self.noise_sd, self.slope_noise_sd].map(|noise_sd| noise_sd / self.signal_sd);
        NoiseRatio { height, slope }
    }
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
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
