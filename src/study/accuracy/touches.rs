//! Touches of a scene without sensor noise: contacts, loads and times, to compare models.

use crate::experiment::metrics::truth::Truth;
use crate::sim::environment::ObjectShape;
use crate::sim::finger::FingertipState;
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use palpate_explore::backend::trace::{Tick, Ticks, TracedBackend};
use palpate_explore::belief::HeightField;
use palpate_explore::evidence::{Contact, End, Outcome};
use palpate_explore::gp_settings::GpSettings;
use palpate_explore::planner;
use palpate_explore::planner::{Offer, PlannerFactory, PlanningSettings};
use palpate_explore::probe::Probe;
use palpate_explore::robot::finger::frame::ELECTRODES;
use palpate_explore::robot::finger::{Frame, TipMotion};
use palpate_explore::task::Target;
use palpate_gp::math::seed;
use rayon::prelude::*;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Test points along each side of the zone for the error of an estimated surface.
// heuristic: 2 mm apart on the scenes of the paper.
const GRID: usize = 41;

/// Touches per trial: enough to show a finger's heat and drift.
// heuristic: trials of experiments have ten touches or more.
const TRIAL: usize = 10;

/// Distance from the deepest point within which the finger counts as at rest: far above rounding,
/// far below one tick of any approach.
const REST_TOLERANCE_M: f64 = 1e-7;

/// Error of a measurement that was stopped on request.
#[derive(Debug, thiserror::Error)]
#[error("stopped on request")]
pub struct Interrupted;

/// Checks that `stop` is false.
///
/// # Errors
/// [`Interrupted`] if it is true.
pub(super) fn check(stop: &AtomicBool) -> Result<(), Interrupted> {
    if stop.load(Ordering::Relaxed) { Err(Interrupted) } else { Ok(()) }
}

/// Targets, grouped in trials of ten.
#[derive(Clone, Debug)]
pub struct TargetTrials {
    targets: Vec<Vec<Target>>,
    first: u64,
}

impl TargetTrials {
    /// Creates `count` evenly spread targets in the scene's zone; the first trial has number
    /// `first`. Each `first` gives another sequence of targets.
    pub fn new(scene: &Scene, count: usize, first: u64) -> Self {
        let targets = targets(scene, count, first);
        Self { targets: targets.chunks(TRIAL).map(<[_]>::to_vec).collect(), first }
    }

    /// All targets.
    pub fn targets(&self) -> Vec<Target> {
        self.targets.concat()
    }

    /// Touches the targets in a [`noise_free`] scene; returns one result per trial.
    ///
    /// # Errors
    /// [`Interrupted`] once `stop` is true; if the robot cannot be simulated or moved to its start.
    pub fn touch(
        &self,
        environment: &Arc<Environment>,
        stop: &AtomicBool,
    ) -> anyhow::Result<Vec<TouchResults>> {
        let simulator = Simulator::new(Arc::clone(environment))?;
        let trials = self.targets.par_iter().enumerate();
        trials
            .map(|(i, targets)| touch_all(&simulator, targets, self.first + i as u64, stop))
            .collect()
    }
}

/// Returns evenly spread places of the scene's zone.
pub fn targets(scene: &Scene, count: usize, seed: u64) -> Vec<Target> {
    let Some(zone) = scene.zone.clone() else { return Vec::new() };
    let belief = HeightField::new(zone, GpSettings::default()).into();
    let Some(entry) = planner::by_name("sobol") else { return Vec::new() };
    let random = seed::stream(seed, 0, "targets");
    let mut sobol = entry.make(&PlanningSettings::default(), random);
    (0..count).filter_map(|_| Some(sobol.plan(&belief, &Offer::default()).ok()?.target)).collect()
}

/// Results of the touches of one trial.
#[derive(Debug, Default)]
pub struct TouchResults {
    /// Contact of each touch; `None` after a miss or a fault.
    pub contacts: Vec<Option<Contact>>,
    /// Load on the finger when each contact was read.
    pub loads: Vec<Option<ReferenceLoad>>,
    /// Simulated time of each touch of a moving finger.
    pub simulated_s: Vec<f64>,
    /// Touches that ended in a fault.
    pub faults: usize,
}

/// Touches every target with the simulator of a [`noise_free`] scene.
///
/// # Errors
/// [`Interrupted`] once `stop` is true; if the robot cannot be moved to its start.
pub fn touch_all(
    simulator: &Simulator,
    targets: &[Target],
    seed: u64,
    stop: &AtomicBool,
) -> anyhow::Result<TouchResults> {
    let environment = simulator.environment();
    let (mut probe, ticks): (Box<dyn Probe>, _) = match (simulator.body()?, environment.chain()) {
        (Some(body), Some(chain)) => {
            let (trace, ticks) = TracedBackend::new(body, chain);
            (Box::new(simulator.servo(Box::new(trace), seed)?), ticks)
        }
        _ => (simulator.probe(seed)?, Ticks::default()),
    };
    let mut touches = TouchResults::default();
    for target in targets {
        check(stop)?;
        let outcome = environment.task().approach(target).map(|approach| probe.touch(&approach));
        touches.faults += usize::from(matches!(outcome, Some(Err(_))));
        let contact = outcome.and_then(Result::ok).and_then(|outcome| outcome.contact().cloned());
        let ticks = ticks.take();
        if let (Some(first), Some(last)) = (ticks.first(), ticks.last()) {
            touches.simulated_s.push(last.time_s - first.time_s);
        }
        touches.loads.push(contact.as_ref().and_then(|_| reference_load(simulator, &ticks)));
        touches.contacts.push(contact);
    }
    Ok(touches)
}

/// Load on the finger at the end of its rest on the object.
#[derive(Clone, Debug)]
pub struct ReferenceLoad {
    /// Pose and motion of the fingertip.
    pub motion: TipMotion,
    /// Magnitude of the force.
    pub force_n: f64,
    /// Rise in static pressure.
    pub pdc_counts: Option<f64>,
    /// Change of each electrode.
    pub electrode_counts: Option<[f64; ELECTRODES]>,
}

/// Returns `scene` with sensors that add no noise, do not drift and do not round.
pub fn noise_free(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let effects = &mut scene.effects;
    if let Some(electrodes) = &mut effects.electrodes {
        (electrodes.noise, electrodes.drift_counts, electrodes.quantise) = (0.0, 0.0, false);
    }
    if let Some(fluid) = &mut effects.fluid {
        (fluid.noise_counts, fluid.quantise) = (0.0, false);
        if let Some(vibration) = &mut fluid.vibration {
            vibration.noise_counts = 0.0;
        }
    }
    if let Some(thermal) = &mut effects.thermal {
        (thermal.tdc_noise_counts, thermal.tac_noise_counts) = (0.0, 0.0);
        thermal.quantise = false;
    }
    scene
}

/// Replays the movement in `ticks` with a new finger of a [`noise_free`] scene. Returns its load at
/// the end of its rest on the object; `None` without a skin or a contact.
pub fn reference_load(simulator: &Simulator, ticks: &[Tick]) -> Option<ReferenceLoad> {
    let environment = simulator.environment();
    let (tip, ObjectShape::Mesh { bvh, .. }) = (environment.fingertip()?, environment.shape())
    else {
        return None;
    };
    let zone = environment.task().zone()?;
    let height_m = |tick: &Tick| zone.height_m(&tick.motion.x_wt.translation.vector.into());
    let deepest_m = ticks.iter().map(height_m).fold(f64::INFINITY, f64::min);
    let last = ticks.iter().rposition(|tick| height_m(tick) <= deepest_m + REST_TOLERANCE_M)?;
    let mut state = FingertipState::new(tip, &seed::stream(0, 0, "finger"));
    let mut before_s = ticks.first()?.time_s;
    let (mut rest, mut now) = (None, Frame::default());
    let mut load = Default::default();
    for tick in &ticks[..=last] {
        let dt_s = (tick.time_s - before_s).max(0.0);
        before_s = tick.time_s;
        load = state.step(tip, bvh, &tick.motion, dt_s).ok()?;
        while let Some(frame) = state.frame() {
            rest.get_or_insert_with(|| frame.clone());
            now = frame;
        }
    }
    let rest = rest.unwrap_or_default();
    let electrode_counts = (now.electrode_counts.zip(rest.electrode_counts))
        .map(|(now, rest)| std::array::from_fn(|i| now[i] - rest[i]));
    Some(ReferenceLoad {
        motion: ticks[last].motion,
        force_n: load.force_n.norm(),
        pdc_counts: now.pdc_counts.zip(rest.pdc_counts).map(|(now, rest)| now - rest),
        electrode_counts,
    })
}

/// Wall times of touches of each scene with its sensor noise, interleaved so that other load of the
/// machine affects all scenes alike.
///
/// # Errors
/// [`Interrupted`] once `stop` is true; if a scene cannot be built or its robot cannot be moved to
/// its start.
pub fn wall_times_s<const N: usize>(
    scenes: [&Scene; N],
    targets: &[Target],
    rounds: usize,
    stop: &AtomicBool,
) -> anyhow::Result<Vec<[f64; N]>> {
    let mut probes = Vec::new();
    for scene in scenes {
        let environment = Arc::new(Environment::build(scene.clone())?);
        probes.push((Simulator::new(Arc::clone(&environment))?.probe(0)?, environment));
    }
    let mut times_s = Vec::with_capacity(rounds);
    for (round, target) in targets.iter().cycle().take(rounds).enumerate() {
        check(stop)?;
        let mut walls_s = [f64::NAN; N];
        // The order alternates, because the second scene finds warm caches.
        for k in (0..N).map(|k| (k + round) % N) {
            let (probe, environment) = &mut probes[k];
            let Some(approach) = environment.task().approach(target) else { continue };
            let begun = Instant::now();
            let _ = black_box(probe.touch(&approach));
            walls_s[k] = begun.elapsed().as_secs_f64();
        }
        times_s.push(walls_s);
    }
    times_s.retain(|walls_s| walls_s.iter().all(|wall_s| wall_s.is_finite()));
    Ok(times_s)
}

/// Bytes of a finger's skin, electrodes and state of one trial; excludes the mesh and its tree,
/// which all variants share.
pub fn finger_bytes(environment: &Environment) -> usize {
    let Some(tip) = environment.fingertip() else { return 0 };
    tip.bytes() + FingertipState::new(tip, &seed::stream(0, 0, "finger")).bytes()
}

/// Root mean square error of the surface fitted to these touches; `None` if nothing can be fitted
/// or the truth is unknown.
pub fn surface_rmse_m(
    environment: &Environment,
    targets: &[Target],
    touches: &[TouchResults],
) -> Option<f64> {
    let zone = environment.task().zone()?.clone();
    let mut belief = HeightField::new(zone, GpSettings::default());
    let contacts = touches.iter().flat_map(|touches| &touches.contacts);
    for (target, contact) in targets.iter().zip(contacts) {
        let outcome = contact.clone().map_or_else(|| End::Miss.into(), Outcome::from);
        belief.observe(target, &outcome);
    }
    let (_, surface) = belief.refit().ok()?;
    Truth::sample(environment, GRID, &|_| ()).rmse_m(surface)
}
