//! Compiled MuJoCo models of an environment, shared by all trials, and the substeps that the skin's
//! stiffness requires.

use super::{Plant, compile, lacking};
use crate::Environment;
use crate::environment::{ObjectShape, invalid};
use crate::finger::plate;
use crate::mjcf::{self, ModelPurpose};
use crate::solver::Collision;
use mujoco_rs::wrappers::MjModel;
use palpate_input::error::InputError;
use std::fmt::{Display, Formatter, Result as Written};
use std::sync::Arc;

/// Compiled models, shared by the trials of an experiment.
#[derive(Clone, Debug)]
pub struct CompiledModels {
    /// Model of the arm or stage.
    pub plant: Arc<MjModel>,
    /// Division of the scene's time step, with its reason; `None` if it was not divided.
    pub substeps: Option<Substeps>,
}

impl CompiledModels {
    /// Compiles the models with the scene's time step, or a fraction of it if that is too long for
    /// the skin.
    ///
    /// # Errors
    /// If MuJoCo refuses the scene, no step is short enough for its skin, or the scene's collision
    /// needs a closed mesh and the object has none.
    pub fn new(environment: &Environment) -> Result<Self, InputError> {
        let step_s = environment.scene().solver.step_s;
        let whole = Self::with_step(environment, step_s)?;
        let Some(limit) = StepLimit::of(environment, &whole.plant)? else { return Ok(whole) };
        match limit.limit_s {
            limit_s if step_s <= limit_s => Ok(whole),
            limit_s if limit_s >= SHORTEST_S => {
                let count = (step_s / limit_s).ceil() as u32;
                let divided = Self::with_step(environment, step_s / f64::from(count))?;
                Ok(Self { substeps: Some(Substeps { count, step_s, limit }), ..divided })
            }
            _ => Err(InputError::new(format!(
                "solver.step_s = {step_s} is too long, and no allowed substep is short enough: {limit}"
            ))),
        }
    }

    /// Compiles the models with a time step of `step_s`, without the limit of the skin.
    ///
    /// # Errors
    /// If MuJoCo refuses the scene, or the scene's collision needs a closed mesh and the object has
    /// none.
    pub fn with_step(environment: &Environment, step_s: f64) -> Result<Self, InputError> {
        check_inside(environment)?;
        let text = mjcf::scene(environment, ModelPurpose::Dynamic { step_s });
        let plant = Arc::new(compile(&text.ok_or_else(|| lacking("an object"))?)?);
        Ok(Self { plant, substeps: None })
    }
}

/// Checks that the mesh is closed if signed distances are needed.
fn check_inside(environment: &Environment) -> Result<(), InputError> {
    let ObjectShape::Mesh { report, .. } = environment.shape() else { return Ok(()) };
    let edges = report.border_edges.count + report.non_manifold_edges.count;
    match environment.scene().solver.collision {
        Some(Collision::Sdf) if edges > 0 => Err(InputError::new(format!(
            "solver.collision = \"sdf\" needs a closed mesh, but this one has {edges} edges that are \
             not shared by two triangles"
        ))),
        _ => Ok(()),
    }
}

/// Shortest time step allowed in a scene.
const SHORTEST_S: f64 = 1e-5;

/// Division of the time step, with its reason.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Substeps {
    /// Number of substeps in one step of the scene.
    pub count: u32,
    /// Time step of the scene, s.
    pub step_s: f64,
    /// Longest stable step.
    pub limit: StepLimit,
}

/// Stability limit of a step with a skin force from the start of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimit {
    /// Largest force of a touch.
    pub force_n: f64,
    /// Largest stiffness of the skin up to that force.
    pub stiffness_n_m: f64,
    /// Smallest effective mass of the fingertip.
    pub mass_kg: f64,
    /// Longest step, √(mass / stiffness).
    pub limit_s: f64,
}

impl StepLimit {
    /// Computes the limit of a model of `environment`; `None` without a skin.
    ///
    /// A force that is explicit in the position of a mass m is stable in steps below `2 √(m / k)`.
    /// The limit is half of that, because a hollow object presses more skin at once than the flat
    /// plate on which k is measured.
    ///
    /// # Errors
    /// If the model is not one of a robot with a finger.
    pub fn of(environment: &Environment, model: &Arc<MjModel>) -> Result<Option<Self>, InputError> {
        let scene = environment.scene();
        let skin = environment.fingertip().and_then(|tip| tip.skin());
        let (Some(skin), Some(chain)) = (skin, environment.chain()) else { return Ok(None) };
        let mut plant = Plant::new(Arc::clone(model)).map_err(invalid)?;
        plant.reset(chain.start()).map_err(|_| lacking("a home"))?;
        let mass_kg = plant.tip_mass_kg();
        let towards_t = scene.finger.direction_t();
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
            "up to {force_n} N (touch.force_limit_n) the skin's stiffness is {stiffness_n_m:.0} N/m and the \
             fingertip as light as {mass_kg:.3} kg, which needs a step of at most {limit_s:.2e} s"
        )
    }
}

impl Display for Substeps {
    fn fmt(&self, f: &mut Formatter<'_>) -> Written {
        let Self { count, step_s, limit } = self;
        write!(f, "solver.step_s = {step_s} is divided by {count}: {limit}")
    }
}
