//! Errors of a force/torque sensor, from touches whose points of contact are known.

use crate::robot::sensor::Wrench;
use nalgebra::{DVector, Point3, SVector, Vector3};
use palpate_gp::math::least_squares::{Problem, fit};

/// Number of errors: force and torque that the tare leaves, and the offset of the sensor's origin.
const ERRORS: usize = 9;

/// Plausible force, torque and offset, and the expected scatter of a torque; heuristics.
const BIAS_N: f64 = 0.5;
const BIAS_NM: f64 = 0.02;
const OFFSET_M: f64 = 0.01;
const SCATTER_NM: f64 = 1e-3;

/// Standard deviations that count as an error, and the smallest offset that is reported.
// heuristic: one false alarm in several hundred registrations, and what a mount is machined to.
const SIGMAS: f64 = 4.0;
const LEAST_M: f64 = 5e-4;

/// Errors of the loads that a force/torque sensor reports relative to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchErrors {
    /// Bias that remains after the tare, in `T`.
    pub bias: Wrench,
    /// Standard deviations of force and torque.
    pub bias_sds: [Vector3<f64>; 2],
    /// Offset of the point about which the torque is measured from where it should be, in `T`, m.
    pub offset_m: Vector3<f64>,
    /// Its standard deviation.
    pub offset_sd_m: Vector3<f64>,
}

impl WrenchErrors {
    /// Finds the errors from points of contact and the loads there, in `T`. A load with bias
    /// (f_b, τ_b) whose torque is measured about a point that is off by −δ satisfies
    /// τ − τ_b = (p + δ) × (f − f_b) at the point p. Returns `None` if the touches do not determine
    /// all errors.
    pub fn find(touches: &[(Point3<f64>, Wrench)]) -> Option<Self> {
        let solution = fit(&WrenchFit { touches }, &SVector::zeros()).ok()?;
        if !solution.undetermined.is_empty() || touches.len() <= ERRORS {
            return None;
        }
        let units = units();
        let sds =
            SVector::<f64, ERRORS>::from_fn(|i, _| units[i] * solution.covariance[(i, i)].sqrt());
        let part = |of: &SVector<f64, ERRORS>, row: usize| of.fixed_rows::<3>(row).into_owned();
        let found = &solution.state;
        Some(Self {
            bias: Wrench { force_n: part(found, 0), torque_nm: part(found, 3) },
            bias_sds: [part(&sds, 0), part(&sds, 3)],
            offset_m: part(found, 6),
            offset_sd_m: part(&sds, 6),
        })
    }

    /// Returns what is wrong with the sensor in words, if it is more than its uncertainty.
    pub fn remark(&self) -> Option<String> {
        let exceeds = |value: &Vector3<f64>, sd: &Vector3<f64>| {
            value.iter().zip(sd).any(|(value, sd)| value.abs() > SIGMAS * sd)
        };
        let words = |value: &Vector3<f64>, unit: f64| {
            value.iter().map(|v| format!("{:.2}", v * unit)).collect::<Vec<_>>().join(", ")
        };
        let mut remarks = Vec::new();
        if self.offset_m.amax() > LEAST_M && exceeds(&self.offset_m, &self.offset_sd_m) {
            remarks.push(format!(
                "its torques are about a point that is off by ({}) mm in the tip's frame; they \
                 must be about the end of the mount",
                words(&self.offset_m, 1e3)
            ));
        }
        let [force_sd, torque_sd] = &self.bias_sds;
        if exceeds(&self.bias.force_n, force_sd) || exceeds(&self.bias.torque_nm, torque_sd) {
            remarks.push(format!(
                "({}) N and ({}) mNm remain after the tare",
                words(&self.bias.force_n, 1.0),
                words(&self.bias.torque_nm, 1e3)
            ));
        }
        let all = remarks.join("; ");
        (!all.is_empty())
            .then(|| format!("the force/torque sensor disagrees with the touches: {all}"))
    }
}

/// Returns the plausible value of each error.
fn units() -> [f64; ERRORS] {
    std::array::from_fn(|i| [BIAS_N, BIAS_NM, OFFSET_M][i / 3])
}

struct WrenchFit<'a> {
    touches: &'a [(Point3<f64>, Wrench)],
}

impl Problem for WrenchFit<'_> {
    type State = SVector<f64, ERRORS>;

    fn parameters(&self) -> usize {
        ERRORS
    }

    fn moved(&self, state: &Self::State, step: &DVector<f64>) -> Self::State {
        let units = units();
        SVector::from_fn(|i, _| state[i] + units[i] * step[i])
    }

    /// Returns the torques that remain about each point of contact.
    fn residuals(&self, state: &Self::State) -> DVector<f64> {
        let [force_n, torque_nm, offset_m] =
            [0, 3, 6].map(|row| state.fixed_rows::<3>(row).into_owned());
        let left = self.touches.iter().flat_map(|(p, load)| {
            let left =
                load.torque_nm - torque_nm - (p.coords + offset_m).cross(&(load.force_n - force_n));
            <[f64; 3]>::from(left / SCATTER_NM)
        });
        DVector::from_iterator(3 * self.touches.len(), left)
    }
}
