//! The rungs: named changes to a scene, cheapest first.

use crate::world::Scene;
use crate::world::scene::Body;

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
    /// Points of the skin; 0 for a rigid one.
    pub samples: usize,
    /// Duration of a control tick.
    pub period_s: f64,
}

const fn rung(body: Body, senses: Senses, samples: usize, period_s: f64) -> Rung {
    Rung { body, senses, samples, period_s }
}

/// The ladder; one line to add a rung. The last is the reference.
pub const RUNGS: &[Rung] = &[
    rung(Body::Cast, Senses::None, 0, 0.01),
    rung(Body::Kinematic, Senses::Dry, 60, 0.01),
    rung(Body::Kinematic, Senses::Dry, 125, 0.01),
    rung(Body::Kinematic, Senses::Dry, 500, 0.01),
    rung(Body::Kinematic, Senses::Dry, 2000, 0.01),
    rung(Body::Kinematic, Senses::Fluid, 125, 0.01),
    rung(Body::Kinematic, Senses::Fluid, 500, 0.01),
    rung(Body::Kinematic, Senses::Fluid, 2000, 0.01),
    rung(Body::Kinematic, Senses::Full, 60, 0.01),
    rung(Body::Kinematic, Senses::Full, 125, 0.01),
    rung(Body::Kinematic, Senses::Full, 250, 0.01),
    rung(Body::Kinematic, Senses::Full, 500, 0.02),
    rung(Body::Kinematic, Senses::Full, 500, 0.01),
    rung(Body::Kinematic, Senses::Full, 500, 0.005),
    rung(Body::Kinematic, Senses::Full, 500, 0.002),
    rung(Body::Kinematic, Senses::Full, 500, 0.001),
    #[cfg(feature = "mujoco")]
    rung(Body::Dynamic, Senses::Full, 500, 0.002),
    #[cfg(feature = "mujoco")]
    rung(Body::Dynamic, Senses::Full, 500, 0.001),
    #[cfg(feature = "mujoco")]
    rung(Body::Dynamic, Senses::Full, 500, 0.0005),
    rung(Body::Kinematic, Senses::Full, 1000, 0.005),
    rung(Body::Kinematic, Senses::Full, 2000, 0.002),
    rung(Body::Kinematic, Senses::Full, 4000, 0.001),
    rung(Body::Kinematic, Senses::Full, 8000, 0.0005),
    rung(Body::Kinematic, Senses::Full, 16000, 0.00025),
    rung(Body::Kinematic, Senses::Full, 32000, 0.00025),
];

/// Rungs that go to the reference in every direction at once: how far each is from the last
/// says whether that can be trusted. It begins with ticks shorter than a tactile frame: ticks as
/// long as a frame see every frame at the instant it is sampled, which flatters them.
pub const DIAGONAL: [(usize, f64); 6] = [
    (1000, 0.005),
    (2000, 0.002),
    (4000, 0.001),
    (8000, 0.0005),
    (16000, 0.00025),
    (32000, 0.00025),
];

impl Rung {
    /// `scene` with this rung's changes; every other setting stays.
    pub fn apply(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        scene.body = self.body;
        scene.touch.period_s = Some(self.period_s);
        if self.body == Body::Dynamic {
            scene.solver.step_s = self.period_s;
        }
        let effects = &mut scene.effects;
        let [skin, fluid, electrodes] = match self.senses {
            Senses::None => [false; 3],
            Senses::Dry => [true, false, false],
            Senses::Fluid => [true, true, false],
            Senses::Full => [true; 3],
        };
        // Rungs are resolutions of the foundation.
        effects.flex = None;
        keep(&mut effects.skin, skin);
        keep(&mut effects.fluid, fluid);
        keep(&mut effects.electrodes, electrodes);
        if let Some(skin) = &mut effects.skin {
            skin.samples = self.samples;
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
        let (body, samples, ms) = (self.body.name(), self.samples, 1e3 * self.period_s);
        match self.senses {
            Senses::None => body.into(),
            senses => format!("{body} {} {samples} {ms} ms", senses.name()),
        }
    }

    /// Whether it lies on the [`DIAGONAL`].
    pub fn is_diagonal(&self) -> bool {
        self.body == Body::Kinematic
            && self.senses == Senses::Full
            && DIAGONAL.contains(&(self.samples, self.period_s))
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
