//! How a body with masses is integrated over time.

use super::collision::{Collision, Sdf};
use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Longest step: the servos' gains are chosen for it (`models/pa10/SOURCE.md`).
const LONGEST_STEP_S: f64 = 0.002;

/// Longest step of an [explicit](Integrator::is_explicit) integrator with an arm. The largest rate
/// of the PA-10's servos, the largest eigenvalue of M⁻¹ diag(kv), is 1740 /s (link set A: 1890 /s)
/// over 3000 random postures (`tests/suite/rigid.rs`); Euler's steps are stable below 2 over that, Runge
/// and Kutta's below 2.79.
const LONGEST_EXPLICIT_STEP_S: f64 = 0.001;

/// How far a control period may be off a whole number of steps, in steps (chosen: rounding).
const ROUNDING: f64 = 1e-6;

/// Table `[solver]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SolverSettings {
    /// Time step; a control period is one or several. The force of the skin is that of the step's
    /// start.
    pub step_s: f64,
    /// How a step is made.
    pub integrator: Integrator,
    /// As what MuJoCo lets a finger without skin, or the links of `[effects.collision]`, meet the
    /// object; left out, the default of [`Collision`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collision: Option<Collision>,
    /// How `collision = "sdf"` looks for contact; left out, the default of [`Sdf`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sdf: Option<Sdf>,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            step_s: LONGEST_STEP_S,
            integrator: Integrator::default(),
            collision: None,
            sdf: None,
        }
    }
}

/// MuJoCo's integrators that step rigid bodies. All are of first order here, whatever their own
/// order: skin and servo integral are held through a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Integrator {
    /// Implicit in the joints' velocities but for Coriolis and centripetal forces.
    #[default]
    ImplicitFast,
    /// Implicit in the joints' velocities.
    Implicit,
    /// Semi-implicit: explicit in the servos' damping, implicit in the joints' own.
    Euler,
    /// Runge and Kutta's of fourth order: explicit.
    Rk4,
}

impl Integrator {
    /// As a scene file names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::ImplicitFast => "implicitfast",
            Self::Implicit => "implicit",
            Self::Euler => "euler",
            Self::Rk4 => "rk4",
        }
    }
}

impl Integrator {
    /// Whether a servo too stiff for the step makes it unstable.
    pub fn is_explicit(self) -> bool {
        matches!(self, Self::Euler | Self::Rk4)
    }
}

impl SolverSettings {
    /// The longest step with an arm; the stage's servos, 740 /s, bear any.
    pub fn longest_step_s(&self) -> f64 {
        match self.integrator.is_explicit() {
            true => LONGEST_EXPLICIT_STEP_S,
            false => LONGEST_STEP_S,
        }
    }

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
        if let Some(sdf) = &self.sdf {
            let searched = self.collision == Some(Collision::Sdf);
            rules.require("sdf", "(given)", searched, || {
                "no table: only collision = \"sdf\" searches for contact".into()
            });
            rules.table("sdf", sdf);
        }
    }
}
