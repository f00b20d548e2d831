//! What the pressure sensor makes of the fluid: PDC (static) and PAC (vibration).

use super::effect::Effect;
use super::switch::Switch;
use crate::config::{Checked, Rules};
use crate::robot::finger::frame::FULL_SCALE_COUNTS;
use crate::sim::finger::noise::normal;
use rand::Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Pressure per count of PDC (SynTouch BioTac SP manual).
const PDC_PA: f64 = 36.5;

/// Pressure per count of PAC (same).
const PAC_PA: f64 = 0.37;

/// Table `[fluid]`: the liquid under the skin and the sensor of its pressure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FluidEffect {
    /// Pressure per volume the fluid is compressed by, in Pa/m³.
    pub stiffness_pa_m3: f64,
    /// PDC at rest.
    pub baseline_counts: f64,
    /// White noise of PDC; 0 is none.
    pub noise_counts: f64,
    /// Whether counts are whole numbers from 0 to 4095.
    pub quantise: bool,
    /// PAC; without it the sensor does not send it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vibration: Option<VibrationEffect>,
}

impl Default for FluidEffect {
    /// Stiffness: chosen, 10 kPa compress hoses and bubbles by 1 mm³, little beside the 100 mm³
    /// that 2 N displace. Baseline: chosen amid 1326 to 2695 (recordings of
    /// RuihanGao/BioTacSP_setup and I-Quotient-Robotics/syntouch_btd_decode), noise from the same:
    /// up to half a count.
    fn default() -> Self {
        Self {
            stiffness_pa_m3: 1e13,
            baseline_counts: 2000.0,
            noise_counts: 0.5,
            quantise: true,
            vibration: None,
        }
    }
}

impl Checked for FluidEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("stiffness_pa_m3", self.stiffness_pa_m3, 1e6..=1e20);
        rules.number("baseline_counts", self.baseline_counts, 0.0..=FULL_SCALE_COUNTS);
        rules.number("noise_counts", self.noise_counts, 0.0..=1e3);
        if let Some(vibration) = &self.vibration {
            rules.table("vibration", vibration);
        }
    }
}

impl Effect for FluidEffect {
    type State = ();

    const FILLS_FRAMES: bool = true;

    fn start(&self) {}

    fn complete() -> Self {
        Self { vibration: Some(VibrationEffect::default()), ..Self::default() }
    }

    /// All of it, and its vibration, which brings the fluid with it.
    fn switches() -> Vec<Switch<Option<Self>>> {
        let is_on = |fluid: &Option<Self>| fluid.as_ref().is_some_and(|f| f.vibration.is_some());
        let set = |fluid: &mut Option<Self>, on| match (fluid, on) {
            (fluid, true) => fluid.get_or_insert_default().vibration = Some(Default::default()),
            (Some(fluid), false) => fluid.vibration = None,
            (None, false) => {}
        };
        vec![Switch::table(), Switch::new("vibration", is_on, set)]
    }
}

/// Table `[fluid.vibration]`: the amplified, band-passed pressure at 2.2 kHz.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VibrationEffect {
    /// PAC at rest.
    pub baseline_counts: f64,
    /// White noise; 0 is none.
    pub noise_counts: f64,
    /// Slower changes are taken out.
    pub high_pass_hz: f64,
    /// Faster ones too.
    pub low_pass_hz: f64,
}

impl Default for VibrationEffect {
    /// Baseline: SynTouch QuickStart guide, 2020 to 2035. Noise: RuihanGao/BioTacSP_setup, 2.8 to
    /// 3.0 between frames. Band: SynTouch BioTac SP manual.
    fn default() -> Self {
        Self { baseline_counts: 2028.0, noise_counts: 3.0, high_pass_hz: 10.0, low_pass_hz: 1040.0 }
    }
}

impl Checked for VibrationEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("baseline_counts", self.baseline_counts, 0.0..=FULL_SCALE_COUNTS);
        rules.number("noise_counts", self.noise_counts, 0.0..=1e3);
        rules.number("high_pass_hz", self.high_pass_hz, 1e-3..=1e4);
        rules.number("low_pass_hz", self.low_pass_hz, 1e-3..=1e5);
    }
}

impl FluidEffect {
    /// PDC at a pressure above rest.
    pub fn pdc_counts(&self, pressure_pa: f64, rng: &mut impl Rng) -> f64 {
        self.convert(self.baseline_counts + pressure_pa / PDC_PA, self.noise_counts, rng)
    }

    fn convert(&self, mut counts: f64, noise_counts: f64, rng: &mut impl Rng) -> f64 {
        if noise_counts > 0.0 {
            counts += noise_counts * normal(rng);
        }
        if self.quantise { counts.round().clamp(0.0, FULL_SCALE_COUNTS) } else { counts }
    }
}

/// The filters of PAC, both of first order: one trial's state.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    smooth_pa: f64,
    slow_pa: f64,
}

impl Filter {
    /// PAC `dt_s` after the last one.
    pub fn pac_counts(
        &mut self,
        (fluid, vibration): (&FluidEffect, &VibrationEffect),
        pressure_pa: f64,
        dt_s: f64,
        rng: &mut impl Rng,
    ) -> f64 {
        let part = |hz: f64| -(-TAU * hz * dt_s).exp_m1();
        self.smooth_pa += part(vibration.low_pass_hz) * (pressure_pa - self.smooth_pa);
        self.slow_pa += part(vibration.high_pass_hz) * (self.smooth_pa - self.slow_pa);
        let counts = vibration.baseline_counts + (self.smooth_pa - self.slow_pa) / PAC_PA;
        fluid.convert(counts, vibration.noise_counts, rng)
    }
}
