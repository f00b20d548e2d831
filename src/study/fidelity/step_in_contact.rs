//! How fast the error of a body with masses falls with its time step in contact: the same commands
//! press the finger, whatever its force.

use super::order::{Order, STEPPED_SAMPLES};
use super::reference_load::noise_free;
use super::rung::{Rung, Senses};
use super::touches::MeasureError;
use crate::backend::Command;
use crate::experiment::statistics::mean;
use crate::sim::probe::rest;
use crate::sim::scene::Body;
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use std::sync::Arc;

/// As tables name this order.
pub const NAME: &str = "step in contact";

/// Steps compared with the last; chosen: the longest that is allowed, halved again and again, and
/// an eighth of the shortest.
const STEPS_S: [f64; 6] = [2e-3, 1e-3, 0.5e-3, 0.25e-3, 0.125e-3, 0.015_625e-3];

/// Control ticks: commands change with these, whatever the step.
const PERIOD_S: f64 = 2e-3;

/// The finger goes on at this speed for this long after its hull would rest on the object; chosen.
const PRESS_M_S: f64 = 5e-3;
const PRESS_S: f64 = 0.2;

/// Speed until [`NEAR_M`] in front of that place; chosen.
const TRAVEL_M_S: f64 = 0.05;
const NEAR_M: f64 = 3e-3;

/// In the step of a dry finger on a stage, pressed 1 mm into the middle of the zone: the force of
/// the skin is that at the step's start and the joints' speeds those at its end, so the error is of
/// first order. None where the middle is no surface, or in a build without MuJoCo.
///
/// # Errors
/// If the scene cannot be built or simulated.
pub fn in_step(scene: &Scene) -> Result<Option<Order>, MeasureError> {
    let rung = Rung::new(Body::Dynamic, Senses::Dry, STEPPED_SAMPLES, PERIOD_S);
    if !rung.is_built() {
        return Ok(None);
    }
    let mut scene = noise_free(&rung.apply(scene));
    scene.arm = None;
    let mut runs: Vec<(f64, Vec<f64>)> = Vec::new();
    for step_s in STEPS_S {
        scene.solver.step_s = step_s;
        match pressed(&Arc::new(Environment::build(scene.clone())?))? {
            Some(forces) => runs.push((step_s, forces)),
            None => return Ok(None),
        }
    }
    let Some((_, finest)) = runs.pop() else { return Ok(None) };
    let errors = runs.iter().map(|(step_s, forces)| {
        let apart: Vec<f64> = forces.iter().zip(&finest).map(|(a, b)| (a - b).abs()).collect();
        (1.0 / step_s, mean(&apart))
    });
    Ok(Some(Order::new(NAME, errors.collect(), 1.0)))
}

/// The force after each tick while the finger is pressed.
fn pressed(environment: &Arc<Environment>) -> Result<Option<Vec<f64>>, MeasureError> {
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
        (0..count).map(force).collect::<Result<Vec<f64>, MeasureError>>()
    };
    go(TRAVEL_M_S, ticks(far_m, TRAVEL_M_S))?;
    go(PRESS_M_S, ticks(gap_m - far_m, PRESS_M_S))?;
    Ok(Some(go(PRESS_M_S, ticks(PRESS_M_S * PRESS_S, PRESS_M_S))?))
}
