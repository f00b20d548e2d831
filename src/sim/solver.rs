//! How a body with masses is integrated over time.

use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Longest step: the servos' gains are chosen for it (`models/pa10/SOURCE.md`).
const LONGEST_STEP_S: f64 = 0.002;

/// Longest step of an [explicit](Integrator::is_explicit) integrator with an arm. The largest rate
/// of the PA-10's servos, the largest eigenvalue of M⁻¹ diag(kv), is 1740 /s (link set A: 1890 /s)
/// over 3000 random postures (`tests/suite/rigid.rs`); Euler's steps are stable below 2 over that,
/// Runge and Kutta's below 2.79.
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

    /// Whether a servo too stiff for the step makes it unstable.
    fn is_explicit(self) -> bool {
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

/// As what the object is met by a finger without skin, which MuJoCo lets collide;
/// `docs/physics.md` says how exact each is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Collision {
    /// A height field over the zone, from rays along the approach onto the mesh.
    #[default]
    HeightField,
    /// The mesh's convex hull.
    Hull,
    /// The mesh's signed distance field, interpolated in an octree.
    Sdf,
}

impl Collision {
    /// As a scene file names it.
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
    /// Most iterations of one descent.
    pub iterations: u32,
    /// Places where descents begin; as many contacts at most.
    pub initpoints: u32,
}

impl Default for Sdf {
    /// MuJoCo's own.
    fn default() -> Self {
        Self { iterations: 10, initpoints: 40 }
    }
}

impl Checked for Sdf {
    fn check(&self, rules: &mut Rules) {
        let Self { iterations, initpoints } = *self;
        for (key, value) in [("iterations", iterations), ("initpoints", initpoints)] {
            rules.require(key, value, (1..=1000).contains(&value), || "1 to 1000".into());
        }
    }
}
