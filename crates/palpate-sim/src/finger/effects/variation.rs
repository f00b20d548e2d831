//! Variation between sensors of one kind, and between sessions of one sensor.

use super::constants::effect;
use super::effect::Effect;
use super::electrodes::{ElectrodesEffect, counts, impedance_ohm};
use super::skin::SkinEffect;
use crate::finger::noise::normal;
use nalgebra::{UnitQuaternion, Vector3};
use palpate_explore::robot::finger::frame::ELECTRODES;
use rand::{Rng, RngExt};

/// Counts of an open electrode: the smallest allowed in a scene.
const OPEN_COUNTS: f64 = 1.0;

effect! {
    /// Table `[variation]`: each trial has another sensor of the same kind. Every number is a
    /// standard deviation about the scene's value (of the logarithm, except for angles) or a
    /// probability.
    VariationEffect in "variation"
    constants {
        /// Spread of each electrode's resistance at rest.
        resistance: f64, 0.0..=1.0;
        /// Spread of the fluid's conductivity, common to all electrodes of a session.
        offset: f64, 0.0..=1.0;
        /// Spread of the electrodes' sensitivity to their gaps, common to all.
        gain: f64, 0.0..=1.0;
        /// Spread of the electrodes' drift rate.
        drift: f64, 0.0..=2.0;
        /// Spread of the fingertip's attitude on its mount, in degrees about each axis.
        attitude_deg: f64, 0.0..=45.0;
        /// Spread of the silicone's stiffness, in `[skin]`.
        stiffness: f64, 0.0..=1.0;
        /// Probability that an electrode of the sensor is open.
        dead: f64, 0.0..=1.0;
        /// Probability that an electrode of the sensor is noisy.
        noisy: f64, 0.0..=1.0;
        /// Noise of a noisy electrode relative to the others.
        noisy_factor: f64, 1.0..=1e3;
    }
}

impl Effect for VariationEffect {
    type State = ();
}

impl VariationEffect {
    /// Draws the sensor of one trial.
    pub fn sensor(&self, mut rng: impl Rng) -> SensorVariation {
        // Every number is drawn, also if its spread is 0, so that the others do not change with it.
        let mut factor = |spread: f64| (spread * normal(&mut rng)).exp();
        let resistance = std::array::from_fn(|_| factor(self.resistance));
        let [conductivity, gain, drift, stiffness] =
            [self.offset, self.gain, self.drift, self.stiffness].map(factor);
        let turn = Vector3::from_fn(|_, _| self.attitude_deg.to_radians() * normal(&mut rng));
        let mut one = |probability: f64| {
            let (drawn, i) = (rng.random::<f64>(), rng.random_range(0..ELECTRODES));
            (drawn < probability).then_some(i)
        };
        SensorVariation {
            resistance,
            conductivity,
            gain,
            drift,
            stiffness,
            attitude: UnitQuaternion::from_scaled_axis(turn),
            dead: one(self.dead),
            noisy: one(self.noisy).map(|i| (i, self.noisy_factor)),
        }
    }
}

/// Sensor constants of one trial, as factors on the scene's values.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorVariation {
    /// Factor on each electrode's resistance at rest.
    pub resistance: [f64; ELECTRODES],
    /// Factor on the fluid's conductivity.
    pub conductivity: f64,
    /// Factor on the exponent of the gap.
    pub gain: f64,
    /// Factor on the drift rate.
    pub drift: f64,
    /// Factor on the silicone's stiffness.
    pub stiffness: f64,
    /// Attitude of the fingertip relative to its mount.
    pub attitude: UnitQuaternion<f64>,
    /// Index of an open electrode.
    pub dead: Option<usize>,
    /// Index of a noisy electrode, with its noise factor.
    pub noisy: Option<(usize, f64)>,
}

impl SensorVariation {
    /// Returns the sensor's skin, if the scene has `nominal`; the core's stiffness is unchanged.
    pub fn skin(&self, nominal: &SkinEffect) -> SkinEffect {
        SkinEffect {
            modulus_pa: self.stiffness * nominal.modulus_pa,
            flatten_pa_m: self.stiffness * nominal.flatten_pa_m,
            inflate_pa_m: self.stiffness * nominal.inflate_pa_m,
            ..nominal.clone()
        }
    }

    /// Returns the sensor's electrodes, if the scene has `nominal`.
    pub fn electrodes(&self, nominal: &ElectrodesEffect) -> ElectrodesEffect {
        let baseline = |i: usize| match self.dead {
            Some(dead) if dead == i => OPEN_COUNTS,
            _ => {
                let factor = self.resistance[i] / self.conductivity;
                counts(impedance_ohm(nominal.baseline_counts[i]) * factor)
            }
        };
        ElectrodesEffect {
            baseline_counts: std::array::from_fn(baseline),
            exponent: nominal.exponent * self.gain,
            drift_counts: nominal.drift_counts * self.drift,
            ..nominal.clone()
        }
    }
}
