//! Touches with one scene: what they found, how the finger was loaded, and what they cost.

use super::reference_load::{ReferenceLoad, noise_free, reference_load};
use crate::backend::Fault;
use crate::backend::trace::Trace;
use crate::error::Invalid;
use crate::experiment::statistics::median;
use crate::experiment::truth::Truth;
use crate::explore::belief::HeightField;
use crate::explore::gp_settings::GpSettings;
use crate::explore::planner;
use crate::explore::planner::{PlannerFactory, PlanningSettings};
use crate::explore::probe::{Contact, Probe, Touch};
use crate::math::seed;
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use crate::task::{Approach, Target};
use std::sync::Arc;
use std::time::Instant;

/// Touches are repeated until they have taken this long; chosen: far above the clock's grain.
const LEAST_S: f64 = 0.02;

/// Most repetitions of a touch; chosen.
const REPEATS: u32 = 1000;

/// What the touches of one scene brought.
pub struct Touches {
    /// What each touch found; none where it missed or faulted.
    pub contacts: Vec<Option<Contact>>,
    /// How the finger was loaded when it was read.
    pub loads: Vec<Option<ReferenceLoad>>,
    /// Median wall time of a touch; not a number if none was timed.
    pub wall_s: f64,
    /// Simulated time of a touch, in a body that has any.
    pub simulated_s: Option<f64>,
    /// Touches that ended in a fault, and the first of these.
    pub faults: usize,
    /// The first fault.
    pub fault: Option<Fault>,
}

/// Evenly spread places of the scene's zone.
pub fn targets(scene: &Scene, count: usize, seed: u64) -> Vec<Target> {
    let Some(zone) = scene.zone.clone() else { return Vec::new() };
    let belief = HeightField::new(zone, GpSettings::default()).into();
    let Some(entry) = planner::by_name("sobol") else { return Vec::new() };
    let random = seed::stream(seed, 0, "targets");
    let mut sobol = entry.make(&PlanningSettings::default(), random);
    (0..count).filter_map(|_| Some(sobol.plan(&belief).ok()?.target)).collect()
}

/// Why nothing can be measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// A scene cannot be built, or its body cannot be simulated as the scene asks.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// A body cannot be brought to its start.
    #[error(transparent)]
    Fault(#[from] Fault),
}

/// Touches every target, once and as often as it takes to time it; `tick` is called after each and
/// says whether to go on.
///
/// # Errors
/// If the body cannot be brought to its start.
pub fn touch_all(
    environment: &Arc<Environment>,
    targets: &[Target],
    seed: u64,
    tick: &mut dyn FnMut() -> bool,
) -> Result<Option<Touches>, MeasureError> {
    let mut timed = Simulator::new(Arc::clone(environment))?.probe(seed)?;
    let mut walls_s = Vec::new();
    let touches = touch_once(environment, targets, seed, &mut |approach| {
        walls_s.push(wall_time_s(timed.as_mut(), approach));
        tick()
    })?;
    let wall_s = median(&walls_s).unwrap_or(f64::NAN);
    Ok(touches.map(|touches| Touches { wall_s, ..touches }))
}

/// Touches every target, without timing any; `after` each it says whether to go on.
///
/// # Errors
/// If the body cannot be brought to its start.
pub fn touch_once(
    environment: &Arc<Environment>,
    targets: &[Target],
    seed: u64,
    after: &mut dyn FnMut(&Approach) -> bool,
) -> Result<Option<Touches>, MeasureError> {
    let simulator = Simulator::new(Arc::clone(environment))?;
    let noise_free = without_noise(&simulator)?;
    let mut ticks = None;
    let mut traced: Box<dyn Probe> = match (simulator.body()?, environment.chain()) {
        (Some(body), Some(chain)) => {
            let (trace, log) = Trace::new(body, chain);
            ticks = Some(log);
            Box::new(simulator.servo(Box::new(trace), seed)?)
        }
        _ => simulator.probe(seed)?,
    };
    let mut touches = Touches {
        contacts: Vec::new(),
        loads: Vec::new(),
        wall_s: f64::NAN,
        simulated_s: None,
        faults: 0,
        fault: None,
    };
    let mut simulated_s = Vec::new();
    for target in targets {
        let Some(approach) = environment.task().approach(target) else { continue };
        let contact = match traced.touch(&approach) {
            Ok(Touch::Contact(contact)) => Some(contact),
            Ok(Touch::Miss | Touch::Overload) => None,
            Err(fault) => {
                touches.faults += 1;
                touches.fault.get_or_insert(fault);
                None
            }
        };
        if let Some(log) = ticks.as_ref().map(crate::backend::trace::Ticks::take) {
            if let (Some(first), Some(last)) = (log.first(), log.last()) {
                simulated_s.push(last.time_s - first.time_s);
            }
            touches.loads.push(contact.as_ref().and_then(|_| reference_load(&noise_free, &log)));
        } else {
            touches.loads.push(None);
        }
        touches.contacts.push(contact);
        if !after(&approach) {
            return Ok(None);
        }
    }
    touches.simulated_s = median(&simulated_s);
    Ok(Some(touches))
}

/// The same scene without noise.
fn without_noise(simulator: &Simulator) -> Result<Simulator, MeasureError> {
    let scene = noise_free(simulator.environment().scene());
    match scene == *simulator.environment().scene() {
        true => Ok(simulator.clone()),
        false => Ok(Simulator::new(Arc::new(Environment::build(scene)?))?),
    }
}

/// Wall time of a touch: the mean over as many as take long enough to be measured.
fn wall_time_s(probe: &mut dyn Probe, approach: &Approach) -> f64 {
    let begun = Instant::now();
    let mut count = 0;
    loop {
        let _ = std::hint::black_box(probe.touch(approach));
        count += 1;
        let taken_s = begun.elapsed().as_secs_f64();
        if taken_s > LEAST_S || count >= REPEATS {
            return taken_s / f64::from(count);
        }
    }
}

/// Bytes of a finger's skin, electrodes and one trial's memory of them. The mesh and its tree,
/// which every rung shares, are left out.
pub fn finger_bytes(environment: &Environment) -> usize {
    let Some(tip) = environment.fingertip() else { return 0 };
    let state = crate::sim::finger::FingertipState::new(tip, &seed::stream(0, 0, "finger"));
    tip.bytes() + state.bytes()
}

/// Root mean square error of the surface that a belief makes of these contacts; none where
/// nothing can be fitted.
pub fn surface_rmse_m(
    scene: &Scene,
    targets: &[Target],
    contacts: &[Option<Contact>],
    truth: &Truth,
) -> Option<f64> {
    let mut belief = HeightField::new(scene.zone.clone()?, GpSettings::default());
    for (target, contact) in targets.iter().zip(contacts) {
        let touch = contact.clone().map_or(Touch::Miss, Touch::Contact);
        belief.observe(target.place()?, &touch);
    }
    let (_, surface) = belief.refit().ok()?;
    Some(truth.compare(surface)?.rmse_m)
}
