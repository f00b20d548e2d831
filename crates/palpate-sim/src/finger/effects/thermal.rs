//! Thermistor in a heated finger: TDC (temperature) and TAC (its change).

use super::constants::effect;
use super::effect::{Effect, LoadHook};
use crate::finger::noise::converted;
use palpate_explore::robot::finger::frame::FULL_SCALE_COUNTS;
use rand::Rng;
use std::f64::consts::TAU;

/// Resolution of TAC: K/s per count (SynTouch BioTac SP manual).
const TAC_C_S: f64 = 1e-3;

/// Lower end of TAC's band (SynTouch BioTac SP manual); slower changes pass unfiltered.
const TAC_HZ: f64 = 0.45;

effect! {
    /// Table `[thermal]`: a warm finger that a cold object cools.
    ThermalEffect in "thermal"
    constants {
        /// Temperature of the fluid at the start of a trial.
        start_c: f64, -50.0..=150.0;
        /// Temperature of the fluid in equilibrium with the finger's own heating.
        finger_c: f64, -50.0..=150.0;
        /// Temperature of the object.
        object_c: f64, -50.0..=150.0;
        /// Time constant of the fluid.
        time_constant_s: f64, 1e-3..=1e6;
        /// Contact area at which the fluid's equilibrium is half-way to the object's temperature.
        half_area_m2: f64, 1e-9..=1.0;
        /// Relative increase of the fluid's conductivity per kelvin; electrodes drift with it.
        conductivity_per_k: f64, -0.01..=0.1;
        /// TAC at a constant temperature.
        tac_baseline_counts: f64, 0.0..=FULL_SCALE_COUNTS;
        /// White noise of TDC; 0 for none.
        tdc_noise_counts: f64, 0.0..=1e3;
        /// White noise of TAC; 0 for none.
        tac_noise_counts: f64, 0.0..=1e3;
        /// Rounding of counts to whole numbers from 0 to 4095.
        quantise: bool;
    }
}

impl Effect for ThermalEffect {
    type State = ThermalState;

    const FILLS_FRAMES: bool = true;

    /// Leaves the load unchanged; its area cools the fluid.
    const ON_LOAD: Option<LoadHook<Self>> =
        Some(|effect, heat, _, dt_s, load| heat.step(effect, load.area_m2, dt_s));

    fn start(&self) -> ThermalState {
        let start_c = self.start_c;
        ThermalState { start_c, temperature_c: start_c, slow_c: start_c }
    }
}

impl ThermalEffect {
    /// Returns TDC at a temperature: the inverse of the SynTouch BioTac SP manual's T = 4025 /
    /// ln((155183 − 46555 r) / r) − 273.15, r = TDC / 4095.
    pub fn tdc_counts(&self, temperature_c: f64, rng: &mut impl Rng) -> f64 {
        let ratio = 155_183.0 / ((4025.0 / (temperature_c + 273.15)).exp() + 46_555.0);
        converted(FULL_SCALE_COUNTS * ratio, self.tdc_noise_counts, self.quantise, rng)
    }

    /// Returns TAC at a rate of warming: cooling raises it.
    pub fn tac_counts(&self, warming_c_s: f64, rng: &mut impl Rng) -> f64 {
        let counts = self.tac_baseline_counts - warming_c_s / TAC_C_S;
        converted(counts, self.tac_noise_counts, self.quantise, rng)
    }
}

/// Heat of the fluid: state of one trial.
#[derive(Clone, Debug, Default)]
pub struct ThermalState {
    start_c: f64,
    /// Temperature of the fluid.
    pub temperature_c: f64,
    slow_c: f64,
}

impl ThermalState {
    /// Advances by `dt_s` with this contact area: exact for a constant area.
    pub fn step(&mut self, effect: &ThermalEffect, area_m2: f64, dt_s: f64) {
        let cooled = area_m2 / (area_m2 + effect.half_area_m2);
        let end_c = effect.finger_c + cooled * (effect.object_c - effect.finger_c);
        self.temperature_c -=
            (-dt_s / effect.time_constant_s).exp_m1() * (end_c - self.temperature_c);
        self.slow_c -= (-dt_s * TAU * TAC_HZ).exp_m1() * (self.temperature_c - self.slow_c);
    }

    /// Returns the rate of warming within TAC's band.
    pub fn temperature_rate_c_s(&self) -> f64 {
        (self.temperature_c - self.slow_c) * TAU * TAC_HZ
    }

    /// Returns the fluid's conductivity, relative to the start.
    pub fn conductivity(&self, effect: &ThermalEffect) -> f64 {
        (1.0 + effect.conductivity_per_k * (self.temperature_c - self.start_c)).max(0.01)
    }
}
