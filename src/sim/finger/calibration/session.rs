//! What belongs to one session of one sensor.

use super::bench::Bench;
use super::constants::Model;
use crate::sim::finger::effects::electrodes::{Electrodes, ElectrodesEffect};
use crate::sim::finger::plate::direction_t;
use crate::sim::finger::recording::Recording;
use nalgebra::Vector3;
use palpate_explore::robot::finger::frame::ELECTRODES;

/// Standard deviation of the roll from press to press of a hand at one load (chosen, as fits that
/// leave it free find 0.01 to 0.27).
pub const PRESS_SD_RAD: f64 = 0.1;

/// Abscissae and weights of three-point Gauss–Hermite quadrature over a normal distribution.
const QUADRATURE: [(f64, f64); 3] =
    [(-1.732_050_807_568_877_2, 1.0 / 6.0), (0.0, 2.0 / 3.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];

/// Offset, gain and attitude: nothing that another session of the sensor shares.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// How well the fluid conducts, relative to the session without contact.
    pub offset: f64,
    /// What the sensor's electrodes multiply the exponent of their gap with.
    pub gain: f64,
    /// From the pad towards the tip.
    pub pitch_rad: f64,
    /// From the pad towards +y, at each load: these are different presses.
    pub roll_rad: Vec<f64>,
}

impl Session {
    /// Mean of the rolls.
    pub fn mean_roll_rad(&self) -> f64 {
        self.roll_rad.iter().sum::<f64>() / self.roll_rad.len().max(1) as f64
    }

    /// Counts at each load of `recording`; none if a pose has no answer.
    pub fn predict(
        &self,
        model: &Model,
        recording: &Recording,
        bench: &mut Bench,
    ) -> Option<Vec<[f64; ELECTRODES]>> {
        bench.wear(model)?;
        let electrodes = bench.electrodes(&self.electrodes(model, recording));
        let loads = recording.near_normal_loads.iter().zip(&self.roll_rad);
        loads
            .map(|(bin, &roll_rad)| {
                let load = [bin.mean_normal_force_n, roll_rad];
                self.mean_counts(load, &electrodes, &|_, _| {}, bench)
            })
            .collect()
    }

    /// The electrodes of the recorded sensor.
    pub(super) fn electrodes(&self, model: &Model, recording: &Recording) -> ElectrodesEffect {
        ElectrodesEffect {
            baseline_counts: recording.no_contact_median_counts,
            exponent: model.electrodes.exponent * self.gain,
            ..model.electrodes.clone()
        }
    }

    /// Mean counts over the presses of a hand with a normal force about a roll, where `carry`
    /// changes how much of each gap is closed, given the direction that faces the plate; none if a
    /// pose has no answer.
    pub(super) fn mean_counts(
        &self,
        [force_n, roll_rad]: [f64; 2],
        electrodes: &Electrodes,
        carry: &dyn Fn(&Vector3<f64>, &mut [f64; ELECTRODES]),
        bench: &mut Bench,
    ) -> Option<[f64; ELECTRODES]> {
        let mut mean = [0.0; ELECTRODES];
        for (off, weight) in QUADRATURE {
            let angles_rad = [self.pitch_rad, roll_rad + off * PRESS_SD_RAD];
            let press = bench.press(angles_rad, force_n)?;
            let mut closed = electrodes.closed(&press.inward_m);
            carry(&direction_t(angles_rad[0], angles_rad[1]), &mut closed);
            let counts = electrodes.counts_closed(&closed, self.offset);
            mean.iter_mut().zip(counts).for_each(|(mean, counts)| *mean += weight * counts);
        }
        Some(mean)
    }

    /// Rise of pressure per newton from 4 to 8 N, relative to the first newton; none if a pose has
    /// no answer.
    pub fn saturation(&self, model: &Model, bench: &mut Bench) -> Option<f64> {
        bench.wear(model)?;
        let angles_rad = [self.pitch_rad, self.mean_roll_rad()];
        let mut pressure_pa = |force_n| Some(bench.press(angles_rad, force_n)?.pressure_pa);
        let (one, four, eight) = (pressure_pa(1.0)?, pressure_pa(4.0)?, pressure_pa(8.0)?);
        Some((eight - four) / 4.0 / one)
    }
}
