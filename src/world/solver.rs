//! How a body with masses is integrated over time.

use crate::ground::config::{Checked, Rules};
use serde::{Deserialize, Serialize};

/// Longest step: the servos' gains are chosen for it (`models/pa10/SOURCE.md`).
const LONGEST_STEP_S: f64 = 0.002;

/// How far a control period may be off a whole number of steps, in steps (chosen: rounding).
const ROUNDING: f64 = 1e-6;

/// Table `[solver]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SolverSettings {
    /// Time step; a control period is one or several. Steps are implicit in the joints'
    /// velocities (MuJoCo's `implicitfast`), which the servos need; the force of the skin is that
    /// of the step's start.
    pub step_s: f64,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self { step_s: LONGEST_STEP_S }
    }
}

impl SolverSettings {
    /// Steps in `period_s`, or none if they are not a whole number.
    pub fn steps(&self, period_s: f64) -> Option<u32> {
        let steps = period_s / self.step_s;
        let whole = steps.round();
        ((whole - steps).abs() <= ROUNDING && whole >= 1.0).then_some(whole as u32)
    }
}

impl Checked for SolverSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("step_s", self.step_s, 1e-5..=LONGEST_STEP_S);
    }
}
