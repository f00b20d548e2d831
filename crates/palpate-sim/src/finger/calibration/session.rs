//! Session of one sensor, and the plate on which its presses are simulated.

use super::constants::FingerConstants;
use crate::finger::effects::electrodes::{Electrodes, ElectrodesEffect};
use crate::finger::plate::{PlateContact, direction_t};
use crate::finger::recording::PlateRecording;
use crate::finger::samples::SkinSample;
use nalgebra::Vector3;
use palpate_explore::robot::finger::frame::ELECTRODES;
use std::collections::HashMap;
use std::rc::Rc;

// heuristic: standard deviation of the roll between a hand's presses at one load; fits with this
// parameter free find 0.01 to 0.27.
const PRESS_SD_RAD: f64 = 0.1;

/// Abscissae and weights of three-point Gauss–Hermite quadrature over a normal distribution.
const QUADRATURE: [(f64, f64); 3] =
    [(-1.732_050_807_568_877_2, 1.0 / 6.0), (0.0, 2.0 / 3.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];

/// Session parameters: offset, gain and attitude, not shared with other sessions of the sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// Conductivity of the fluid, relative to the session without contact.
    pub offset: f64,
    /// Factor on the exponent of the electrodes' gaps.
    pub gain: f64,
    /// Pitch, from the pad towards the tip.
    pub pitch_rad: f64,
    /// Roll, from the pad towards +y: one value per load, because each load is another press.
    pub roll_rad: Vec<f64>,
}

impl Session {
    /// Returns the mean of the rolls.
    pub fn mean_roll_rad(&self) -> f64 {
        self.roll_rad.iter().sum::<f64>() / self.roll_rad.len().max(1) as f64
    }

    /// Returns the counts at each load of `recording`; `None` if a pose has no solution.
    pub fn predict(
        &self,
        model: &FingerConstants,
        recording: &PlateRecording,
        bench: &mut PlateRig,
    ) -> Option<Vec<[f64; ELECTRODES]>> {
        let effect = self.electrodes(model, recording);
        let electrodes = Electrodes::new(&effect, bench.set_skin(model)?, 1.0);
        let loads = recording.near_normal_loads.iter().zip(&self.roll_rad);
        loads
            .map(|(bin, &roll_rad)| {
                let load = [bin.mean_normal_force_n, roll_rad];
                self.mean_counts(load, &electrodes, &|_, _| {}, bench)
            })
            .collect()
    }

    /// Returns the electrodes of the recorded sensor.
    pub(super) fn electrodes(
        &self,
        model: &FingerConstants,
        recording: &PlateRecording,
    ) -> ElectrodesEffect {
        ElectrodesEffect {
            baseline_counts: recording.no_contact_median_counts,
            exponent: model.electrodes.exponent * self.gain,
            ..model.electrodes.clone()
        }
    }

    /// Returns the mean counts of manual presses at one normal force, with rolls about one roll.
    /// `carry` changes the closed fraction of each gap, given the direction that faces the plate.
    /// Returns `None` if a pose has no solution.
    pub(super) fn mean_counts(
        &self,
        [force_n, roll_rad]: [f64; 2],
        electrodes: &Electrodes,
        carry: &dyn Fn(&Vector3<f64>, &mut [f64; ELECTRODES]),
        bench: &mut PlateRig,
    ) -> Option<[f64; ELECTRODES]> {
        let mut mean = [0.0; ELECTRODES];
        for (off, weight) in QUADRATURE {
            let angles_rad = [self.pitch_rad, roll_rad + off * PRESS_SD_RAD];
            let press = bench.press(angles_rad, force_n)?;
            let mut closed = electrodes.closed_fractions(&press.inward_m);
            carry(&direction_t(angles_rad[0], angles_rad[1]), &mut closed);
            let counts = electrodes.counts_closed(&closed, self.offset);
            mean.iter_mut().zip(counts).for_each(|(mean, counts)| *mean += weight * counts);
        }
        Some(mean)
    }

    /// Returns the rise of pressure per newton from 4 to 8 N over that from 0 to 1 N; `None`
    /// if a pose has no solution.
    pub fn saturation(&self, model: &FingerConstants, bench: &mut PlateRig) -> Option<f64> {
        bench.set_skin(model)?;
        let angles_rad = [self.pitch_rad, self.mean_roll_rad()];
        let mut pressure_pa = |force_n| Some(bench.press(angles_rad, force_n)?.pressure_pa);
        let (one, four, eight) = (pressure_pa(1.0)?, pressure_pa(4.0)?, pressure_pa(8.0)?);
        Some((eight - four) / 4.0 / one)
    }
}

// heuristic: number of cached presses, of 4 kB each; several times the number in the slopes of one
// step.
const CACHED_PRESSES_MAX: usize = 4000;

/// Response of the finger to a press.
#[derive(Debug)]
pub struct PressResponse {
    /// Inward motion of the skin at each sample.
    pub inward_m: Vec<f64>,
    /// Pressure of the fluid above rest.
    pub pressure_pa: f64,
}

/// Finger over a plate, with one skin at a time and a cache of its presses: most parameters of a
/// fit leave them unchanged.
#[derive(Default)]
pub struct PlateRig {
    worn: Option<(FingerConstants, PlateContact)>,
    presses: HashMap<Vec<u64>, Rc<PressResponse>>,
}

impl PlateRig {
    /// Sets the skin of `model`, unless it is set already, and returns its points; `None` if it
    /// cannot be built.
    pub fn set_skin(&mut self, model: &FingerConstants) -> Option<&[SkinSample]> {
        let is_worn = |(worn, _): &(FingerConstants, PlateContact)| {
            worn.skin == model.skin && worn.cavity_pa_m3 == model.cavity_pa_m3
        };
        if !self.worn.as_ref().is_some_and(is_worn) {
            self.worn = Some((model.clone(), PlateContact::new(&model.skin, model.cavity_pa_m3)?));
        }
        Some(self.worn.as_ref()?.1.skin.samples())
    }

    /// Presses with a normal force at pitch and roll; `None` if the pose has no solution.
    pub fn press(&mut self, angles_rad: [f64; 2], force_n: f64) -> Option<Rc<PressResponse>> {
        let (model, plate) = self.worn.as_mut()?;
        let skin = &model.skin;
        let stiffness = [skin.modulus_pa, skin.flatten_pa_m, skin.inflate_pa_m, skin.core_pa_m];
        let others = [angles_rad[0], angles_rad[1], force_n, model.cavity_pa_m3];
        let key: Vec<u64> = stiffness.iter().chain(&others).map(|value| value.to_bits()).collect();
        if let Some(press) = self.presses.get(&key) {
            return Some(Rc::clone(press));
        }
        let towards_t = direction_t(angles_rad[0], angles_rad[1]);
        let load = plate.press_to(&towards_t, force_n).ok()?;
        let inward_m = plate.pressed.inward_or_empty_m().to_vec();
        let press = Rc::new(PressResponse { inward_m, pressure_pa: load.pressure_pa });
        if self.presses.len() >= CACHED_PRESSES_MAX {
            self.presses.clear();
        }
        self.presses.insert(key, Rc::clone(&press));
        Some(press)
    }
}
