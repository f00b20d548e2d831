//! Time integration of a simulation with masses.

use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Longest step: the servo gains are tuned for it (`models/pa10/SOURCE.md`).
const LONGEST_STEP_S: f64 = 0.002;

/// Longest step of an [explicit](Integrator::is_explicit) integrator with an arm. The largest rate
/// of the PA-10's servos, the largest eigenvalue of M⁻¹ diag(kv), is 1740 /s (link set A: 1890 /s)
/// over 3000 random postures (`tests/suite/rigid.rs`). Euler steps are stable below 2 over that
/// rate, Runge–Kutta steps below 2.79.
const LONGEST_EXPLICIT_STEP_S: f64 = 0.001;

// heuristic: largest rounding error of a control period, in steps.
const ROUNDING: f64 = 1e-6;

/// Settings of the table `[solver]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SolverSettings {
    /// Time step, s; a control period is a whole number of steps. The skin's force is constant in a
    /// step.
    pub step_s: f64,
    /// Integrator.
    pub integrator: Integrator,
    /// Collision geometry of the object for parts that MuJoCo lets collide; default:
    /// `height_field`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collision: Option<Collision>,
    /// Contact search of `collision = "sdf"`; default: that of MuJoCo.
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

/// MuJoCo's integrators of rigid bodies. Here all are of first order, whatever their own order:
/// skin force and servo integral are constant during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Integrator {
    /// Implicit in the joint velocities except for Coriolis and centripetal forces.
    #[default]
    ImplicitFast,
    /// Implicit in the joint velocities.
    Implicit,
    /// Semi-implicit: explicit in the servos' damping, implicit in the joints' own.
    Euler,
    /// Explicit Runge–Kutta method of fourth order.
    Rk4,
}

impl Integrator {
    /// Returns the name used in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::ImplicitFast => "implicitfast",
            Self::Implicit => "implicit",
            Self::Euler => "euler",
            Self::Rk4 => "rk4",
        }
    }

    /// Returns whether a servo that is too stiff for the step makes it unstable.
    fn is_explicit(self) -> bool {
        matches!(self, Self::Euler | Self::Rk4)
    }
}

impl SolverSettings {
    /// Returns the longest step with an arm; the stage's servos, 740 /s, allow any.
    pub fn longest_step_s(&self) -> f64 {
        match self.integrator.is_explicit() {
            true => LONGEST_EXPLICIT_STEP_S,
            false => LONGEST_STEP_S,
        }
    }

    /// Returns the number of steps in `period_s`, or `None` if it is not whole.
    pub fn steps(&self, period_s: f64) -> Option<u32> {
        let steps = period_s / self.step_s;
        let whole = steps.round();
        ((whole - steps).abs() <= ROUNDING && whole >= 1.0).then_some(whole as u32)
    }
}

impl Validate for SolverSettings {
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

/// Collision geometry of the object for a rigid finger in MuJoCo; `docs/physics.md` states the
/// accuracy of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Collision {
    /// Height field over the zone, from rays along the approach onto the mesh.
    #[default]
    HeightField,
    /// Convex hull of the mesh.
    Hull,
    /// Signed distance field of the mesh, interpolated in an octree.
    Sdf,
}

impl Collision {
    /// Returns the name used in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::HeightField => "height_field",
            Self::Hull => "hull",
            Self::Sdf => "sdf",
        }
    }
}

/// Table `[solver.sdf]`: contact with a signed distance field is searched by gradient descent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Sdf {
    /// Largest number of iterations of one descent.
    pub iterations: u32,
    /// Number of starting points of descents, and largest number of contacts.
    pub initpoints: u32,
}

impl Default for Sdf {
    /// Returns MuJoCo's defaults.
    fn default() -> Self {
        Self { iterations: 10, initpoints: 40 }
    }
}

impl Validate for Sdf {
    fn check(&self, rules: &mut Rules) {
        let Self { iterations, initpoints } = *self;
        for (key, value) in [("iterations", iterations), ("initpoints", initpoints)] {
            rules.require(key, value, (1..=1000).contains(&value), || "1 to 1000".into());
        }
    }
}
