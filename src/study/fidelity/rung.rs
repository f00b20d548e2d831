//! One rung: what it changes in a scene.

use crate::sim::Scene;
use crate::sim::collision::Collision;
use crate::sim::finger::effects::skin::SkinModel;
use crate::sim::scene::Body;
use crate::sim::solver::Integrator;

/// What of the finger a rung simulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Senses {
    /// A rigid hull.
    None,
    /// A soft skin without fluid; the point of contact is exact.
    Dry,
    /// Fluid under it, whose pressure tells of contact.
    Fluid,
    /// And electrodes, which tell the place.
    Full,
}

/// One rung.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// What carries out a touch.
    pub body: Body,
    /// What of the finger is simulated.
    pub senses: Senses,
    /// Points of the skin's foundation; 0 for another skin.
    pub samples: usize,
    /// Cells along and around of a skin that is a thin shell.
    pub shell: Option<[usize; 2]>,
    /// Duration of a control tick, and of a step of a body with masses.
    pub period_s: f64,
    /// How a body with masses is integrated.
    pub integrator: Integrator,
    /// As what a rigid finger with masses meets the object.
    pub collision: Option<Collision>,
    /// Whether a PA-10 carries the finger; else what the scene has.
    pub on_pa10: bool,
    /// Speed of the approach, if not the scene's.
    pub approach_m_s: Option<f64>,
    /// Most targets that are touched: fewer where a touch takes seconds.
    pub targets: usize,
}

impl Rung {
    /// Without anything that only some bodies have.
    pub const fn new(body: Body, senses: Senses, samples: usize, period_s: f64) -> Self {
        Self {
            body,
            senses,
            samples,
            shell: None,
            period_s,
            integrator: Integrator::ImplicitFast,
            collision: None,
            on_pa10: false,
            approach_m_s: None,
            targets: usize::MAX,
        }
    }

    /// Integrated by another.
    pub const fn by(self, integrator: Integrator) -> Self {
        Self { integrator, ..self }
    }

    /// Carried by a PA-10.
    pub const fn on_pa10(self) -> Self {
        Self { on_pa10: true, ..self }
    }

    /// With at most so many targets.
    pub const fn at(self, targets: usize) -> Self {
        Self { targets, ..self }
    }

    /// Whether this build can simulate it.
    pub fn is_built(&self) -> bool {
        cfg!(feature = "mujoco") || self.body != Body::Dynamic
    }

    /// `scene` with this rung's changes; every other setting stays.
    pub fn apply(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        scene.body = self.body;
        scene.touch.period_s = Some(self.period_s);
        let solver = &mut scene.solver;
        if self.body == Body::Dynamic {
            solver.step_s = self.period_s;
            solver.integrator = self.integrator;
        }
        solver.collision = self.collision;
        solver.sdf = solver.sdf.take().filter(|_| self.collision == Some(Collision::Sdf));
        if self.on_pa10 {
            scene.arm.get_or_insert_default();
        }
        scene.touch.approach_m_s = self.approach_m_s.unwrap_or(scene.touch.approach_m_s);
        let effects = &mut scene.effects;
        let [skin, fluid, electrodes] = match self.senses {
            Senses::None => [false; 3],
            Senses::Dry => [true, false, false],
            Senses::Fluid => [true, true, false],
            Senses::Full => [true; 3],
        };
        keep(&mut effects.skin, skin);
        keep(&mut effects.fluid, fluid);
        keep(&mut effects.electrodes, electrodes);
        if let Some(skin) = &mut effects.skin {
            skin.model = SkinModel::Columns;
            match self.shell {
                Some(cells) => {
                    skin.model = SkinModel::Shell;
                    [skin.along, skin.around] = cells;
                }
                None => skin.samples = self.samples,
            }
        }
        if !skin {
            *effects = Default::default();
        }
        if !effects.sends_frames() {
            effects.timing = None;
        }
        scene
    }

    /// As the table names it.
    pub fn name(&self) -> String {
        let mut words = vec![self.body.name().to_string()];
        if self.body != Body::Cast {
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
        words.extend(self.approach_m_s.map(|speed| format!("at {} mm/s", 1e3 * speed)));
        words.join(" ")
    }
}

impl Senses {
    /// As tables and legends name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "rigid",
            Self::Dry => "dry",
            Self::Fluid => "fluid",
            Self::Full => "full",
        }
    }
}

fn keep<T: Default>(effect: &mut Option<T>, wanted: bool) {
    *effect = wanted.then(|| effect.take().unwrap_or_default());
}
