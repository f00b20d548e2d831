//! Response of the electrodes to tangential force: measurement and model.

use super::constants::FingerConstants;
use super::fit::{FreeParameters, fit};
use super::session::{PlateRig, Session};
use crate::finger::effects::electrodes::{Electrodes, ShearCoupling};
use crate::finger::effects::friction::FrictionEffect;
use crate::finger::recording::{PlateRecording, check_not_empty, force};
use nalgebra::Vector3;
use palpate_explore::robot::finger::frame::ELECTRODES;
use palpate_gp::math::least_squares::FitError;
use palpate_input::error::InputError;
use serde::Deserialize;

// heuristic: tangential force to either side over which the model's slopes are computed, about that
// of a hand that presses with 3 to 6 N.
const ASIDE_N: f64 = 1.0;

// heuristic: number of electrodes with the largest slopes that are compared one by one.
const LARGEST: usize = 8;

/// Measured slopes of one or more sensors.
#[derive(Clone, Debug, Deserialize)]
pub struct ShearRecordings {
    /// Source of the numbers.
    pub note: String,
    /// Slopes, one entry per sensor.
    pub sensors: Vec<ShearRecording>,
}

/// Least-squares slopes of the counts over the force on the finger, E1 to E19.
#[derive(Clone, Debug, Deserialize)]
pub struct ShearRecording {
    /// Name of the sensor in the source.
    pub sensor: String,
    /// Mean normal force of the frames.
    pub mean_normal_force_n: f64,
    /// Slopes over the force along +y of `T`.
    pub counts_per_n_lateral: [f64; ELECTRODES],
    /// Slopes over the force along +x of `T`.
    pub counts_per_n_axial: [f64; ELECTRODES],
}

impl ShearRecordings {
    /// Checks that there are sensors and that the forces are plausible.
    ///
    /// # Errors
    /// Returns the first value that is not plausible.
    pub fn check(&self) -> Result<(), InputError> {
        check_not_empty("sensors", self.sensors.len())?;
        for (i, of) in self.sensors.iter().enumerate() {
            force(&format!("sensors[{i}].mean_normal_force_n"), of.mean_normal_force_n)?;
        }
        Ok(())
    }
}

/// Comparison of the model's slopes with measured ones.
#[derive(Clone, Debug, PartialEq)]
pub struct SlopeComparison {
    /// Measured slopes, counts per N.
    pub measured: [f64; ELECTRODES],
    /// Slopes of the model, counts per N.
    pub model: [f64; ELECTRODES],
}

impl SlopeComparison {
    /// Returns Pearson's correlation over the electrodes.
    pub fn correlation(&self) -> f64 {
        let about_mean = |all: &[f64; ELECTRODES]| {
            let mean = all.iter().sum::<f64>() / ELECTRODES as f64;
            all.map(|slope| slope - mean)
        };
        let [measured, model] = [&self.measured, &self.model].map(about_mean);
        dot(&measured, &model) / (dot(&measured, &measured) * dot(&model, &model)).sqrt()
    }

    /// Returns the smallest and largest ratio of the model's slope to the measured one, over the
    /// eight electrodes with the largest measured slopes.
    pub fn ratios(&self) -> [f64; 2] {
        let mut order: Vec<usize> = (0..ELECTRODES).collect();
        order.sort_by(|&a, &b| self.measured[b].abs().total_cmp(&self.measured[a].abs()));
        let ratios = order.iter().take(LARGEST).map(|&i| self.model[i] / self.measured[i]);
        ratios.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], ratio| {
            [least.min(ratio), most.max(ratio)]
        })
    }

    /// Returns the factor on the model's slopes that fits best (least squares).
    pub fn scale(&self) -> f64 {
        dot(&self.measured, &self.model) / dot(&self.model, &self.model)
    }
}

/// Comparison for a sensor under tangential force.
#[derive(Clone, Debug)]
pub struct ShearComparison {
    /// Name of the sensor.
    pub sensor: String,
    /// Comparison under force along y of `T`.
    pub lateral: SlopeComparison,
    /// Comparison under force along x of `T`.
    pub axial: SlopeComparison,
}

/// Compares the model with the measured slopes of a sensor, in the session that fits its
/// `recording` under normal force. Nothing is fitted to the slopes: the finger does not roll under
/// shear.
///
///
/// The errors of [`fit`].
/// The errors of [`fit`].
pub fn compare(
    model: &FingerConstants,
    friction: &FrictionEffect,
    recording: &PlateRecording,
    sheared: &ShearRecording,
) -> Result<ShearComparison, FitError> {
    let own = fit(model, &[recording], FreeParameters::Sessions)?;
    let session = own.sessions.first().ok_or(FitError::Empty)?;
    let force_n = sheared.mean_normal_force_n;
    let against = |axis: Vector3<f64>, measured: &[f64; ELECTRODES]| {
        let model = slopes(model, friction, session, recording, force_n, &axis);
        Ok(SlopeComparison { measured: *measured, model: model.ok_or(FitError::NotFinite)? })
    };
    Ok(ShearComparison {
        sensor: sheared.sensor.clone(),
        lateral: against(Vector3::y(), &sheared.counts_per_n_lateral)?,
        axial: against(Vector3::x(), &sheared.counts_per_n_axial)?,
    })
}

/// Returns the counts per N of tangential force on the finger along `axis_t`; `None` if a pose has
/// no solution.
fn slopes(
    model: &FingerConstants,
    friction: &FrictionEffect,
    session: &Session,
    recording: &PlateRecording,
    force_n: f64,
    axis_t: &Vector3<f64>,
) -> Option<[f64; ELECTRODES]> {
    let mut bench = PlateRig::default();
    let samples = bench.set_skin(model)?;
    let electrodes = Electrodes::new(&session.electrodes(model, recording), samples, 1.0);
    let shear = ShearCoupling::new(&electrodes, samples);
    let mut counts = |aside_n: f64| {
        let carry = |towards_t: &Vector3<f64>, closed: &mut [f64; ELECTRODES]| {
            let along_t = (axis_t - towards_t * towards_t.dot(axis_t)).normalize();
            shear.add(&(along_t * (aside_n / friction.stiffness_n_m)), closed);
        };
        let roll_rad = session.mean_roll_rad();
        session.mean_counts([force_n, roll_rad], &electrodes, &carry, &mut bench)
    };
    let (more, less) = (counts(ASIDE_N)?, counts(-ASIDE_N)?);
    Some(std::array::from_fn(|i| (more[i] - less[i]) / (2.0 * ASIDE_N)))
}

fn dot(a: &[f64; ELECTRODES], b: &[f64; ELECTRODES]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
