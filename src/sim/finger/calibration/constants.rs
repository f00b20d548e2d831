//! The constants that all sensors share.

use crate::sim::finger::effects::Effects;
use crate::sim::finger::effects::electrodes::ElectrodesEffect;
use crate::sim::finger::effects::fluid::FluidEffect;
use crate::sim::finger::effects::skin::{SkinEffect, SkinModel};

/// What is known about every finger of a kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Constants of the skin.
    pub skin: SkinEffect,
    /// Constants of the electrodes; baselines are each recording's own.
    pub electrodes: ElectrodesEffect,
    /// Stiffness of the fluid.
    pub cavity_pa_m3: f64,
}

impl Default for Model {
    /// What a scene without settings of its own has.
    fn default() -> Self {
        Self {
            skin: SkinEffect::default(),
            electrodes: ElectrodesEffect::default(),
            cavity_pa_m3: FluidEffect::default().stiffness_pa_m3,
        }
    }
}

impl Model {
    /// The same whose skin passes load on like this.
    pub fn of(model: SkinModel) -> Self {
        let known = Self::default();
        Self { skin: SkinEffect { model, ..known.skin }, ..known }
    }

    /// What may be fitted of it.
    pub fn constants(&self) -> &'static [Constant] {
        match self.skin.model {
            SkinModel::Columns => &CONSTANTS,
            SkinModel::Shell => &SHELL_CONSTANTS,
        }
    }

    /// As tables of a scene.
    pub fn effects(&self) -> Effects {
        Effects {
            skin: Some(self.skin.clone()),
            electrodes: Some(self.electrodes.clone()),
            ..Effects::default()
        }
    }
}

/// A constant that may be fitted; all are positive and are counted in logarithms.
#[derive(Debug)]
pub struct Constant {
    /// Its key in a scene's `[effects]`.
    pub key: &'static str,
    /// Where it may lie; at either end the recordings do not determine it.
    pub bounds: [f64; 2],
    /// How far off it could plausibly be, as a logarithm.
    pub plausible: f64,
    of: fn(&mut Model) -> &mut f64,
}

impl Constant {
    /// Its value in `model`.
    pub fn value(&self, model: &Model) -> f64 {
        *(self.of)(&mut model.clone())
    }

    /// Sets it.
    pub fn set(&self, model: &mut Model, value: f64) {
        *(self.of)(model) = value;
    }
}

const fn constant(
    key: &'static str,
    bounds: [f64; 2],
    plausible: f64,
    of: fn(&mut Model) -> &mut f64,
) -> Constant {
    Constant { key, bounds, plausible, of }
}

const CORE: Constant =
    constant("skin.core_pa_m", [1e6, 1e11], 2.3, |model| &mut model.skin.core_pa_m);
const SPREAD: Constant =
    constant("electrodes.spread_m", [5e-4, 6e-3], 0.7, |model| &mut model.electrodes.spread_m);

/// Those of columns. Bounds and what is plausible are chosen: a factor of ten for a stiffness, two
/// for the spread. The skin's modulus and the stiffness against inflation are sourced: counts alone
/// would have the pressure ten times too low as well; and the exponent is a gain that all share.
pub const CONSTANTS: [Constant; 3] = [
    constant("skin.flatten_pa_m", [1e4, 1e9], 2.3, |model| &mut model.skin.flatten_pa_m),
    CORE,
    SPREAD,
];

/// Those of a shell, whose modulus is what resists being flattened. Two for it is what the hardness
/// of the skin (Shore A 26, BioTac SP manual) and NVlabs/biotac_sim differ by.
const SHELL_CONSTANTS: [Constant; 3] = [
    constant("skin.modulus_pa", [1e5, 1e7], 0.7, |model| &mut model.skin.modulus_pa),
    CORE,
    SPREAD,
];
