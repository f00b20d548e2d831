//! What MuJoCo compiles of an environment, once for all trials, and how finely the scene's time
//! step is divided for the skin's force.

use super::{Plant, compile, lacking};
use crate::sim::Environment;
use crate::sim::environment::{Shape, invalid};
use crate::sim::finger::plate;
use crate::sim::mjcf::{self, Mode};
use crate::sim::solver::Collision;
use mujoco_rs::wrappers::MjModel;
use palpate_input::error::Invalid;
use std::fmt::{Display, Formatter, Result as Written};
use std::sync::Arc;

/// Shared by the trials of an experiment.
#[derive(Clone, Debug)]
pub struct Models {
    /// The arm or stage.
    pub plant: Arc<MjModel>,
    /// How the scene's time step was divided, and why; none if it was not.
    pub substeps: Option<Substeps>,
}

impl Models {
    /// With the scene's time step, or part of it where that is too long for the skin.
    ///
    /// # Errors
    /// If MuJoCo refuses the scene, no step is short enough for its skin, or the object has no
    /// inside where the scene's collision needs one.
    pub fn new(environment: &Environment) -> Result<Self, Invalid> {
        let step_s = environment.scene().solver.step_s;
        let whole = Self::at(environment, step_s)?;
        let Some(limit) = StepLimit::of(environment, &whole.plant)? else { return Ok(whole) };
        match limit.limit_s {
            limit_s if step_s <= limit_s => Ok(whole),
            limit_s if limit_s >= SHORTEST_S => {
                let count = (step_s / limit_s).ceil() as u32;
                let divided = Self::at(environment, step_s / f64::from(count))?;
                Ok(Self { substeps: Some(Substeps { count, step_s, limit }), ..divided })
            }
            _ => Err(Invalid::new(format!(
                "solver.step_s = {step_s} is too long, and cannot be divided so finely: {limit}"
            ))),
        }
    }

    /// With a time step of `step_s`, whatever the skin needs.
    ///
    /// # Errors
    /// If MuJoCo refuses the scene, or the object has no inside where the scene's collision needs
    /// one.
    pub fn at(environment: &Environment, step_s: f64) -> Result<Self, Invalid> {
        check_inside(environment)?;
        let text = mjcf::scene(environment, Mode::Dynamic { step_s });
        let plant = Arc::new(compile(&text.ok_or_else(|| lacking("an object"))?)?);
        Ok(Self { plant, substeps: None })
    }
}

/// Without an inside a distance has no sign.
fn check_inside(environment: &Environment) -> Result<(), Invalid> {
    let Shape::Mesh { report, .. } = environment.shape() else { return Ok(()) };
    let edges = report.border_edges.count + report.non_manifold_edges.count;
    match environment.scene().solver.collision {
        Some(Collision::Sdf) if edges > 0 => Err(Invalid::new(format!(
            "solver.collision = \"sdf\" needs a closed mesh, but this one has {edges} edges that are \
             not shared by two triangles"
        ))),
        _ => Ok(()),
    }
}

/// Shortest step, that of a scene.
const SHORTEST_S: f64 = 1e-5;

/// A division of the time step, and why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Substeps {
    /// Steps in one of the scene's.
    pub count: u32,
    /// The scene's step.
    pub step_s: f64,
    /// The longest that is stable.
    pub limit: StepLimit,
}

/// What limits a step at whose start the skin's force is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimit {
    /// Largest force of a touch.
    pub force_n: f64,
    /// Largest stiffness of the skin up to that force.
    pub stiffness_n_m: f64,
    /// Smallest mass that the fingertip moves with.
    pub mass_kg: f64,
    /// √(mass / stiffness).
    pub limit_s: f64,
}

impl StepLimit {
    /// Of a model of `environment`; none without a skin.
    ///
    /// A force that is explicit in the position of a mass m is stable in steps below `2 √(m / k)`;
    /// half of that is the limit, because a hollow object presses more skin at once than the
    /// flat plate on which k is measured.
    ///
    /// # Errors
    /// If the model is not one of a robot with a finger.
    pub fn of(environment: &Environment, model: &Arc<MjModel>) -> Result<Option<Self>, Invalid> {
        let scene = environment.scene();
        let skin = environment.fingertip().and_then(|tip| tip.skin());
        let (Some(skin), Some(chain)) = (skin, environment.chain()) else { return Ok(None) };
        let mut plant = Plant::new(Arc::clone(model)).map_err(invalid)?;
        plant.reset(chain.start()).map_err(|_| lacking("a home"))?;
        let mass_kg = plant.tip_mass_kg();
        let towards_t = scene.finger.ahead_t();
        let force_n = scene.touch.force_limit_n;
        let stiffness_n_m = plate::largest_stiffness_n_m(skin, &towards_t, force_n);
        let limit_s = (mass_kg / stiffness_n_m).sqrt();
        Ok(Some(Self { force_n, stiffness_n_m, mass_kg, limit_s }))
    }
}

impl Display for StepLimit {
    fn fmt(&self, f: &mut Formatter<'_>) -> Written {
        let Self { force_n, stiffness_n_m, mass_kg, limit_s } = self;
        write!(
            f,
            "up to {force_n} N (touch.force_limit_n) the skin is as stiff as {stiffness_n_m:.0} N/m and the \
             fingertip as light as {mass_kg:.3} kg, which needs at most {limit_s:.2e} s"
        )
    }
}

impl Display for Substeps {
    fn fmt(&self, f: &mut Formatter<'_>) -> Written {
        let Self { count, step_s, limit } = self;
        write!(f, "solver.step_s = {step_s} is divided by {count}: {limit}")
    }
}
