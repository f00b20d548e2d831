//! How one sensor differs from the next, and today's session from yesterday's.

use super::effect::Effect;
use super::electrodes::{ElectrodesEffect, counts, impedance_ohm};
use super::skin::SkinEffect;
use crate::config::{Checked, Rules};
use crate::robot::finger::frame::ELECTRODES;
use crate::sim::finger::noise::normal;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{Rng, RngExt};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What an open electrode reads: as little as a scene may say.
const OPEN_COUNTS: f64 = 1.0;

/// Table `[variation]`: another sensor of the kind in each trial. Every number is a standard
/// deviation about what the scene says, of a logarithm unless it is of an angle; or a probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VariationEffect {
    /// Of each electrode's resistance at rest.
    pub resistance: f64,
    /// Of the fluid's conductivity, common to all electrodes of a session.
    pub offset: f64,
    /// Of what the electrodes make of their gaps, common to all.
    pub gain: f64,
    /// Of the rate at which the electrodes drift.
    pub drift: f64,
    /// Of the fingertip on its mount, in degrees about each axis.
    pub attitude_deg: f64,
    /// Of the silicone's stiffness, in `[skin]`.
    pub stiffness: f64,
    /// Probability that an electrode of the sensor is open.
    pub dead: f64,
    /// Probability that one is noisy.
    pub noisy: f64,
    /// How many times as noisy that is.
    pub noisy_factor: f64,
}

impl Default for VariationEffect {
    /// From MiaoLi/syntouchcontact's recordings of three sensors. Resistance: their medians
    /// without contact. Offset: two untouched sensors (0.07, 0.15) and two pressed ones in sessions
    /// after those. Gain: F1 against F2 as `palpate calibrate` has them. Drift: walks of 3, 4 and 9
    /// counts per root second about the first. Attitude: F1 against F2 on the plate, where the
    /// hand's is in it too. Stiffness: chosen, about two points of Shore hardness. Electrodes:
    /// chosen; one of the three sensors drops out at times.
    fn default() -> Self {
        Self {
            resistance: 0.06,
            offset: 0.12,
            gain: 0.1,
            drift: 0.6,
            attitude_deg: 2.0,
            stiffness: 0.1,
            dead: 0.1,
            noisy: 0.1,
            noisy_factor: 10.0,
        }
    }
}

impl Checked for VariationEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("resistance", self.resistance, 0.0..=1.0);
        rules.number("offset", self.offset, 0.0..=1.0);
        rules.number("gain", self.gain, 0.0..=1.0);
        rules.number("drift", self.drift, 0.0..=2.0);
        rules.number("attitude_deg", self.attitude_deg, 0.0..=45.0);
        rules.number("stiffness", self.stiffness, 0.0..=1.0);
        rules.number("dead", self.dead, 0.0..=1.0);
        rules.number("noisy", self.noisy, 0.0..=1.0);
        rules.number("noisy_factor", self.noisy_factor, 1.0..=1e3);
    }
}

impl Effect for VariationEffect {
    type State = ();

    fn start(&self) {}
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
    /// Its skin where the scene has `nominal`.
    pub fn skin(&self, nominal: &SkinEffect) -> SkinEffect {
        nominal.stiffened(self.stiffness)
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
