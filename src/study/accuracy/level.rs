//! Fidelity levels: named changes to a scene, from a swept hull to a fine skin at a fine time step.

use crate::sim::Scene;
use crate::sim::finger::effects::skin::SkinModel;
use crate::sim::scene::SimulatorKind;
use crate::sim::solver::Collision;
use crate::sim::solver::Integrator;
use serde::Serialize;

/// Part of the finger that a level simulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FingerModel {
    /// Rigid hull.
    Rigid,
    /// Soft skin without fluid; the contact point is exact.
    Dry,
    /// Skin and fluid, whose pressure detects contact.
    Fluid,
    /// Skin, fluid and electrodes, which locate contact.
    Full,
}

/// A fidelity level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FidelityLevel {
    /// Simulator.
    pub body: SimulatorKind,
    /// Simulated part of the finger.
    pub senses: FingerModel,
    /// Points of the skin's foundation; 0 for another skin model.
    pub samples: usize,
    /// Cells along and around a thin-shell skin.
    pub shell: Option<[usize; 2]>,
    /// Duration in s of a control tick, and of a step of a simulation with masses.
    pub period_s: f64,
    /// Integrator of a simulation with masses.
    pub integrator: Integrator,
    /// Collision geometry of a rigid finger with masses.
    pub collision: Option<Collision>,
    /// Whether a PA-10 carries the finger; otherwise the scene's arm does.
    pub on_pa10: bool,
}

/// Fastest approach of a rigid finger with masses: above about 5 mm/s it ends in an overload even
/// if stopped at once (`docs/physics.md`).
const RIGID_APPROACH_M_S: f64 = 0.005;

const fn kinematic(senses: FingerModel, samples: usize, period_s: f64) -> FidelityLevel {
    FidelityLevel::new(SimulatorKind::Kinematic, senses, samples, period_s)
}

const fn dynamic(samples: usize, period_s: f64) -> FidelityLevel {
    FidelityLevel::new(SimulatorKind::Dynamic, FingerModel::Full, samples, period_s)
}

const fn rigid(collision: Collision) -> FidelityLevel {
    let level = FidelityLevel::new(SimulatorKind::Dynamic, FingerModel::Rigid, 0, 0.002);
    FidelityLevel { collision: Some(collision), ..level }
}

const fn shell(cells: [usize; 2], period_s: f64) -> FidelityLevel {
    FidelityLevel { shell: Some(cells), ..kinematic(FingerModel::Full, 0, period_s) }
}

/// All levels. The last six approach the last, the reference, in points and time step together;
/// their distances from it show whether they converge. They start with ticks shorter than a tactile
/// frame, because longer ticks see every frame at the instant of sampling.
pub const LEVELS: &[FidelityLevel] = &[
    FidelityLevel::new(SimulatorKind::Swept, FingerModel::Rigid, 0, 0.01),
    rigid(Collision::Hull),
    rigid(Collision::HeightField),
    rigid(Collision::Sdf),
    kinematic(FingerModel::Dry, 60, 0.01),
    kinematic(FingerModel::Dry, 125, 0.01),
    kinematic(FingerModel::Dry, 500, 0.01),
    kinematic(FingerModel::Dry, 2000, 0.01),
    kinematic(FingerModel::Fluid, 125, 0.01),
    kinematic(FingerModel::Fluid, 500, 0.01),
    kinematic(FingerModel::Fluid, 2000, 0.01),
    kinematic(FingerModel::Full, 60, 0.01),
    kinematic(FingerModel::Full, 125, 0.01),
    kinematic(FingerModel::Full, 250, 0.01),
    kinematic(FingerModel::Full, 500, 0.02),
    kinematic(FingerModel::Full, 500, 0.01),
    kinematic(FingerModel::Full, 500, 0.005),
    kinematic(FingerModel::Full, 500, 0.002),
    kinematic(FingerModel::Full, 500, 0.001),
    dynamic(500, 0.002),
    FidelityLevel { on_pa10: true, ..dynamic(500, 0.002) },
    dynamic(500, 0.001),
    FidelityLevel { integrator: Integrator::Implicit, ..dynamic(500, 0.001) },
    FidelityLevel { integrator: Integrator::Euler, ..dynamic(500, 0.001) },
    FidelityLevel { integrator: Integrator::Rk4, ..dynamic(500, 0.001) },
    dynamic(500, 0.0005),
    shell([12, 8], 0.01),
    shell([24, 16], 0.01),
    shell([24, 16], 0.002),
    shell([36, 24], 0.002),
    kinematic(FingerModel::Full, 1000, 0.005),
    kinematic(FingerModel::Full, 2000, 0.002),
    kinematic(FingerModel::Full, 4000, 0.001),
    kinematic(FingerModel::Full, 8000, 0.0005),
    kinematic(FingerModel::Full, 16000, 0.00025),
    kinematic(FingerModel::Full, 32000, 0.00025),
];

/// Levels that converge to the reference.
pub fn converging() -> impl Iterator<Item = FidelityLevel> {
    LEVELS[LEVELS.len() - 6..LEVELS.len() - 1].iter().copied()
}

impl FidelityLevel {
    /// Creates a level with the settings that every simulator has.
    pub const fn new(
        body: SimulatorKind,
        senses: FingerModel,
        samples: usize,
        period_s: f64,
    ) -> Self {
        Self {
            body,
            senses,
            samples,
            shell: None,
            period_s,
            integrator: Integrator::ImplicitFast,
            collision: None,
            on_pa10: false,
        }
    }

    /// Whether this build can simulate the level.
    pub fn is_built(&self) -> bool {
        cfg!(feature = "mujoco") || self.body != SimulatorKind::Dynamic
    }

    /// Returns `scene` with this level's changes; other settings are kept.
    pub fn apply(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        scene.simulator = self.body;
        scene.touch.period_s = Some(self.period_s);
        let solver = &mut scene.solver;
        if self.body == SimulatorKind::Dynamic {
            solver.step_s = self.period_s;
            solver.integrator = self.integrator;
        }
        solver.collision = self.collision;
        solver.sdf = solver.sdf.take().filter(|_| self.collision == Some(Collision::Sdf));
        if self.on_pa10 {
            scene.arm.get_or_insert_default();
        }
        if self.collision.is_some() {
            scene.touch.approach_m_s = RIGID_APPROACH_M_S;
        }
        let effects = &mut scene.effects;
        set_effect(&mut effects.skin, self.senses != FingerModel::Rigid);
        set_effect(&mut effects.fluid, self.senses >= FingerModel::Fluid);
        set_effect(&mut effects.electrodes, self.senses == FingerModel::Full);
        match (&mut effects.skin, self.shell) {
            (Some(skin), Some(cells)) => {
                skin.model = SkinModel::Shell;
                [skin.cells_along, skin.cells_around] = cells;
            }
            (Some(skin), None) => {
                skin.model = SkinModel::Columns;
                skin.samples = self.samples;
            }
            (None, _) => *effects = Default::default(),
        }
        if !effects.sends_frames() {
            effects.timing = None;
        }
        scene
    }

    /// Name in tables.
    pub fn name(&self) -> String {
        let mut words = vec![self.body.name().to_string()];
        if self.body != SimulatorKind::Swept {
            words.push(self.senses.name().into());
            words.extend(self.collision.map(|collision| collision.name().into()));
            words.extend((self.samples > 0).then(|| self.samples.to_string()));
            words.extend(self.shell.map(|[along, around]| format!("shell {along} × {around}")));
            words.push(format!("{} ms", 1e3 * self.period_s));
        }
        if self.integrator != Integrator::default() {
            words.push(self.integrator.name().into());
        }
        if self.on_pa10 {
            words.push("PA-10".into());
        }
        words.extend(self.collision.map(|_| format!("at {} mm/s", 1e3 * RIGID_APPROACH_M_S)));
        words.join(" ")
    }
}

impl FingerModel {
    /// Name in tables and legends.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rigid => "rigid",
            Self::Dry => "dry",
            Self::Fluid => "fluid",
            Self::Full => "full",
        }
    }
}

fn set_effect<T: Default>(effect: &mut Option<T>, wanted: bool) {
    *effect = wanted.then(|| effect.take().unwrap_or_default());
}
