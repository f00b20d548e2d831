//! Force/torque sensor at the finger's mount: bias, drift, noise and resolution.

use super::constants::effect;
use super::effect::{Effect, Requirement};
use crate::finger::noise::normal;
use nalgebra::{Matrix3, Point3, Vector6};
use palpate_explore::backend::Wrench;
use palpate_explore::robot::sensor::WrenchAccuracy;
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
        /// Change of the force bias with the arm's posture: standard deviation per metre of motion
        /// of the tip along each axis.
        posture_n_m: f64, 0.0..=1e3;
        /// Further noise of a tip that moves while it touches, as a multiple of that at rest per
        /// m/s of its speed.
        motion_noise_s_m: f64, 0.0..=1e3;
        /// Largest force reading along x, y, z; 0 for no limit.
        range_n: [f64; 3], 0.0..=1e6;
        /// Largest torque reading about x, y, z; 0 for no limit.
        range_nm: [f64; 3], 0.0..=1e6;
    }
}

impl WrenchEffect {
    /// Returns the largest standard deviation of a force.
    pub fn noise_max_n(&self) -> f64 {
        self.noise_n.iter().fold(0.0, |most, &noise| noise.max(most))
    }

    /// Returns what a sensor that locates contacts may know.
    pub fn accuracy(&self) -> WrenchAccuracy {
        WrenchAccuracy {
            noise_n: self.noise_n,
            noise_nm: self.noise_nm,
            resolution_n: self.resolution_n,
            resolution_nm: self.resolution_nm,
            drift_n_sqrt_s: self.drift_n_sqrt_s,
            posture_n_m: self.posture_n_m,
            range_n: self.range_n,
            range_nm: self.range_nm,
        }
    }
}

impl Effect for WrenchEffect {
    type State = ();

    const REQUIRES: Requirement = Requirement::Load;
}

/// State of the sensor during one trial.
#[derive(Clone, Debug)]
pub struct WrenchSensor {
    rng: ChaCha8Rng,
    bias: Vector6<f64>,
    /// Change of the force bias per metre of motion of the tip from `start_w`.
    posture_n_m: Matrix3<f64>,
    start_w: Option<Point3<f64>>,
    /// Position of the tip at the last reading.
    last_w: Option<Point3<f64>>,
}

impl WrenchSensor {
    /// Creates the sensor at the start of a trial; `rng` is the only randomness.
    pub fn new(effect: &WrenchEffect, mut rng: ChaCha8Rng) -> Self {
        let bias = Vector6::from_fn(|i, _| {
            normal(&mut rng) * if i < 3 { effect.bias_n } else { effect.bias_nm }
        });
        let mut posture_n_m = Matrix3::zeros();
        if effect.posture_n_m > 0.0 {
            posture_n_m = Matrix3::from_fn(|_, _| normal(&mut rng) * effect.posture_n_m);
        }
        Self { rng, bias, posture_n_m, start_w: None, last_w: None }
    }

    /// Returns the reading of a load with the tip at `p_wt`, which may touch the object, `dt_s`
    /// after the last one.
    pub fn read(
        &mut self,
        effect: &WrenchEffect,
        load: &Wrench,
        p_wt: &Point3<f64>,
        is_touching: bool,
        dt_s: f64,
    ) -> Wrench {
        let noise = effect.noise_n.iter().chain(&effect.noise_nm);
        let steps = effect.resolution_n.iter().chain(&effect.resolution_nm);
        let ranges = effect.range_n.iter().chain(&effect.range_nm);
        let turned_n = self.posture_n_m * (p_wt - *self.start_w.get_or_insert(*p_wt));
        let walk = dt_s.max(0.0).sqrt();
        let moved_m = (p_wt - self.last_w.replace(*p_wt).unwrap_or(*p_wt)).norm();
        let speed_m_s = if is_touching && dt_s > 0.0 { moved_m / dt_s } else { 0.0 };
        let louder = 1.0 + effect.motion_noise_s_m * speed_m_s;
        let mut said = *load;
        said.force_n += turned_n;
        let values = said.force_n.iter_mut().chain(said.torque_nm.iter_mut());
        let values = values.zip(noise).zip(steps.zip(ranges));
        for (i, ((value, noise), (&step, &range))) in values.enumerate() {
            if let Some(drift) = effect.drift_n_sqrt_s.get(i) {
                self.bias[i] += drift * walk * normal(&mut self.rng);
            }
            *value = *value + self.bias[i] + noise * louder * normal(&mut self.rng);
            if step > 0.0 {
                *value = (*value / step).round() * step;
            }
            if range > 0.0 {
                *value = value.clamp(-range, range);
            }
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use palpate_gp::math::seed;

    /// The noise of a tip that touches doubles at 70 mm/s and triples at 140 mm/s; otherwise it
    /// does not change.
    #[test]
    fn noise_rises_with_the_speed_of_a_tip_that_touches() {
        let effect = WrenchEffect {
            resolution_n: [0.0; 3],
            bias_n: 0.0,
            drift_n_sqrt_s: [0.0; 3],
            ..WrenchEffect::default()
        };
        let noise_n = |speed_m_s: f64, is_touching: bool| {
            let mut sensor = WrenchSensor::new(&effect, seed::stream(1, 0, "wrench"));
            let load = Wrench { force_n: Vector3::zeros(), torque_nm: Vector3::zeros() };
            let (dt_s, count) = (1e-3, 20_000);
            let squares = (0..count).map(|i| {
                let p_wt = Point3::new(speed_m_s * dt_s * f64::from(i), 0.0, 0.0);
                sensor.read(&effect, &load, &p_wt, is_touching, dt_s).force_n.x.powi(2)
            });
            (squares.sum::<f64>() / f64::from(count)).sqrt()
        };
        let rest_n = noise_n(0.0, true);
        for (speed_m_s, touches, expected) in
            [(0.07, true, 1.98), (0.14, true, 2.96), (0.14, false, 1.0)]
        {
            let found = noise_n(speed_m_s, touches) / rest_n;
            assert!((found - expected).abs() < 0.05, "{speed_m_s} {touches}: {found}");
        }
    }
}
