//! Silicone that gives way in time: a skin held as it is pushes less and less, and on the way back
//! less than on the way in.

use super::effect::{Effect, OnLoad};
use crate::config::{Checked, Rules};
use crate::sim::finger::load::Load;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[creep]`: the skin as a standard linear solid. The fluid's share goes with it; gaps
/// follow the object as ever.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CreepEffect {
    /// By this part a sudden load exceeds what stays of it.
    pub part: f64,
    /// Time constant with which that goes away.
    pub time_constant_s: f64,
}

impl Default for CreepEffect {
    /// Chosen: a soft silicone that loses a tenth of its load within seconds.
    fn default() -> Self {
        Self { part: 0.1, time_constant_s: 2.0 }
    }
}

impl Checked for CreepEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("part", self.part, 0.0..=10.0);
        rules.number("time_constant_s", self.time_constant_s, 1e-3..=1e6);
    }
}

impl Effect for CreepEffect {
    type State = Lag;

    const ON_LOAD: Option<OnLoad<Self>> =
        Some(|effect, lag, step, load| lag.step(effect, step.dt_s, load));

    fn start(&self) -> Lag {
        Lag::default()
    }
}

/// What lags behind the load: one trial's state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lag {
    force_n: f64,
    pressure_pa: f64,
}

impl Lag {
    /// Another `dt_s` under an elastic `load`, which becomes f + part (f − lag of f), but never
    /// pulls. The lag is exact for a constant load.
    pub fn step(&mut self, effect: &CreepEffect, dt_s: f64, load: &mut Load) {
        let caught_up = -(-dt_s / effect.time_constant_s).exp_m1();
        let over = |lag: &mut f64, elastic: f64| {
            *lag += caught_up * (elastic - *lag);
            if elastic > 0.0 { (1.0 + effect.part * (1.0 - *lag / elastic)).max(0.0) } else { 0.0 }
        };
        let factor = over(&mut self.force_n, load.force_n.norm());
        load.force_n *= factor;
        load.torque_nm *= factor;
        load.pressure_pa *= over(&mut self.pressure_pa, load.pressure_pa);
    }
}
