//! A finger over a plate that remembers its presses: most of a fit's parameters leave them alone.

use super::constants::Model;
use crate::sim::finger::effects::electrodes::{Electrodes, ElectrodesEffect};
use crate::sim::finger::plate::{Plate, direction_t};
use crate::sim::finger::shear::Shear;
use std::collections::HashMap;
use std::rc::Rc;

/// Presses remembered, of 4 kB each (chosen: several times the slopes of one step).
const REMEMBERED: usize = 4000;

/// What a press does.
#[derive(Debug)]
pub struct Press {
    /// How far the skin moved inwards at each sample.
    pub inward_m: Vec<f64>,
    /// Pressure of the fluid above rest.
    pub pressure_pa: f64,
}

/// A plate with one skin at a time.
#[derive(Default)]
pub struct Bench {
    worn: Option<(Model, Plate)>,
    presses: HashMap<Vec<u64>, Rc<Press>>,
}

impl Bench {
    /// Puts on the skin of `model`, unless it is worn; none if it cannot be built.
    pub fn wear(&mut self, model: &Model) -> Option<()> {
        let same = self.worn.as_ref().is_some_and(|(worn, _)| {
            worn.skin == model.skin && worn.cavity_pa_m3 == model.cavity_pa_m3
        });
        if !same {
            let plate = Plate::new(&model.skin, model.cavity_pa_m3, &model.electrodes)?;
            self.worn = Some((model.clone(), plate));
        }
        Some(())
    }

    /// Electrodes under the skin; without weights if none is worn.
    pub fn electrodes(&self, effect: &ElectrodesEffect) -> Electrodes {
        let samples = self.worn.as_ref().map_or(&[][..], |(_, plate)| plate.skin().samples());
        Electrodes::new(effect, samples, 1.0)
    }

    /// What `electrodes` under the skin feel of shear; nothing if none is worn.
    pub fn shear(&self, electrodes: &Electrodes) -> Shear {
        let samples = self.worn.as_ref().map_or(&[][..], |(_, plate)| plate.skin().samples());
        Shear::new(electrodes, samples)
    }

    /// Presses with a normal force at pitch and roll; none if that has no answer.
    pub fn press(&mut self, angles_rad: [f64; 2], force_n: f64) -> Option<Rc<Press>> {
        let (model, plate) = self.worn.as_mut()?;
        let skin = &model.skin;
        let stiffness = [skin.modulus_pa, skin.flatten_pa_m, skin.inflate_pa_m, skin.core_pa_m];
        let others = [angles_rad[0], angles_rad[1], force_n, model.cavity_pa_m3];
        let key: Vec<u64> = stiffness.iter().chain(&others).map(|value| value.to_bits()).collect();
        if let Some(press) = self.presses.get(&key) {
            return Some(Rc::clone(press));
        }
        let towards_t = direction_t(angles_rad[0], angles_rad[1]);
        let (load, _) = plate.press_to(&towards_t, force_n).ok()?;
        let inward_m = plate.pressed().moved_m().to_vec();
        let press = Rc::new(Press { inward_m, pressure_pa: load.pressure_pa });
        if self.presses.len() >= REMEMBERED {
            self.presses.clear();
        }
        self.presses.insert(key, Rc::clone(&press));
        Some(press)
    }
}
