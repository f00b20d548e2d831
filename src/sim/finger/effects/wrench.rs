//! Force/torque sensor at the finger's mount: bias, drift, noise and resolution.

use super::constants::effect;
use super::effect::Effect;
use crate::sim::finger::noise::normal;
use nalgebra::Vector6;
use palpate_explore::backend::Wrench;
use rand_chacha::ChaCha8Rng;

effect! {
    /// Table `[wrench]`: a force/torque sensor at the mount, with its own frame: z along the
    /// finger, distal. Without it there is no such sensor.
    WrenchEffect in "wrench"
    constants {
        /// Noise (standard deviation) of each force reading along x, y, z.
        noise_n: [f64; 3], 0.0..=100.0;
        /// Noise (standard deviation) of each torque reading about x, y, z.
        noise_nm: [f64; 3], 0.0..=10.0;
        /// Resolution of the forces; 0 for a continuous reading.
        resolution_n: [f64; 3], 0.0..=100.0;
        /// Resolution of the torques; 0 for a continuous reading.
        resolution_nm: [f64; 3], 0.0..=10.0;
        /// Standard deviation of the force reading without load at the start of a trial.
        bias_n: f64, 0.0..=1e3;
        /// Standard deviation of the torque reading without load at the start of a trial.
        bias_nm: f64, 0.0..=100.0;
        /// Random walk of the force bias: standard deviation per square root of a second.
        drift_n_sqrt_s: [f64; 3], 0.0..=10.0;
    }
}

impl WrenchEffect {
    /// Returns the largest standard deviation of a force.
    pub fn noise_max_n(&self) -> f64 {
        self.noise_n.iter().fold(0.0, |most, &noise| noise.max(most))
    }
}

impl Effect for WrenchEffect {
    type State = ();
}

/// State of the sensor during one trial.
#[derive(Clone, Debug)]
pub struct WrenchSensor {
    rng: ChaCha8Rng,
    bias: Vector6<f64>,
}

impl WrenchSensor {
    /// Creates the sensor at the start of a trial; `rng` is the only randomness.
    pub fn new(effect: &WrenchEffect, mut rng: ChaCha8Rng) -> Self {
        let bias = Vector6::from_fn(|i, _| {
            normal(&mut rng) * if i < 3 { effect.bias_n } else { effect.bias_nm }
        });
        Self { rng, bias }
    }

    /// Returns the reading of a load, `dt_s` after the last one.
    pub fn read(&mut self, effect: &WrenchEffect, load: &Wrench, dt_s: f64) -> Wrench {
        let noise = effect.noise_n.iter().chain(&effect.noise_nm);
        let steps = effect.resolution_n.iter().chain(&effect.resolution_nm);
        let walk = dt_s.max(0.0).sqrt();
        let mut said = *load;
        let values = said.force_n.iter_mut().chain(said.torque_nm.iter_mut());
        for (i, ((value, noise), &step)) in values.zip(noise).zip(steps).enumerate() {
            if let Some(drift) = effect.drift_n_sqrt_s.get(i) {
                self.bias[i] += drift * walk * normal(&mut self.rng);
            }
            *value = *value + self.bias[i] + noise * normal(&mut self.rng);
            if step > 0.0 {
                *value = (*value / step).round() * step;
            }
        }
        said
    }
}
