//! The force/torque sensor at the finger's mount: bias, drift, noise and resolution.

use super::effect::Effect;
use crate::config::{Checked, Rules};
use crate::sim::finger::counter::count;
use crate::sim::finger::noise::normal;
use nalgebra::Vector6;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[wrench]`: what a force/torque sensor makes of the load on it, in its own frame: z along
/// the finger, distal. Without it a body has no such sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WrenchEffect {
    /// Standard deviation of each reading: forces along x, y, z.
    pub noise_n: [f64; 3],
    /// The same of torques about x, y, z.
    pub noise_nm: [f64; 3],
    /// Step between values that can be told apart; 0 for none.
    pub resolution_n: [f64; 3],
    /// The same of torques.
    pub resolution_nm: [f64; 3],
    /// Standard deviation of what it reads unloaded at the start of a trial.
    pub bias_n: f64,
    /// The same of torques.
    pub bias_nm: f64,
    /// The bias walks at random by this standard deviation per square root of a second.
    pub drift_n_sqrt_s: [f64; 3],
}

impl Default for WrenchEffect {
    /// ATI Mini45 SI-145-5. Resolution: its data sheet. Noise: standard deviation of single samples
    /// at 2 kHz, measured on one. Drift: the same sensor's Fz went 0.115 N in 4 minutes and 0.172 N
    /// in 10, both 7 mN/√s; Fx and Fy are chosen as much smaller as their noise is. Bias is chosen:
    /// a few per mille of the range.
    fn default() -> Self {
        Self {
            noise_n: [0.0204, 0.0194, 0.0502],
            noise_nm: [0.53e-3, 0.53e-3, 0.50e-3],
            resolution_n: [1.0 / 16.0; 3],
            resolution_nm: [1.0 / 752.0, 1.0 / 752.0, 1.0 / 1504.0],
            bias_n: 0.5,
            bias_nm: 0.02,
            drift_n_sqrt_s: [2.8e-3, 2.8e-3, 7.0e-3],
        }
    }
}

impl WrenchEffect {
    /// Largest standard deviation of a force.
    pub fn noise_max_n(&self) -> f64 {
        self.noise_n.iter().fold(0.0, |most, &noise| noise.max(most))
    }
}

impl Checked for WrenchEffect {
    fn check(&self, rules: &mut Rules) {
        rules.numbers("noise_n", &self.noise_n, 0.0..=100.0);
        rules.numbers("noise_nm", &self.noise_nm, 0.0..=10.0);
        rules.numbers("resolution_n", &self.resolution_n, 0.0..=100.0);
        rules.numbers("resolution_nm", &self.resolution_nm, 0.0..=10.0);
        rules.number("bias_n", self.bias_n, 0.0..=1e3);
        rules.number("bias_nm", self.bias_nm, 0.0..=100.0);
        rules.numbers("drift_n_sqrt_s", &self.drift_n_sqrt_s, 0.0..=10.0);
    }
}

impl Effect for WrenchEffect {
    type State = ();

    fn start(&self) {}
}

/// The sensor during one trial.
#[derive(Clone, Debug)]
pub struct Gauge {
    rng: ChaCha8Rng,
    bias: Vector6<f64>,
}

impl Gauge {
    /// At the start of a trial; `rng` is the only randomness.
    pub fn new(effect: &WrenchEffect, mut rng: ChaCha8Rng) -> Self {
        let bias = Vector6::from_fn(|i, _| {
            normal(&mut rng) * if i < 3 { effect.bias_n } else { effect.bias_nm }
        });
        Self { rng, bias }
    }

    /// What it says `dt_s` after the last reading of a load: forces, then torques.
    pub fn read(&mut self, effect: &WrenchEffect, load: &Vector6<f64>, dt_s: f64) -> Vector6<f64> {
        count("wrench");
        let noise = effect.noise_n.iter().chain(&effect.noise_nm);
        let steps = effect.resolution_n.iter().chain(&effect.resolution_nm);
        let walk = dt_s.max(0.0).sqrt();
        let mut said = *load;
        for (i, (noise, &step)) in noise.zip(steps).enumerate() {
            if let Some(drift) = effect.drift_n_sqrt_s.get(i) {
                self.bias[i] += drift * walk * normal(&mut self.rng);
            }
            let value = load[i] + self.bias[i] + noise * normal(&mut self.rng);
            said[i] = if step > 0.0 { (value / step).round() * step } else { value };
        }
        said
    }
}
