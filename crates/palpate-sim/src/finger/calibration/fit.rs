//! Least-squares fit of constants and sessions, with its uncertainty.

use super::constants::{Constant, FingerConstants};
use super::session::{PlateRig, Session};
use crate::finger::effects::skin::SkinModel;
use crate::finger::recording::PlateRecording;
use nalgebra::DVector;
use palpate_explore::robot::finger::frame::ELECTRODES;
use palpate_gp::math::least_squares::{FitError, Problem, clustered_covariance, robust};
use std::cell::RefCell;

// Softness factors of the skins from which fits start.
// heuristic: a stiff skin and a soft one are two local minima.
const SOFTER: [f64; 2] = [1.0, 10.0];

/// Parameters that a fit may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreeParameters {
    /// Only the parameters of the sessions: a test of the constants.
    Sessions,
    /// Constants and sessions.
    Constants,
}

/// Estimate of a constant from the recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstantEstimate {
    /// Key of the constant in a scene's `[effects]`.
    pub key: &'static str,
    /// Estimated value.
    pub value: f64,
    /// Standard deviation as a factor; the errors of electrodes in one session are correlated.
    pub factor: f64,
}

/// Constant that reached a bound and was reset to its start.
#[derive(Clone, Debug, PartialEq)]
pub struct UndeterminedConstant {
    /// Key of the constant in a scene's `[effects]`.
    pub key: &'static str,
    /// Bound that the constant reached.
    pub bound: f64,
    /// Value after the reset.
    pub kept: f64,
}

/// Fitted constants and sessions.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Model with the fitted constants.
    pub model: FingerConstants,
    /// Sessions, one for each recording.
    pub sessions: Vec<Session>,
    /// Constants that the recordings determine.
    pub estimates: Vec<ConstantEstimate>,
    /// Constants that the recordings do not determine.
    pub refused: Vec<UndeterminedConstant>,
}

/// Fits `free` to all recordings together, from `start`.
///
/// Errors beyond 1.3 of the expected count have a linear cost (Huber 1964), so that no electrode
/// decides alone. Constants at a bound are reset, and the rest is fitted again.
///
/// # Errors
/// If there is no recording, or no step lowers the cost.
pub fn fit(
    start: &FingerConstants,
    recordings: &[&PlateRecording],
    free: FreeParameters,
) -> Result<Fit, FitError> {
    let mut constants: Vec<&'static Constant> = match free {
        FreeParameters::Sessions => Vec::new(),
        FreeParameters::Constants => start.constants().iter().collect(),
    };
    let mut refused = Vec::new();
    loop {
        let (free, bench) = (constants.clone(), RefCell::default());
        let problem = Calibration { start, free, recordings, bench };
        let state = lowest(&problem)?;
        let (model, sessions) = problem.decode(&state);
        let at_bound = |constant: &&&Constant| constant.bounds.contains(&constant.value(&model));
        if let Some(&lost) = constants.iter().find(at_bound) {
            refused.push(UndeterminedConstant {
                key: lost.key,
                bound: lost.value(&model),
                kept: lost.value(start),
            });
            constants.retain(|constant| constant.key != lost.key);
            continue;
        }
        let covariance = clustered_covariance(&problem, &state, |i| problem.electrode(i));
        let estimate = |(i, constant): (usize, &&'static Constant)| {
            let variance = covariance.as_ref().map_or(f64::INFINITY, |all| all[(i, i)]);
            ConstantEstimate {
                key: constant.key,
                value: constant.value(&model),
                factor: (constant.plausible * variance.max(0.0).sqrt()).exp(),
            }
        };
        let estimates = constants.iter().enumerate().map(estimate).collect();
        return Ok(Fit { model, sessions, estimates, refused });
    }
}

/// Returns the best fit over starts with stiff and with soft skins.
fn lowest(problem: &Calibration) -> Result<DVector<f64>, FitError> {
    let starts = if problem.free.is_empty() { &SOFTER[..1] } else { &SOFTER[..] };
    let mut best: Option<(f64, DVector<f64>)> = None;
    let mut failed = FitError::Empty;
    for softer in starts {
        let mut start = DVector::zeros(problem.parameters());
        for (constant, units) in problem.free.iter().zip(start.iter_mut()) {
            if constant.key.starts_with("skin.") {
                *units = -softer.ln() / constant.plausible;
            }
        }
        let start = problem.moved(&start, &DVector::zeros(problem.parameters()));
        match robust(problem, &start) {
            Ok(settled) if best.as_ref().is_none_or(|(cost, _)| settled.1 < *cost) => {
                best = Some((settled.1, settled.0));
            }
            Ok(_) => {}
            Err(error) => failed = error,
        }
    }
    best.map(|(_, state)| state).ok_or(failed)
}

// heuristic: expected error of a mean count, two thirds of the mean error of the best fit.
const EXPECTED_COUNTS: f64 = 40.0;

// Largest rise of the pressure per newton from 4 to 8 N, relative to its rise over the first
// newton: the sensor's manual says that it saturates at about 2 N.
// heuristic: 15 % still counts as saturated.
const SATURATED: f64 = 0.15;

// Expected error of that fraction, for each session.
// heuristic: the manual describes another model of the sensor and gives no curve.
const SATURATION_SD: f64 = 0.015;

// heuristic: plausible standard deviations of a session: offset, as that of sensors without contact
// between sessions; gain, as the spread of the resistors; attitude, for a hand that aims at the
// pulp.
const OFFSET_LN: f64 = 0.15;
const GAIN_LN: f64 = 0.15;
const PITCH_RAD: f64 = 0.3;
const ROLL_RAD: f64 = 0.3;
/// Standard deviation of the mean roll at a load about the session's roll.
const LOAD_ROLL_RAD: f64 = 0.1;

/// Number of a session's parameters other than rolls: offset, gain, pitch.
const SHARED: usize = 3;

/// Residual of a pose without a solution, large enough that no step accepts it.
const IMPOSSIBLE: f64 = 1e6;

// Step of the finite differences, as a fraction of a unit.
// heuristic: columns are exact to rounding, a shell to a thousandth of its force.
const COLUMNS_DIFFERENCE: f64 = 1e-4;
const SHELL_DIFFERENCE: f64 = 2e-2;

// heuristic: a step with a smaller relative gain than this is the last.
const RELATIVE_GAIN_MIN: f64 = 1e-4;

/// Least-squares problem of the fit. Its parameters are the free constants, then each session's
/// offset, gain, pitch and rolls, all in units of their plausible deviation, 0 at the start.
struct Calibration<'a> {
    start: &'a FingerConstants,
    free: Vec<&'static Constant>,
    recordings: &'a [&'a PlateRecording],
    bench: RefCell<PlateRig>,
}

impl Calibration<'_> {
    /// Returns the model and the sessions of a parameter vector.
    fn decode(&self, state: &DVector<f64>) -> (FingerConstants, Vec<Session>) {
        let mut model = self.start.clone();
        for (constant, units) in self.free.iter().zip(state.iter()) {
            let value = constant.value(self.start) * (constant.plausible * units).exp();
            // The ends of the bounds are exact.
            let [least, most] = constant.bounds;
            constant.set(&mut model, value.clamp(least, most));
        }
        let mut rest = state.as_slice().get(self.free.len()..).unwrap_or_default();
        let mut sessions = Vec::new();
        for recording in self.recordings {
            let (own, others) = rest.split_at(SHARED + recording.near_normal_loads.len());
            rest = others;
            sessions.push(Session {
                offset: (OFFSET_LN * own[0]).exp(),
                gain: (GAIN_LN * own[1]).exp(),
                pitch_rad: PITCH_RAD * own[2],
                roll_rad: own[SHARED..].iter().map(|units| LOAD_ROLL_RAD * units).collect(),
            });
        }
        (model, sessions)
    }

    /// Returns the electrode of residual `i`, counted over all sessions; `None` for a residual of
    /// the prior.
    fn electrode(&self, i: usize) -> Option<usize> {
        let mut first = 0;
        for (number, recording) in self.recordings.iter().enumerate() {
            let count = ELECTRODES * recording.near_normal_loads.len();
            if i < first + count {
                return Some(number * ELECTRODES + (i - first) % ELECTRODES);
            }
            first += count;
        }
        None
    }

    /// Returns the errors of the counts, in units of the expected error.
    fn errors(&self, model: &FingerConstants, sessions: &[Session]) -> Option<Vec<f64>> {
        let bench = &mut *self.bench.borrow_mut();
        let mut errors = Vec::new();
        for (session, recording) in sessions.iter().zip(self.recordings) {
            let predicted = session.predict(model, recording, bench)?;
            for (bin, predicted) in recording.near_normal_loads.iter().zip(predicted) {
                let entries = predicted.iter().zip(bin.mean_counts);
                errors.extend(entries.map(|(predicted, counts)| predicted - counts));
            }
        }
        errors.iter_mut().for_each(|error| *error /= EXPECTED_COUNTS);
        Some(errors)
    }

    /// Returns the saturation residual of each session's pressure.
    fn saturation_residuals(
        &self,
        model: &FingerConstants,
        sessions: &[Session],
    ) -> Option<Vec<f64>> {
        if self.free.is_empty() {
            return Some(Vec::new());
        }
        let bench = &mut *self.bench.borrow_mut();
        let of = |session: &Session| {
            let excess = session.saturation(model, bench)? - SATURATED;
            Some(excess.max(0.0) / SATURATION_SD)
        };
        sessions.iter().map(of).collect()
    }

    /// Returns the prior residuals: deviations from the plausible values.
    fn prior_residuals(&self, state: &DVector<f64>, sessions: &[Session]) -> Vec<f64> {
        let mut doubts = state.as_slice()[..self.free.len()].to_vec();
        for session in sessions {
            let mean_rad = session.mean_roll_rad();
            doubts.extend([
                session.offset.ln() / OFFSET_LN,
                session.gain.ln() / GAIN_LN,
                session.pitch_rad / PITCH_RAD,
                mean_rad / ROLL_RAD,
            ]);
            doubts.extend(session.roll_rad.iter().map(|roll| (roll - mean_rad) / LOAD_ROLL_RAD));
        }
        doubts
    }
}

impl Problem for Calibration<'_> {
    type State = DVector<f64>;

    fn parameters(&self) -> usize {
        let loads = self.recordings.iter().map(|recording| recording.near_normal_loads.len());
        self.free.len() + loads.map(|loads| SHARED + loads).sum::<usize>()
    }

    fn moved(&self, state: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
        let mut moved = state + step;
        for (constant, units) in self.free.iter().zip(moved.iter_mut()) {
            let start = constant.value(self.start);
            let [least, most] =
                constant.bounds.map(|bound| (bound / start).ln() / constant.plausible);
            *units = units.clamp(least.min(0.0), most.max(0.0));
        }
        moved
    }

    fn residuals(&self, state: &DVector<f64>) -> DVector<f64> {
        let (model, sessions) = self.decode(state);
        let doubts = self.prior_residuals(state, &sessions);
        let found =
            self.errors(&model, &sessions).zip(self.saturation_residuals(&model, &sessions));
        let residuals = match found {
            Some((errors, unsaturated)) => [errors, unsaturated, doubts].concat(),
            None => {
                let loads = self.recordings.iter().map(|all| all.near_normal_loads.len());
                let extra = if self.free.is_empty() { 0 } else { self.recordings.len() };
                let count = ELECTRODES * loads.sum::<usize>() + extra;
                [vec![IMPOSSIBLE; count], doubts].concat()
            }
        };
        DVector::from_vec(residuals)
    }

    fn gained(&self) -> f64 {
        RELATIVE_GAIN_MIN
    }

    fn difference(&self) -> f64 {
        match self.start.skin.model {
            SkinModel::Columns => COLUMNS_DIFFERENCE,
            SkinModel::Shell => SHELL_DIFFERENCE,
        }
    }
}
