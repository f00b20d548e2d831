//! Stress relaxation of silicone: at a constant pose the force of the skin decays, and unloading
//! gives less force than loading.

use super::constants::effect;
use super::effect::{Effect, LoadHook};
use crate::finger::load::ContactLoad;

effect! {
    /// Table `[creep]`: the skin as a standard linear solid. The fluid's share of the force relaxes
    /// with it; gaps follow the object without delay.
    CreepEffect in "creep"
    constants {
        /// Instantaneous over relaxed load, minus one.
        part: f64, 0.0..=10.0;
        /// Time constant of the relaxation.
        time_constant_s: f64, 1e-3..=1e6;
    }
}

impl Effect for CreepEffect {
    type State = RelaxationState;

    const ON_LOAD: Option<LoadHook<Self>> =
        Some(|effect, lag, _, dt_s, load| lag.step(effect, dt_s, load));
}

/// Relaxation state of the load in one trial.
#[derive(Clone, Copy, Debug, Default)]
pub struct RelaxationState {
    force_n: f64,
    pressure_pa: f64,
}

impl RelaxationState {
    /// Advances by `dt_s` under an elastic `load`, which becomes f + part (f − lag of f), but never
    /// pulls. The lag is exact for a constant load.
    pub fn step(&mut self, effect: &CreepEffect, dt_s: f64, load: &mut ContactLoad) {
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
