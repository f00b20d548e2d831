//! Constants of skin and electrodes from recordings of a finger pressed on a flat plate.
//!
//! A hand held the finger, so its attitude is unknown and is fitted with the constants; it says
//! nothing about the sensor. Loads below 2 N are left out: few frames, and the counts at rest are
//! recorded on another day.

use super::effects::electrodes::ElectrodesEffect;
use super::effects::skin::SkinEffect;
use super::plate::{Attitude, Plate, Recording, direction_t};
use crate::robot::finger::frame::ELECTRODES;
use serde::Serialize;

/// Least normal force of a bin that is fitted.
const LEAST_N: f64 = 2.0;

/// A measured change below this is too small to have a sign.
const SIGNED_COUNTS: f64 = 100.0;

/// From 4 to 8 N the pressure may rise, per newton, by this part of its rise over the first
/// newton: the sensor's manual says it saturates at about 2 N. Chosen.
const SATURATED: f64 = 0.15;

/// What a unit of saturation missed costs, in counts of mean error (chosen: 0.05 more costs 10).
const SATURATION_COUNTS: f64 = 200.0;

/// A search ends when its steps are this part of the first (chosen).
const FINEST: f64 = 1.0 / 64.0;

/// What is known about a finger on a plate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Model {
    /// Constants of the skin.
    pub skin: SkinEffect,
    /// Constants of the electrodes; baselines are the recording's own.
    pub electrodes: ElectrodesEffect,
    /// Stiffness of the fluid.
    pub cavity_pa_m3: f64,
    /// How the hand held the finger.
    pub attitude: Attitude,
}

/// How a model agrees with a recording.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Residual {
    /// Mean absolute error over electrodes and bins of force.
    pub mean_error_counts: f64,
    /// Part of the entries measured to change by more than 100 counts whose change has the right
    /// sign.
    pub right_sign: f64,
    /// Rise of pressure per newton from 4 to 8 N, relative to the first newton.
    pub saturation: f64,
}

/// What a fit may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Free {
    /// Only how the hand held the finger: a test of the constants.
    Attitude,
    /// Then also the stiffnesses against flattening and of the core, and the electrodes' spread.
    /// Counts alone do not tell the stiffness against inflation: ten times less fits as well.
    Constants,
}

/// Normal force and predicted counts of each bin of `recording` from 2 N; none if a pose has no
/// answer.
pub fn predict(model: &Model, recording: &Recording) -> Option<Vec<(f64, [f64; ELECTRODES])>> {
    let mut plate = plate(model, recording)?;
    let bins = recording.near_normal_loads.iter();
    bins.filter(|bin| bin.normal_force_n[0] >= LEAST_N)
        .map(|bin| {
            let force_n = bin.mean_normal_force_n;
            Some((force_n, plate.mean_counts(&model.attitude, force_n).ok()?))
        })
        .collect()
}

/// Compares a model with a recording; none if a pose has no answer or the recording is empty.
pub fn residual(model: &Model, recording: &Recording) -> Option<Residual> {
    let predicted = predict(model, recording)?;
    let bins = recording.near_normal_loads.iter();
    let bins = bins.filter(|bin| bin.normal_force_n[0] >= LEAST_N);
    let (mut error_counts, mut entries, mut right, mut signed) = (0.0, 0.0, 0.0, 0.0);
    for (bin, (_, predicted)) in bins.zip(&predicted) {
        for ((&measured, &predicted), &rest) in
            bin.mean_counts.iter().zip(predicted).zip(&recording.no_contact_median_counts)
        {
            error_counts += (predicted - measured).abs();
            entries += 1.0;
            if (measured - rest).abs() > SIGNED_COUNTS {
                signed += 1.0;
                right += f64::from((measured - rest) * (predicted - rest) > 0.0);
            }
        }
    }
    let mut plate = plate(model, recording)?;
    let towards_t = direction_t(model.attitude.pitch_rad, model.attitude.roll_rad);
    let mut pressure_pa =
        |force_n| plate.press_to(&towards_t, force_n).ok().map(|(load, _)| load.pressure_pa);
    let (one, four, eight) = (pressure_pa(1.0)?, pressure_pa(4.0)?, pressure_pa(8.0)?);
    (entries > 0.0).then(|| Residual {
        mean_error_counts: error_counts / entries,
        right_sign: right / f64::max(signed, 1.0),
        saturation: (eight - four) / 4.0 / one,
    })
}

/// The model near `start` that agrees best with `recording`, with its residual.
///
/// Minimises mean error + 100 × part of wrong signs + penalty on a pressure that does not
/// saturate, by a compass search: each parameter in turn takes a step either way if that
/// helps; when none does, all steps are halved. Deterministic. Constants are set free only once
/// the attitude fits, or they would make up for it.
pub fn fit(start: &Model, recording: &Recording, free: Free) -> Option<(Model, Residual)> {
    let start = match free {
        Free::Attitude => start,
        Free::Constants => &fit(start, recording, Free::Attitude)?.0,
    };
    let cost = |residual: &Residual| {
        residual.mean_error_counts
            + 100.0 * (1.0 - residual.right_sign)
            + SATURATION_COUNTS * (residual.saturation - SATURATED).max(0.0)
    };
    let mut best = (start.clone(), residual(start, recording)?);
    let mut part = 1.0;
    while part >= FINEST {
        let mut moved = false;
        for knob in knobs(free) {
            for step in [part, -part] {
                let mut model = best.0.clone();
                knob(&mut model, step);
                if let Some(residual) = residual(&model, recording)
                    && cost(&residual) < cost(&best.1)
                {
                    best = (model, residual);
                    moved = true;
                    break;
                }
            }
        }
        if !moved {
            part *= 0.5;
        }
    }
    Some(best)
}

/// One parameter each: moves it by a part of its first step.
fn knobs(free: Free) -> &'static [fn(&mut Model, f64)] {
    const KNOBS: [fn(&mut Model, f64); 6] = [
        |model, step| model.attitude.pitch_rad += 0.1 * step,
        |model, step| model.attitude.roll_rad += 0.1 * step,
        |model, step| {
            let sd_rad = &mut model.attitude.roll_sd_rad;
            *sd_rad = (*sd_rad + 0.1 * step).max(0.0);
        },
        |model, step| stretch(&mut model.skin.flatten_pa_m, 0.7 * step),
        |model, step| stretch(&mut model.skin.core_pa_m, step),
        |model, step| model.electrodes.spread_m *= (0.3 * step).exp(),
    ];
    match free {
        Free::Attitude => &KNOBS[..3],
        Free::Constants => &KNOBS,
    }
}

/// Multiplies a stiffness by eˢ, within what a scene may hold.
fn stretch(stiffness_pa_m: &mut f64, s: f64) {
    *stiffness_pa_m = (*stiffness_pa_m * s.exp()).clamp(1e5, 1e12);
}

fn plate(model: &Model, recording: &Recording) -> Option<Plate> {
    let baseline_counts = recording.no_contact_median_counts;
    let electrodes = ElectrodesEffect { baseline_counts, ..model.electrodes.clone() };
    Plate::new(&model.skin, model.cavity_pa_m3, &electrodes)
}
