//! Pressure sensor of the fluid: PDC (static) and PAC (vibration).

use super::constants::effect;
use super::effect::{Effect, EffectSwitch};
use crate::finger::noise::converted;
use palpate_explore::robot::finger::frame::FULL_SCALE_COUNTS;
use palpate_input::config::Rules;
use rand::Rng;
use std::f64::consts::TAU;

/// Pressure per count of PDC (SynTouch BioTac SP manual).
pub const PDC_PA: f64 = 36.5;

/// Pressure per count of PAC (SynTouch BioTac SP manual).
const PAC_PA: f64 = 0.37;

effect! {
    /// Table `[fluid]`: the liquid under the skin and the sensor of its pressure.
    FluidEffect in "fluid"
    settings checked by check_vibration {
        /// Vibration channel PAC; without it the sensor does not send PAC.
        #[serde(skip_serializing_if = "Option::is_none")]
        vibration: Option<VibrationEffect> = None,
    }
    constants {
        /// Fluid stiffness: pressure per compressed volume, in Pa/m³.
        stiffness_pa_m3: f64, 1e6..=1e20;
        /// PDC at rest.
        baseline_counts: f64, 0.0..=FULL_SCALE_COUNTS;
        /// White noise of PDC; 0 for none.
        noise_counts: f64, 0.0..=1e3;
        /// Rounding of counts to whole numbers from 0 to 4095.
        quantise: bool;
    }
}

fn check_vibration(fluid: &FluidEffect, rules: &mut Rules) {
    if let Some(vibration) = &fluid.vibration {
        rules.table("vibration", vibration);
    }
}

impl Effect for FluidEffect {
    type State = ();

    const FILLS_FRAMES: bool = true;

    fn full_settings() -> Self {
        Self { vibration: Some(VibrationEffect::default()), ..Self::default() }
    }

    /// Returns the switch of the whole effect, and that of its vibration, which also adds the
    /// fluid.
    fn switches() -> Vec<EffectSwitch<Option<Self>>> {
        let is_on = |fluid: &Option<Self>| fluid.as_ref().is_some_and(|f| f.vibration.is_some());
        let set = |fluid: &mut Option<Self>, on| match (fluid, on) {
            (fluid, true) => fluid.get_or_insert_default().vibration = Some(Default::default()),
            (Some(fluid), false) => fluid.vibration = None,
            (None, false) => {}
        };
        vec![EffectSwitch::table(), EffectSwitch::new("vibration", is_on, set)]
    }
}

effect! {
    /// Table `[fluid.vibration]`: the amplified, band-passed pressure at 2.2 kHz.
    VibrationEffect in "fluid.vibration"
    constants {
        /// PAC at rest.
        baseline_counts: f64, 0.0..=FULL_SCALE_COUNTS;
        /// White noise; 0 for none.
        noise_counts: f64, 0.0..=1e3;
        /// High-pass cut-off frequency.
        high_pass_hz: f64, 1e-3..=1e4;
        /// Low-pass cut-off frequency.
        low_pass_hz: f64, 1e-3..=1e5;
    }
}

impl FluidEffect {
    /// Returns PDC at a pressure above rest.
    pub fn pdc_counts(&self, pressure_pa: f64, rng: &mut impl Rng) -> f64 {
        let counts = self.baseline_counts + pressure_pa / PDC_PA;
        converted(counts, self.noise_counts, self.quantise, rng)
    }
}

/// First-order filters of PAC: state of one trial.
#[derive(Clone, Debug, Default)]
pub struct PacFilter {
    smooth_pa: f64,
    slow_pa: f64,
}

impl PacFilter {
    /// Returns PAC `dt_s` after the last sample.
    pub fn pac_counts(
        &mut self,
        fluid: &FluidEffect,
        vibration: &VibrationEffect,
        pressure_pa: f64,
        dt_s: f64,
        rng: &mut impl Rng,
    ) -> f64 {
        let part = |hz: f64| -(-TAU * hz * dt_s).exp_m1();
        self.smooth_pa += part(vibration.low_pass_hz) * (pressure_pa - self.smooth_pa);
        self.slow_pa += part(vibration.high_pass_hz) * (self.smooth_pa - self.slow_pa);
        let counts = vibration.baseline_counts + (self.smooth_pa - self.slow_pa) / PAC_PA;
        converted(counts, vibration.noise_counts, fluid.quantise, rng)
    }
}
