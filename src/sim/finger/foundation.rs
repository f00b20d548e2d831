//! The skin as columns that share the fluid's pressure and know nothing else of each other.

use super::cavity::{self, Balance, SkinContact};
use super::column::Column;
use super::samples::SkinSample;

/// An elastic foundation; never changes.
#[derive(Clone, Debug)]
pub(super) struct Foundation {
    pub column: Column,
    /// Section of all columns that stand in the fluid.
    pub wet_m2: f64,
    /// Pressure per displaced volume, in Pa/m³; 0 without fluid.
    pub cavity_pa_m3: f64,
}

impl Foundation {
    /// Finds the pressure, every touch's response to it, and how far the skin moved in at each
    /// sample.
    pub fn balance(
        &self,
        touches: &mut [SkinContact],
        samples: &[SkinSample],
        inward_m: &mut [f64],
    ) -> Balance {
        let wet = touches.iter().filter(|touch| touch.wet);
        let free_m2 = self.wet_m2 - wet.map(|touch| touch.section_m2).sum::<f64>();
        let pressure_pa = cavity::balance(touches, &self.column, free_m2, self.cavity_pa_m3);
        let free = self.column.respond(f64::NEG_INFINITY, 0.0, pressure_pa);
        for (inward_m, sample) in inward_m.iter_mut().zip(samples) {
            *inward_m = if sample.layers.wet { free.inward_m } else { 0.0 };
        }
        let mut energy_j = free.energy_j_m2 * free_m2;
        if self.cavity_pa_m3 > 0.0 {
            energy_j += 0.5 * pressure_pa * pressure_pa / self.cavity_pa_m3;
        }
        let mut displaced_m3 = 0.0;
        for touch in touches.iter() {
            inward_m[touch.sample] = touch.response.inward_m;
            if touch.wet {
                displaced_m3 += touch.response.inward_m.max(0.0) * touch.section_m2;
            }
        }
        Balance { pressure_pa, displaced_m3, energy_j }
    }
}
