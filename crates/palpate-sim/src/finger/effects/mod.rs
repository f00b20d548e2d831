//! Optional physics of the finger: a scene simulates only the effects that it names.
//!
//! An effect is a file here, which implements [`Effect`], and a line in the table below. That line
//! defines its key and checks in the scene file, its field in [`Effects`], its state during a
//! trial, its hook on the load, its switch, and its row in a study of effects.

pub mod collision;
pub mod constants;
pub mod contact_noise;
pub mod creep;
pub mod effect;
pub mod electrodes;
pub mod fluid;
pub mod friction;
pub mod gel;
pub mod registration;
pub mod rigid_tip;
pub mod sensor;
pub mod skin;
mod table;
pub mod thermal;
pub mod timing;
pub mod variation;
pub mod wrench;

use super::load::ContactLoad;
use effect::{Effect, EffectSwitch, Requirement};
use palpate_explore::robot::finger::TipMotion;
use palpate_explore::robot::sensor::{Signal, TipSurface};
use palpate_input::config::{Rules, Validate};

// An effect comes after those that it requires.
table::effects! {
    /// Soft skin; without it there is no load and no tactile frame.
    skin: skin::SkinEffect,
    /// Rigid tip instead of the skin.
    rigid_tip: rigid_tip::RigidTipEffect,
    /// Elastomer pad with a camera behind it, instead of the skin.
    gel: gel::GelEffect,
    /// Liquid under the skin with its pressure; without it the finger is dry and the skin's points
    /// are independent.
    fluid: fluid::FluidEffect,
    /// Impedance electrodes.
    electrodes: electrodes::ElectrodesEffect,
    /// Stress relaxation of the silicone.
    creep: creep::CreepEffect,
    /// Heat transfer and temperature channels.
    thermal: thermal::ThermalEffect,
    /// Friction and tangential forces.
    friction: friction::FrictionEffect,
    /// Force/torque sensor behind the finger.
    wrench: wrench::WrenchEffect,
    /// Registration errors of finger and object.
    registration: registration::RegistrationEffect,
    /// Variation between sensors and sessions.
    variation: variation::VariationEffect,
    /// Skew and latency of tactile frames, delay of commands.
    timing: timing::TimingEffect,
    /// Collisions of links, tool, object and table.
    collision: collision::CollisionEffect,
    /// Noise of the contacts of a finger that does not move.
    contact_noise: contact_noise::ContactNoiseEffect,
}

impl Effects {
    /// Returns the minimal effects of a BioTac: skin, fluid and electrodes, with their defaults.
    pub fn biotac() -> Self {
        Self {
            skin: Some(skin::SkinEffect::default()),
            fluid: Some(fluid::FluidEffect::default()),
            electrodes: Some(electrodes::ElectrodesEffect::default()),
            ..Self::default()
        }
    }

    /// Returns the minimal effects of a finger whose sensor reads `signal`; without one, a BioTac.
    pub fn minimal(signal: Option<Signal>) -> Self {
        let Some(signal) = signal else { return Self::biotac() };
        let is_pad = signal == Signal::Depth;
        Self {
            gel: is_pad.then(gel::GelEffect::default),
            rigid_tip: (!is_pad).then(rigid_tip::RigidTipEffect::default),
            wrench: (signal == Signal::Wrench).then(wrench::WrenchEffect::default),
            ..Self::default()
        }
    }

    /// Returns every effect with its defaults, except those that another one excludes.
    pub fn all() -> Self {
        Self { rigid_tip: None, gel: None, contact_noise: None, ..Self::each() }
    }

    /// Returns the surface of the fingertip.
    pub fn surface(&self) -> TipSurface {
        match (&self.gel, &self.skin) {
            (Some(gel), _) => TipSurface::Pad(gel.pad()),
            (None, Some(_)) => TipSurface::Skin,
            (None, None) => TipSurface::Rigid,
        }
    }

    /// Returns whether a model computes the load of the object on the finger.
    pub fn has_load(&self) -> bool {
        self.skin.is_some() || self.rigid_tip.is_some() || self.gel.is_some()
    }

    /// Returns whether the requirement `needs` is met.
    fn meets(&self, needs: Requirement) -> bool {
        match needs {
            Requirement::Nothing => true,
            Requirement::Skin => self.skin.is_some(),
            Requirement::Load => self.has_load(),
            Requirement::Frames => self.sends_frames(),
        }
    }
}

/// Returns why `name` is not allowed; `filling` has, for each effect, whether it fills frames.
fn missing(name: &str, needs: Requirement, filling: &[(&str, bool)]) -> String {
    match needs {
        Requirement::Frames => {
            let fills = filling.iter().filter(|(_, fills)| *fills);
            let keys: Vec<String> = fills.map(|(key, _)| format!("[{key}]")).collect();
            let (last, others) = keys.split_last().map_or(("", &[][..]), |(l, o)| (l.as_str(), o));
            format!("no [{name}] without {} or {last}", others.join(", "))
        }
        Requirement::Load => format!("no [{name}] without a [skin], a [rigid_tip] or a [gel]"),
        Requirement::Nothing | Requirement::Skin => format!("no [{name}] without a [skin]"),
    }
}
