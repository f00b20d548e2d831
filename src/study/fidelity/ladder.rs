//! The rungs: named changes to a scene, cheapest first.

use super::rung::{Rung, Senses};
use crate::sim::collision::Collision;
use crate::sim::scene::Body;
use crate::sim::solver::Integrator;

/// Targets of a rung of which a touch takes seconds; chosen: a Sobol sequence begins with places
/// all over the zone.
const FEW: usize = 8;

/// Fastest approach of a rigid finger: stopped at once, it ends in an overload from about 5 mm/s on
/// (`docs/dynamic.md`).
const RIGID_M_S: f64 = 0.005;

const fn kinematic(senses: Senses, samples: usize, period_s: f64) -> Rung {
    Rung::new(Body::Kinematic, senses, samples, period_s)
}

const fn dynamic(samples: usize, period_s: f64) -> Rung {
    Rung::new(Body::Dynamic, Senses::Full, samples, period_s)
}

/// A hull with masses, which MuJoCo lets collide.
const fn rigid(collision: Collision) -> Rung {
    let rung = Rung::new(Body::Dynamic, Senses::None, 0, 0.002);
    Rung { collision: Some(collision), approach_m_s: Some(RIGID_M_S), ..rung }
}

/// A thin shell of so many cells along and around.
const fn shell(cells: [usize; 2], period_s: f64) -> Rung {
    Rung { shell: Some(cells), ..kinematic(Senses::Full, 0, period_s) }
}

/// The ladder; one line to add a rung. The last is the reference.
pub const RUNGS: &[Rung] = &[
    Rung::new(Body::Cast, Senses::None, 0, 0.01),
    rigid(Collision::Hull),
    rigid(Collision::HeightField),
    rigid(Collision::Sdf).at(FEW),
    kinematic(Senses::Dry, 60, 0.01),
    kinematic(Senses::Dry, 125, 0.01),
    kinematic(Senses::Dry, 500, 0.01),
    kinematic(Senses::Dry, 2000, 0.01),
    kinematic(Senses::Fluid, 125, 0.01),
    kinematic(Senses::Fluid, 500, 0.01),
    kinematic(Senses::Fluid, 2000, 0.01),
    kinematic(Senses::Full, 60, 0.01),
    kinematic(Senses::Full, 125, 0.01),
    kinematic(Senses::Full, 250, 0.01),
    kinematic(Senses::Full, 500, 0.02),
    kinematic(Senses::Full, 500, 0.01),
    kinematic(Senses::Full, 500, 0.005),
    kinematic(Senses::Full, 500, 0.002),
    kinematic(Senses::Full, 500, 0.001),
    dynamic(500, 0.002),
    dynamic(500, 0.002).on_pa10(),
    dynamic(500, 0.001),
    dynamic(500, 0.001).by(Integrator::Implicit),
    dynamic(500, 0.001).by(Integrator::Euler),
    dynamic(500, 0.001).by(Integrator::Rk4),
    dynamic(500, 0.0005),
    shell([12, 8], 0.01),
    shell([24, 16], 0.01),
    shell([24, 16], 0.002),
    shell([36, 24], 0.002),
    kinematic(Senses::Full, 1000, 0.005),
    kinematic(Senses::Full, 2000, 0.002),
    kinematic(Senses::Full, 4000, 0.001),
    kinematic(Senses::Full, 8000, 0.0005),
    kinematic(Senses::Full, 16000, 0.00025),
    kinematic(Senses::Full, 32000, 0.00025),
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

/// Whether `rung` lies on the [`DIAGONAL`].
pub fn is_diagonal(rung: &Rung) -> bool {
    rung.body == Body::Kinematic
        && rung.senses == Senses::Full
        && DIAGONAL.contains(&(rung.samples, rung.period_s))
}

/// Whether `rung` is the one all others are compared with.
pub fn is_reference(rung: &Rung) -> bool {
    RUNGS.last() == Some(rung)
}
