//! The fit itself, with how sure it is.

use super::constants::{Constant, Model};
use super::problem::Calibration;
use super::session::Session;
use crate::sim::finger::recording::Recording;
use nalgebra::DVector;
use palpate_gp::math::least_squares::{FitError, Problem, clustered_covariance, robust};

/// Besides from where it starts, a fit is tried from skins this many times softer: a stiff skin
/// and a soft one are two valleys (chosen).
const SOFTER: [f64; 2] = [1.0, 10.0];

/// What a fit may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Free {
    /// Only what belongs to the sessions: a test of the constants.
    Sessions,
    /// The constants too.
    Constants,
}

/// A constant as the recordings give it.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Its key in a scene's `[effects]`.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// One standard deviation up multiplies it by this; electrodes of one session err together.
    pub factor: f64,
}

/// A constant that ran to where it may go no farther, and was put back to its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Its key in a scene's `[effects]`.
    pub key: &'static str,
    /// Where it ran to.
    pub bound: f64,
    /// What it keeps.
    pub kept: f64,
}

/// Constants and sessions.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// With the constants found.
    pub model: Model,
    /// One for each recording.
    pub sessions: Vec<Session>,
    /// The constants that are determined.
    pub estimates: Vec<Estimate>,
    /// Those that are not.
    pub refused: Vec<Refused>,
}

/// Fits `free` to the recordings together, from `start`.
///
/// Errors beyond 1.3 of the expected count with their amount (Huber), so that no electrode decides
/// alone. Constants at a bound are put back and the rest is fitted again.
///
/// # Errors
/// If there is no recording, or no step helps.
pub fn fit(start: &Model, recordings: &[&Recording], free: Free) -> Result<Fit, FitError> {
    let mut constants: Vec<&'static Constant> = match free {
        Free::Sessions => Vec::new(),
        Free::Constants => start.constants().iter().collect(),
    };
    let mut refused = Vec::new();
    loop {
        let problem = Calibration::new(start, constants.clone(), recordings);
        let state = lowest(&problem)?;
        let (model, sessions) = problem.decode(&state);
        let at_bound = |constant: &&&Constant| constant.bounds.contains(&constant.value(&model));
        if let Some(&lost) = constants.iter().find(at_bound) {
            refused.push(Refused {
                key: lost.key,
                bound: lost.value(&model),
                kept: lost.value(start),
            });
            constants.retain(|constant| constant.key != lost.key);
            continue;
        }
        let estimates = estimates(&problem, &state, &model);
        return Ok(Fit { model, sessions, estimates, refused });
    }
}

/// The best of the fits from stiff and from soft skins.
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

fn estimates(problem: &Calibration, state: &DVector<f64>, model: &Model) -> Vec<Estimate> {
    let covariance = clustered_covariance(problem, state, |i| problem.electrode(i));
    let of = |(i, constant): (usize, &&'static Constant)| {
        let variance = covariance.as_ref().map_or(f64::INFINITY, |all| all[(i, i)]);
        Estimate {
            key: constant.key,
            value: constant.value(model),
            factor: (constant.plausible * variance.max(0.0).sqrt()).exp(),
        }
    };
    problem.free.iter().enumerate().map(of).collect()
}
