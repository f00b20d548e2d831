//! The order in which the error of the force falls with the resolution, everything else being held.

use super::level::{Level, Senses};
use super::touches::{Trials, noise_free};
use crate::experiment::statistics::mean;
use crate::sim::environment::Shape;
use crate::sim::probe::rest;
use crate::sim::scene::Body;
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use palpate_explore::backend::Command;
use palpate_explore::robot::finger::TipMotion;
use serde::Serialize;
use std::sync::Arc;

/// Ticks per second compared with the last. A stage takes 20 ms to stop from an approach of 20
/// mm/s, and longer ticks than a quarter of that do not resolve it.
const TICKS_PER_S: [f64; 5] = [200.0, 500.0, 1000.0, 2000.0, 8000.0];

/// Points of the skins compared with the last.
const SAMPLES: [f64; 8] = [60.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 8000.0, 32000.0];

/// Points of the skin in the comparisons of steps, where they cancel.
const STEPPED_SAMPLES: usize = 250;

/// Steps per second in contact compared with the last: from those of the longest step that is
/// allowed, doubled again and again, then eightfold.
const STEPS_PER_S: [f64; 6] = [500.0, 1000.0, 2000.0, 4000.0, 8000.0, 64000.0];

/// Control tick in contact: commands change with it, whatever the step.
const PERIOD_S: f64 = 2e-3;

/// The finger goes on at this speed for this long after its hull would rest on the object.
// heuristic: 1 mm deep, as a usual touch.
const PRESS_M_S: f64 = 5e-3;
const PRESS_S: f64 = 0.2;

/// Speed until [`NEAR_M`] in front of that place.
const TRAVEL_M_S: f64 = 0.05;
const NEAR_M: f64 = 3e-3;

/// The fall of the mean error of the force.
#[derive(Clone, Debug, Serialize)]
pub struct Order {
    /// The resolution.
    pub name: &'static str,
    /// The unit of the resolution.
    pub axis: &'static str,
    /// Resolution and mean error of the force, N.
    pub errors: Vec<(f64, f64)>,
    /// Minus the slope of the logarithm of the error over that of the resolution.
    pub observed: f64,
    /// The order by theory.
    pub expected: f64,
}

impl Order {
    /// Returns the order in which the forces at some resolutions approach those at the last; `None`
    /// where there are none.
    fn new(
        [name, axis]: [&'static str; 2],
        resolutions: &[f64],
        forces_n: impl FnMut(f64) -> anyhow::Result<Option<Vec<f64>>>,
    ) -> anyhow::Result<Option<Self>> {
        let forces_n = resolutions.iter().copied().map(forces_n);
        let forces_n: Option<Vec<Vec<f64>>> = forces_n.collect::<anyhow::Result<_>>()?;
        let Some(mut forces_n) = forces_n else { return Ok(None) };
        let finest_n = forces_n.pop().unwrap_or_default();
        let error_n = |forces_n: &Vec<f64>| {
            let errors_n = forces_n.iter().zip(&finest_n).map(|(a, b)| (a - b).abs());
            mean(&errors_n.filter(|error_n| error_n.is_finite()).collect::<Vec<_>>())
        };
        let errors: Vec<(f64, f64)> =
            resolutions.iter().copied().zip(forces_n.iter().map(error_n)).collect();
        let (x, y): (Vec<f64>, Vec<f64>) = (errors.iter())
            .filter(|(_, error)| *error > 0.0)
            .map(|(at, error)| (at.ln(), error.ln()))
            .unzip();
        let (x0, y0) = (mean(&x), mean(&y));
        let above: f64 = x.iter().zip(&y).map(|(x, y)| (x - x0) * (y - y0)).sum();
        let below: f64 = x.iter().map(|x| (x - x0).powi(2)).sum();
        Ok(Some(Self { name, axis, errors, observed: -above / below, expected: 1.0 }))
    }
}

/// In the time step: a dry finger stops up to a tick after the force that is detected as contact,
/// so the error of the force is of first order.
///
/// # Errors
/// If the touches cannot be made.
pub fn in_time_step(scene: &Scene, trials: &Trials) -> anyhow::Result<Option<Order>> {
    Order::new(["time step", "ticks per second"], &TICKS_PER_S, |ticks_per_s| {
        let level = Level::new(Body::Kinematic, Senses::Dry, STEPPED_SAMPLES, 1.0 / ticks_per_s);
        let environment = Arc::new(Environment::build(noise_free(&level.apply(scene)))?);
        let touches = trials.touch(&environment)?;
        let loads = touches.iter().flat_map(|touches| &touches.loads);
        Ok(Some(loads.map(|load| load.as_ref().map_or(f64::NAN, |it| it.force_n)).collect()))
    })
}

/// In the points of the skin, pressed as in `poses`: a midpoint rule over an area has an error of
/// the order of a cell's area, one over the number of points.
///
/// # Errors
/// If a scene cannot be built.
pub fn in_samples(scene: &Scene, poses: &[TipMotion]) -> anyhow::Result<Option<Order>> {
    Order::new(["points of the skin"; 2], &SAMPLES, |samples| {
        let level = Level::new(Body::Kinematic, Senses::Fluid, samples as usize, 0.01);
        let environment = Environment::build(level.apply(scene))?;
        let (Some(skin), Shape::Mesh { bvh, .. }) =
            (environment.fingertip().and_then(|tip| tip.skin()), environment.shape())
        else {
            return Ok(None);
        };
        let mut pressed = skin.relaxed();
        let force_n = |pose: &TipMotion| {
            skin.press(bvh, &pose.x_wt, &mut pressed).map_or(f64::NAN, |load| load.force_n.norm())
        };
        Ok(Some(poses.iter().map(force_n).collect()))
    })
}

/// In the step of a dry finger on a stage with masses, pressed 1 mm into the middle of the zone by
/// the same commands, whatever its force: the force of the skin is that at the step's start and the
/// joints' speeds those at its end, so the error is of first order. `None` where the middle is no
/// surface, or in a build without MuJoCo.
///
/// # Errors
/// If the scene cannot be built or simulated.
pub fn in_contact(scene: &Scene) -> anyhow::Result<Option<Order>> {
    let level = Level::new(Body::Dynamic, Senses::Dry, STEPPED_SAMPLES, PERIOD_S);
    if !level.is_built() {
        return Ok(None);
    }
    let mut scene = noise_free(&level.apply(scene));
    scene.arm = None;
    Order::new(["step in contact", "steps per second"], &STEPS_PER_S, |steps_per_s| {
        scene.solver.step_s = 1.0 / steps_per_s;
        pressed(&Arc::new(Environment::build(scene.clone())?))
    })
}

/// The force after each tick while the finger is pressed.
fn pressed(environment: &Arc<Environment>) -> anyhow::Result<Option<Vec<f64>>> {
    let Some(zone) = environment.task().zone() else { return Ok(None) };
    let simulator = Simulator::new(Arc::clone(environment))?;
    let middle = zone.at(&[0.5, 0.5]).into();
    let Some(approach) = environment.task().approach(&middle) else { return Ok(None) };
    let (Some(chain), Some(rest), Some(mut body)) =
        (environment.chain(), rest(environment, &approach), simulator.body()?)
    else {
        return Ok(None);
    };
    let home_w = chain.forward(&chain.home).translation.vector;
    let ahead_w = approach.direction_w();
    let gap_m = (rest.p_wt.coords - home_w).dot(&ahead_w);
    let far_m = (gap_m - NEAR_M).max(0.0);
    let ticks = |way_m: f64, speed_m_s: f64| (way_m / (speed_m_s * PERIOD_S)).round() as usize;
    let mut go = |speed_m_s: f64, count: usize| {
        let command = Command { qdot: ahead_w.scale(speed_m_s).as_slice().into() };
        let force = |_| Ok(body.step(&command)?.ideal().map_or(0.0, |ideal| ideal.force_n));
        (0..count).map(force).collect::<anyhow::Result<Vec<f64>>>()
    };
    go(TRAVEL_M_S, ticks(far_m, TRAVEL_M_S))?;
    go(PRESS_M_S, ticks(gap_m - far_m, PRESS_M_S))?;
    Ok(Some(go(PRESS_M_S, ticks(PRESS_M_S * PRESS_S, PRESS_M_S))?))
}
