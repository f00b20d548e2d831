//! How one sensor differs from the next, and today's session from yesterday's.

use super::constants::effect;
use super::effect::Effect;
use super::electrodes::{ElectrodesEffect, counts, impedance_ohm};
use super::skin::SkinEffect;
use crate::sim::finger::noise::normal;
use nalgebra::{UnitQuaternion, Vector3};
use palpate_explore::robot::finger::frame::ELECTRODES;
use rand::{Rng, RngExt};

/// What an open electrode reads: as little as a scene may say.
const OPEN_COUNTS: f64 = 1.0;

effect! {
    /// Table `[variation]`: another sensor of the kind in each trial. Every number is a standard
    /// deviation about what the scene says, of a logarithm unless it is of an angle; or a
    /// probability.
    VariationEffect in "variation"
    constants {
        /// Of each electrode's resistance at rest.
        resistance: f64, 0.0..=1.0;
        /// Of the fluid's conductivity, common to all electrodes of a session.
        offset: f64, 0.0..=1.0;
        /// Of what the electrodes make of their gaps, common to all.
        gain: f64, 0.0..=1.0;
        /// Of the rate at which the electrodes drift.
        drift: f64, 0.0..=2.0;
        /// Of the fingertip on its mount, in degrees about each axis.
        attitude_deg: f64, 0.0..=45.0;
        /// Of the silicone's stiffness, in `[skin]`.
        stiffness: f64, 0.0..=1.0;
        /// Probability that an electrode of the sensor is open.
        dead: f64, 0.0..=1.0;
        /// Probability that one is noisy.
        noisy: f64, 0.0..=1.0;
        /// How many times as noisy that is.
        noisy_factor: f64, 1.0..=1e3;
    }
}

impl Effect for VariationEffect {
    type State = ();
}

impl VariationEffect {
    /// The sensor of one trial.
    pub fn sensor(&self, mut rng: impl Rng) -> Sensor {
        // Every number is drawn, also where its spread is nothing: one leaves the others alone.
        let mut factor = |spread: f64| (spread * normal(&mut rng)).exp();
        let resistance = std::array::from_fn(|_| factor(self.resistance));
        let [conductivity, gain, drift, stiffness] =
            [self.offset, self.gain, self.drift, self.stiffness].map(factor);
        let turn = Vector3::from_fn(|_, _| self.attitude_deg.to_radians() * normal(&mut rng));
        let mut one = |probability: f64| {
            let (drawn, i) = (rng.random::<f64>(), rng.random_range(0..ELECTRODES));
            (drawn < probability).then_some(i)
        };
        Sensor {
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

/// How a sensor differs from what the scene says, as factors.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// On each electrode's resistance at rest.
    pub resistance: [f64; ELECTRODES],
    /// On the fluid's conductivity.
    pub conductivity: f64,
    /// On the power of the gap.
    pub gain: f64,
    /// On the rate of drift.
    pub drift: f64,
    /// On the silicone's stiffness.
    pub stiffness: f64,
    /// The fingertip's own attitude in that of its mount.
    pub attitude: UnitQuaternion<f64>,
    /// An open electrode.
    pub dead: Option<usize>,
    /// A noisy one, with its factor.
    pub noisy: Option<(usize, f64)>,
}

impl Sensor {
    /// Its skin where the scene has `nominal`: the core is as stiff as there.
    pub fn skin(&self, nominal: &SkinEffect) -> SkinEffect {
        SkinEffect {
            modulus_pa: self.stiffness * nominal.modulus_pa,
            flatten_pa_m: self.stiffness * nominal.flatten_pa_m,
            inflate_pa_m: self.stiffness * nominal.inflate_pa_m,
            ..nominal.clone()
        }
    }

    /// The same of its electrodes.
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
