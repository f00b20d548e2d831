//! Order of convergence of the force error with the resolution, all other settings fixed.

use super::level::{FidelityLevel, FingerModel};
use super::touches::{TargetTrials, noise_free};
use crate::experiment::statistics::mean;
use crate::sim::environment::ObjectShape;
use crate::sim::probe::resting_pose;
use crate::sim::scene::SimulatorKind;
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use palpate_explore::backend::Command;
use palpate_explore::robot::finger::TipMotion;
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Ticks per second, each compared with the last. A stage takes 20 ms to stop from an approach at
/// 20 mm/s; ticks longer than a quarter of that do not resolve it.
const TICKS_PER_S: [f64; 5] = [200.0, 500.0, 1000.0, 2000.0, 8000.0];

/// Numbers of skin points, each compared with the last.
const SAMPLES: [f64; 8] = [60.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 8000.0, 32000.0];

/// Number of skin points in the comparisons of steps, where the error of this number cancels.
const STEPPED_SAMPLES: usize = 250;

/// Steps per second in contact, each compared with the last: the longest allowed step, halved
/// repeatedly, then an eighth.
const STEPS_PER_S: [f64; 6] = [500.0, 1000.0, 2000.0, 4000.0, 8000.0, 64000.0];

/// Duration of a control tick in contact, fixed because commands depend on it.
const PERIOD_S: f64 = 2e-3;

/// Speed and duration of the press after the hull would rest on the object.
// heuristic: 1 mm deep, a typical touch.
const PRESS_M_S: f64 = 5e-3;
const PRESS_S: f64 = 0.2;

/// Travel speed up to [`NEAR_M`] before the contact.
const TRAVEL_M_S: f64 = 0.05;
const NEAR_M: f64 = 3e-3;

/// Convergence of the mean force error.
#[derive(Clone, Debug, Serialize)]
pub struct ConvergenceOrder {
    /// Name of the resolution.
    pub name: &'static str,
    /// Unit of the resolution.
    pub axis: &'static str,
    /// Resolution and mean force error, N.
    pub errors: Vec<(f64, f64)>,
    /// Observed order: minus the slope of the log error over the log resolution.
    pub observed: f64,
    /// Theoretical order.
    pub expected: f64,
}

impl ConvergenceOrder {
    /// Computes the order at which the forces at some resolutions converge to those at the last;
    /// `None` if there are no forces.
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

/// Order in the time step. A dry finger stops up to one tick after contact detection, so the force
/// error is of first order.
///
/// # Errors
/// If the touches cannot be made.
pub fn in_time_step(
    scene: &Scene,
    trials: &TargetTrials,
    stop: &AtomicBool,
) -> anyhow::Result<Option<ConvergenceOrder>> {
    ConvergenceOrder::new(["time step", "ticks per second"], &TICKS_PER_S, |ticks_per_s| {
        let level = FidelityLevel::new(
            SimulatorKind::Kinematic,
            FingerModel::Dry,
            STEPPED_SAMPLES,
            1.0 / ticks_per_s,
        );
        let environment = Arc::new(Environment::build(noise_free(&level.apply(scene)))?);
        let touches = trials.touch(&environment, stop)?;
        let loads = touches.iter().flat_map(|touches| &touches.loads);
        Ok(Some(loads.map(|load| load.as_ref().map_or(f64::NAN, |it| it.force_n)).collect()))
    })
}

/// Order in the number of skin points, pressed at `poses`. A midpoint rule over an area has an
/// error of the order of a cell's area, so it is of first order in the number of points.
///
/// # Errors
/// If a scene cannot be built.
pub fn in_samples(scene: &Scene, poses: &[TipMotion]) -> anyhow::Result<Option<ConvergenceOrder>> {
    ConvergenceOrder::new(["points of the skin"; 2], &SAMPLES, |samples| {
        let level = FidelityLevel::new(
            SimulatorKind::Kinematic,
            FingerModel::Fluid,
            samples as usize,
            0.01,
        );
        let environment = Environment::build(level.apply(scene))?;
        let (Some(skin), ObjectShape::Mesh { bvh, .. }) =
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

/// Order in the step of a dry finger on a stage with masses. The same commands press it 1 mm into
/// the middle of the zone, regardless of its force. The skin's force is that at the step's start,
/// the joint speeds are those at its end, so the error is of first order. `None` without a surface
/// in the middle, or in a build without MuJoCo.
///
/// # Errors
/// If the scene cannot be built or simulated.
pub fn in_contact(scene: &Scene) -> anyhow::Result<Option<ConvergenceOrder>> {
    let level =
        FidelityLevel::new(SimulatorKind::Dynamic, FingerModel::Dry, STEPPED_SAMPLES, PERIOD_S);
    if !level.is_built() {
        return Ok(None);
    }
    let mut scene = noise_free(&level.apply(scene));
    scene.arm = None;
    ConvergenceOrder::new(["step in contact", "steps per second"], &STEPS_PER_S, |steps_per_s| {
        scene.solver.step_s = 1.0 / steps_per_s;
        pressed(&Arc::new(Environment::build(scene.clone())?))
    })
}

/// Force after each tick of the press.
fn pressed(environment: &Arc<Environment>) -> anyhow::Result<Option<Vec<f64>>> {
    let Some(zone) = environment.task().zone() else { return Ok(None) };
    let simulator = Simulator::new(Arc::clone(environment))?;
    let middle = zone.at(&[0.5, 0.5]).into();
    let Some(approach) = environment.task().approach(&middle) else { return Ok(None) };
    let (Some(chain), Some(rest), Some(mut body)) =
        (environment.chain(), resting_pose(environment, &approach), simulator.body()?)
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
        let force = |_| Ok(body.step(&command)?.ideal_contact().map_or(0.0, |ideal| ideal.force_n));
        (0..count).map(force).collect::<anyhow::Result<Vec<f64>>>()
    };
    go(TRAVEL_M_S, ticks(far_m, TRAVEL_M_S))?;
    go(PRESS_M_S, ticks(gap_m - far_m, PRESS_M_S))?;
    Ok(Some(go(PRESS_M_S, ticks(PRESS_M_S * PRESS_S, PRESS_M_S))?))
}
