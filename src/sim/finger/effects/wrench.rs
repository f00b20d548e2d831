//! The force/torque sensor at the finger's mount: bias, drift, noise and resolution.

use super::constants::effect;
use super::effect::Effect;
use crate::sim::finger::noise::normal;
use nalgebra::Vector6;
use palpate_explore::backend::Wrench;
use rand_chacha::ChaCha8Rng;

effect! {
    /// Table `[wrench]`: what a force/torque sensor makes of the load on it, in its own frame: z
    /// along the finger, distal. Without it a body has no such sensor.
    WrenchEffect in "wrench"
    constants {
        /// Standard deviation of each reading: forces along x, y, z.
        noise_n: [f64; 3], 0.0..=100.0;
        /// The same of torques about x, y, z.
        noise_nm: [f64; 3], 0.0..=10.0;
        /// Step between values that can be told apart; 0 for none.
        resolution_n: [f64; 3], 0.0..=100.0;
        /// The same of torques.
        resolution_nm: [f64; 3], 0.0..=10.0;
        /// Standard deviation of what it reads unloaded at the start of a trial.
        bias_n: f64, 0.0..=1e3;
        /// The same of torques.
        bias_nm: f64, 0.0..=100.0;
        /// The bias walks at random by this standard deviation per square root of a second.
        drift_n_sqrt_s: [f64; 3], 0.0..=10.0;
    }
}

impl WrenchEffect {
    /// Largest standard deviation of a force.
    pub fn noise_max_n(&self) -> f64 {
        self.noise_n.iter().fold(0.0, |most, &noise| noise.max(most))
    }
}

impl Effect for WrenchEffect {
    type State = ();
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

    /// What it says `dt_s` after the last reading of a load.
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
