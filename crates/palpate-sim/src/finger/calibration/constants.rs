//! Constants that all sensors of a kind share.

use crate::finger::effects::Effects;
use crate::finger::effects::electrodes::ElectrodesEffect;
use crate::finger::effects::fluid::FluidEffect;
use crate::finger::effects::skin::{SkinEffect, SkinModel};

/// Model constants of a kind of finger.
#[derive(Clone, Debug, PartialEq)]
pub struct FingerConstants {
    /// Constants of the skin.
    pub skin: SkinEffect,
    /// Constants of the electrodes; each recording has its own baselines.
    pub electrodes: ElectrodesEffect,
    /// Stiffness of the fluid.
    pub cavity_pa_m3: f64,
}

impl Default for FingerConstants {
    /// Returns the constants of a scene without settings of its own.
    fn default() -> Self {
        Self {
            skin: SkinEffect::default(),
            electrodes: ElectrodesEffect::default(),
            cavity_pa_m3: FluidEffect::default().stiffness_pa_m3,
        }
    }
}

impl FingerConstants {
    /// Returns the default constants with another skin model.
    pub fn of(model: SkinModel) -> Self {
        let known = Self::default();
        Self { skin: SkinEffect { model, ..known.skin }, ..known }
    }

    /// Returns the constants that can be fitted.
    pub fn constants(&self) -> &'static [Constant] {
        match self.skin.model {
            SkinModel::Columns => &CONSTANTS,
            SkinModel::Shell => &SHELL_CONSTANTS,
        }
    }

    /// Returns the constants as effects of a scene.
    pub fn effects(&self) -> Effects {
        Effects {
            skin: Some(self.skin.clone()),
            electrodes: Some(self.electrodes.clone()),
            ..Effects::default()
        }
    }
}

/// Constant that can be fitted; all are positive and fitted as logarithms.
#[derive(Debug)]
pub struct Constant {
    /// Key of the constant in a scene's `[effects]`.
    pub key: &'static str,
    /// Bounds of the fit; a constant that reaches one is not determined by the recordings.
    pub bounds: [f64; 2],
    /// Plausible standard deviation of the constant's logarithm.
    pub plausible: f64,
    of: fn(&mut FingerConstants) -> &mut f64,
}

impl Constant {
    /// Returns the value in `model`.
    pub fn value(&self, model: &FingerConstants) -> f64 {
        *(self.of)(&mut model.clone())
    }

    /// Sets the value in `model`.
    pub fn set(&self, model: &mut FingerConstants, value: f64) {
        *(self.of)(model) = value;
    }
}

const fn constant(
    key: &'static str,
    bounds: [f64; 2],
    plausible: f64,
    of: fn(&mut FingerConstants) -> &mut f64,
) -> Constant {
    Constant { key, bounds, plausible, of }
}

const CORE: Constant =
    constant("skin.core_pa_m", [1e6, 1e11], 2.3, |model| &mut model.skin.core_pa_m);
const SPREAD: Constant =
    constant("electrodes.spread_m", [5e-4, 6e-3], 0.7, |model| &mut model.electrodes.spread_m);

/// Constants of columns.
///
/// Bounds and plausible deviations are a heuristic: a factor of ten for a stiffness, two for the
/// spread. The skin's modulus and the stiffness against inflation are taken from sources, because
/// counts alone would give a pressure ten times too low as well; the exponent is a gain that all
/// share.
pub const CONSTANTS: [Constant; 3] = [
    constant("skin.flatten_pa_m", [1e4, 1e9], 2.3, |model| &mut model.skin.flatten_pa_m),
    CORE,
    SPREAD,
];

/// Constants of a shell, whose modulus resists flattening. The factor of two for it is the
/// difference between the hardness of the skin (Shore A 26, BioTac SP manual) and
/// NVlabs/biotac_sim.
const SHELL_CONSTANTS: [Constant; 3] = [
    constant("skin.modulus_pa", [1e5, 1e7], 0.7, |model| &mut model.skin.modulus_pa),
    CORE,
    SPREAD,
];
