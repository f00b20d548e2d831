//! The optional physics of the finger: a scene simulates what it names and pays for nothing else.
//!
//! An effect is a file here, which implements [`Effect`], and a line in the table below. Key and
//! rules in the scene's file, presence in [`Effects`], memory during a trial, hook on the load,
//! switch and row in a study of effects follow from that line.

pub mod collision;
pub mod constants;
pub mod creep;
pub mod effect;
pub mod electrodes;
pub mod fluid;
pub mod friction;
pub mod registration;
pub mod sensor;
pub mod skin;
mod table;
pub mod thermal;
pub mod timing;
pub mod variation;
pub mod wrench;

use super::load::Load;
use effect::{Effect, Needs, Switch};
use palpate_explore::robot::finger::TipMotion;
use palpate_input::config::{Checked, Rules};

// What an effect needs stands above it.
table::effects! {
    /// A soft skin; without it there is no load and no tactile frame.
    skin: skin::SkinEffect,
    /// Liquid under the skin and its pressure; without it the finger is dry and its skin's
    /// points do not know of each other.
    fluid: fluid::FluidEffect,
    /// The impedance electrodes.
    electrodes: electrodes::ElectrodesEffect,
    /// Silicone that gives way in time.
    creep: creep::CreepEffect,
    /// Heat.
    thermal: thermal::ThermalEffect,
    /// Tangential forces.
    friction: friction::FrictionEffect,
    /// The force/torque sensor behind the finger.
    wrench: wrench::WrenchEffect,
    /// Errors of the finger's and the object's place.
    registration: registration::RegistrationEffect,
    /// How this sensor differs from the next.
    variation: variation::VariationEffect,
    /// Skew and latency of the tactile frames, delay of commands.
    timing: timing::TimingEffect,
    /// Links, tool, object and table collide.
    collision: collision::CollisionEffect,
}

impl Effects {
    /// What a BioTac cannot be without: skin, fluid and electrodes, with their defaults.
    pub fn biotac() -> Self {
        Self {
            skin: Some(skin::SkinEffect::default()),
            fluid: Some(fluid::FluidEffect::default()),
            electrodes: Some(electrodes::ElectrodesEffect::default()),
            ..Self::default()
        }
    }

    /// Whether what `needs` asks for is there.
    fn supports(&self, needs: Needs) -> bool {
        match needs {
            Needs::Nothing => true,
            Needs::Skin => self.skin.is_some(),
            Needs::Frames => self.sends_frames(),
        }
    }
}

/// Why `name` may not be there; `filling` says of each effect whether it fills frames.
fn missing(name: &str, needs: Needs, filling: &[(&str, bool)]) -> String {
    match needs {
        Needs::Frames => {
            let fills = filling.iter().filter(|(_, fills)| *fills);
            let keys: Vec<String> = fills.map(|(key, _)| format!("[{key}]")).collect();
            let (last, others) = keys.split_last().map_or(("", &[][..]), |(l, o)| (l.as_str(), o));
            format!("no [{name}] without {} or {last}", others.join(", "))
        }
        Needs::Nothing | Needs::Skin => format!("no [{name}] without a [skin]"),
    }
}
