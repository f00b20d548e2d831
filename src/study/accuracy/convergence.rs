//! The order in which the error of the force falls with the resolution, everything else being held.

use super::level::{Level, Senses};
use super::touches::{Touches, noise_free, targets, touch_all};
use crate::backend::Command;
use crate::experiment::statistics::mean;
use crate::robot::finger::TipMotion;
use crate::sim::environment::Shape;
use crate::sim::probe::rest;
use crate::sim::scene::Body;
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use serde::Serialize;
use std::sync::Arc;

/// Time steps compared with the last. A stage takes 20 ms to stop from an approach of 20 mm/s, and
/// longer steps than a quarter of that do not resolve it.
const PERIODS_S: [f64; 5] = [0.005, 0.002, 0.001, 0.0005, 0.000125];

/// Points of the skins compared with the last.
const SAMPLES: [usize; 8] = [60, 125, 250, 500, 1000, 2000, 8000, 32000];

/// Points of the skin in the comparisons of steps, where they cancel.
const STEPPED_SAMPLES: usize = 250;

/// Steps in contact compared with the last: the longest that is allowed, halved again and again, and
/// an eighth of the shortest.
const STEPS_S: [f64; 6] = [2e-3, 1e-3, 0.5e-3, 0.25e-3, 0.125e-3, 0.015_625e-3];

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
    /// Returns the order by which forces approach those of the last, finest resolution; `None`
    /// without any.
    fn new([name, axis]: [&'static str; 2], mut forces_n: Vec<(f64, Vec<f64>)>) -> Option<Self> {
        let (_, finest_n) = forces_n.pop()?;
        let error_n = |forces_n: &[f64]| {
            let errors_n = forces_n.iter().zip(&finest_n).map(|(a, b)| (a - b).abs());
            mean(&errors_n.filter(|error_n| error_n.is_finite()).collect::<Vec<_>>())
        };
        let errors: Vec<(f64, f64)> = forces_n
            .iter()
            .map(|(resolution, forces_n)| (*resolution, error_n(forces_n)))
            .collect();
        let (x, y): (Vec<f64>, Vec<f64>) = (errors.iter())
            .filter(|(_, error)| *error > 0.0)
            .map(|(at, error)| (at.ln(), error.ln()))
            .unzip();
        let (x0, y0) = (mean(&x), mean(&y));
        let above: f64 = x.iter().zip(&y).map(|(x, y)| (x - x0) * (y - y0)).sum();
        let below: f64 = x.iter().map(|x| (x - x0).powi(2)).sum();
        Some(Self { name, axis, errors, observed: -above / below, expected: 1.0 })
    }
}

/// All orders, with `count` touches; `reference` are those of the finest level.
///
/// # Errors
/// If a scene cannot be built or simulated.
pub fn orders(
    scene: &Scene,
    (count, seed): (usize, u64),
    reference: &[Touches],
) -> anyhow::Result<Vec<Order>> {
    let poses: Vec<TipMotion> = (reference.iter())
        .flat_map(|touches| touches.loads.iter().flatten())
        .map(|load| load.motion)
        .collect();
    let orders =
        [in_time_step(scene, (count, seed))?, in_samples(scene, &poses)?, in_contact(scene)?];
    Ok(orders.into_iter().flatten().collect())
}

/// In the time step: a dry finger stops up to a tick after the force that is detected as contact, so
/// the error of the force is of first order.
///
/// # Errors
/// If the touches cannot be made.
pub fn in_time_step(scene: &Scene, (count, seed): (usize, u64)) -> anyhow::Result<Option<Order>> {
    let targets = targets(scene, count, seed);
    let mut forces_n = Vec::new();
    for period_s in PERIODS_S {
        let level = Level::new(Body::Kinematic, Senses::Dry, STEPPED_SAMPLES, period_s);
        let environment = Arc::new(Environment::build(noise_free(&level.apply(scene)))?);
        let touches = touch_all(&Simulator::new(environment)?, &targets, seed)?;
        let force_n =
            touches.loads.iter().map(|load| load.as_ref().map_or(f64::NAN, |it| it.force_n));
        forces_n.push((1.0 / period_s, force_n.collect()));
    }
    Ok(Order::new(["time step", "ticks per second"], forces_n))
}

/// In the points of the skin, pressed as in `poses`: a midpoint rule over an area has an error of the
/// order of a cell's area, one over the number of points.
///
/// # Errors
/// If a scene cannot be built.
pub fn in_samples(scene: &Scene, poses: &[TipMotion]) -> anyhow::Result<Option<Order>> {
    let mut forces_n = Vec::new();
    for samples in SAMPLES {
        let level = Level::new(Body::Kinematic, Senses::Fluid, samples, 0.01);
        let environment = Environment::build(level.apply(scene))?;
        let (Some(skin), Shape::Mesh { bvh, .. }) =
            (environment.fingertip().and_then(|tip| tip.skin()), environment.shape())
        else {
            continue;
        };
        let mut pressed = skin.relaxed();
        let force_n = |pose: &TipMotion| {
            skin.press(bvh, &pose.x_wt, &mut pressed).map_or(f64::NAN, |load| load.force_n.norm())
        };
        forces_n.push((samples as f64, poses.iter().map(force_n).collect()));
    }
    Ok(Order::new(["points of the skin"; 2], forces_n))
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
    let mut forces_n = Vec::new();
    for step_s in STEPS_S {
        scene.solver.step_s = step_s;
        match pressed(&Arc::new(Environment::build(scene.clone())?))? {
            Some(force_n) => forces_n.push((1.0 / step_s, force_n)),
            None => return Ok(None),
        }
    }
    Ok(Order::new(["step in contact", "steps per second"], forces_n))
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
