//! Which physics of the fingertip a scene names.

use super::electrodes::ElectrodesEffect;
use super::flex::FlexEffect;
use super::fluid::FluidEffect;
use super::friction::FrictionEffect;
use super::registration::RegistrationEffect;
use super::skin::SkinEffect;
use super::thermal::ThermalEffect;
use super::timing::TimingEffect;
use super::wrench::WrenchEffect;
use crate::config::{Checked, Rules};
use serde::{Deserialize, Serialize};

/// One optional table each; an absent one has no state and costs no work.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Effects {
    /// A soft skin; without it there is no load and no tactile frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<SkinEffect>,
    /// A skin of finite elements instead of that one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flex: Option<FlexEffect>,
    /// Liquid under the skin and its pressure; without it the finger is dry and its skin's
    /// points do not know of each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fluid: Option<FluidEffect>,
    /// The impedance electrodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub electrodes: Option<ElectrodesEffect>,
    /// Heat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal: Option<ThermalEffect>,
    /// Tangential forces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<FrictionEffect>,
    /// The force/torque sensor behind the finger.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrench: Option<WrenchEffect>,
    /// Errors of the finger's and the object's place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub registration: Option<RegistrationEffect>,
    /// Skew and latency of the tactile frames, delay of commands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimingEffect>,
}

impl Effects {
    /// Every effect with its defaults; of the two skins the cheap one.
    pub fn all() -> Self {
        Self {
            skin: Some(SkinEffect::default()),
            flex: None,
            fluid: Some(FluidEffect { vibration: Some(Default::default()), ..Default::default() }),
            electrodes: Some(ElectrodesEffect::default()),
            thermal: Some(ThermalEffect::default()),
            friction: Some(FrictionEffect::default()),
            wrench: Some(WrenchEffect::default()),
            registration: Some(RegistrationEffect::default()),
            timing: Some(TimingEffect::default()),
        }
    }

    /// Whether there is a skin of either kind.
    pub fn is_soft(&self) -> bool {
        self.skin.is_some() || self.flex.is_some()
    }

    /// Whether a tactile frame has anything in it.
    pub fn sends_frames(&self) -> bool {
        self.is_soft()
            && (self.fluid.is_some() || self.electrodes.is_some() || self.thermal.is_some())
    }
}

impl Checked for Effects {
    fn check(&self, rules: &mut Rules) {
        fn table(rules: &mut Rules, key: &str, effect: &Option<impl Checked>) {
            if let Some(effect) = effect {
                rules.table(key, effect);
            }
        }
        table(rules, "skin", &self.skin);
        table(rules, "flex", &self.flex);
        table(rules, "fluid", &self.fluid);
        table(rules, "electrodes", &self.electrodes);
        table(rules, "thermal", &self.thermal);
        table(rules, "friction", &self.friction);
        table(rules, "wrench", &self.wrench);
        table(rules, "registration", &self.registration);
        table(rules, "timing", &self.timing);
        let one = self.skin.is_none() || self.flex.is_none();
        rules.require("flex", "(given)", one, || "no [flex] beside a [skin]: one skin".into());
        let named = [
            ("fluid", self.fluid.is_some()),
            ("electrodes", self.electrodes.is_some()),
            ("thermal", self.thermal.is_some()),
            ("friction", self.friction.is_some()),
            ("wrench", self.wrench.is_some()),
            ("registration", self.registration.is_some()),
        ];
        for (key, _) in named.into_iter().filter(|(_, given)| *given) {
            rules
                .require(key, "(given)", self.is_soft(), || format!("no [{key}] without a [skin]"));
        }
        rules.require("timing", "(given)", self.timing.is_none() || self.sends_frames(), || {
            "no [timing] without [fluid], [electrodes] or [thermal]".into()
        });
    }
}
