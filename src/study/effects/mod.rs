//! What each effect changes and costs: one switched at a time, the rest of the scene as it is.

pub mod overhead;

use super::fidelity::reference_load::ReferenceLoad;
use super::fidelity::row::{Spread, electrodes_apart};
use super::fidelity::touches::{MeasureError, Touches, touch_all};
use crate::experiment::statistics::{Paired, median};
use crate::experiment::truth::Truth;
use crate::experiment::{Experiment, Simulation};
use crate::explore::planner;
use crate::robot::finger::TipMotion;
use crate::sim::finger::counter;
use crate::sim::finger::timing::TimingEffect;
use crate::sim::finger::{Effects, FingertipState};
use crate::sim::scene::Body;
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;

/// One effect that can be switched.
pub struct Switch {
    /// As in the scene.
    pub name: &'static str,
    /// Whether a scene has it.
    pub is_on: fn(&Scene) -> bool,
    /// Puts it in with its defaults, or takes it out.
    pub set: fn(&mut Scene, bool),
}

macro_rules! table {
    ($name:ident) => {
        Switch {
            name: stringify!($name),
            is_on: |scene| scene.effects.$name.is_some(),
            set: |scene, on| scene.effects.$name = on.then(Default::default),
        }
    };
}

/// Every effect; one line to add one.
pub const SWITCHES: &[Switch] = &[
    Switch {
        name: "skin",
        is_on: |scene| scene.effects.skin.is_some(),
        set: |scene, on| {
            if on {
                scene.effects.skin.get_or_insert_default();
            } else {
                (scene.effects, scene.body) = (Effects::default(), Body::Cast);
            }
        },
    },
    table!(fluid),
    Switch {
        name: "fluid.vibration",
        is_on: |scene| scene.effects.fluid.as_ref().is_some_and(|fluid| fluid.vibration.is_some()),
        set: |scene, on| {
            if on {
                scene.effects.fluid.get_or_insert_default();
            }
            if let Some(fluid) = &mut scene.effects.fluid {
                fluid.vibration = on.then(Default::default);
            }
        },
    },
    table!(electrodes),
    table!(thermal),
    table!(friction),
    table!(wrench),
    table!(registration),
    table!(timing),
    Switch {
        name: "timing.control_delay_s",
        is_on: |scene| {
            scene.effects.timing.as_ref().is_some_and(|timing| timing.control_delay_s > 0.0)
        },
        set: |scene, on| match (&mut scene.effects.timing, on) {
            (Some(timing), _) => timing.control_delay_s = if on { DELAY_S } else { 0.0 },
            // Frames as without timing, as near as a table can say it: each alone.
            (timing @ None, true) => {
                *timing = Some(TimingEffect { batch_frames: 1, control_delay_s: DELAY_S });
            }
            (None, false) => {}
        },
    },
    Switch {
        name: "arm",
        is_on: |scene| scene.arm.is_some(),
        set: |scene, on| scene.arm = on.then(Default::default),
    },
    #[cfg(feature = "mujoco")]
    Switch {
        name: "masses",
        is_on: |scene| scene.body == Body::Dynamic,
        set: |scene, on| scene.body = if on { Body::Dynamic } else { Body::Kinematic },
    },
];

/// A delay of commands that is more than a control tick of any body; chosen.
const DELAY_S: f64 = 0.02;

/// `scene` with one effect the other way round.
pub fn switched(scene: &Scene, switch: &Switch) -> Scene {
    let mut scene = scene.clone();
    let on = !(switch.is_on)(&scene);
    (switch.set)(&mut scene, on);
    if !scene.effects.sends_frames() {
        scene.effects.timing = None;
    }
    scene
}

/// What one effect does.
pub struct Change {
    /// The effect.
    pub name: &'static str,
    /// Whether the scene has it.
    pub is_on: bool,
    /// How far contacts move when it is switched, m.
    pub shift_m: Option<Spread>,
    /// Change of the force, N.
    pub force_n: Option<Spread>,
    /// Change of the electrodes, counts.
    pub electrode_counts: Option<Spread>,
    /// Wall time of a touch with it over that without: medians of paired, interleaved touches.
    pub time_ratio: Option<f64>,
    /// Bytes of a trial's state that it adds.
    pub state_bytes: i64,
    /// How often its stage runs in a touch, without it and with it, in a build that counts.
    pub runs: Option<[u64; 2]>,
    /// What the scene takes more without it than in code that does not have it: median ratio of paired
    /// runs and its 95 % interval; none where what is off is not there at all.
    pub off_ratio: Option<(f64, [f64; 2])>,
    /// RMSE of `active` minus that of `random` in the same trials, without it and with it, m.
    pub verdict: [Option<Paired>; 2],
}

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Interleaved pairs of touches that are timed.
    pub pairs: usize,
    /// Trials of each planner.
    pub trials: u32,
    /// Touches of a trial.
    pub touches: u32,
}

/// Test places along each side of the zone; chosen.
const GRID: usize = 31;

/// The scene as it is, measured once.
pub struct Base {
    environment: Arc<Environment>,
    targets: Vec<Vec<f64>>,
    touches: Touches,
    truth: Truth,
    verdict: Option<Paired>,
}

impl Base {
    /// Touches `targets` and runs the trials; none if stopped.
    ///
    /// # Errors
    /// If the scene cannot be built.
    pub fn new(
        scene: &Scene,
        targets: Vec<Vec<f64>>,
        budget: Budget,
        tick: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Self>, MeasureError> {
        let environment = Arc::new(Environment::build(scene.clone())?);
        let truth = Truth::sample(&environment, GRID);
        let Some(touches) = touch_all(&environment, &targets, 0, &mut || true)? else {
            return Ok(None);
        };
        let verdict = verdict(&environment, &truth, budget);
        Ok(tick().then_some(Self { environment, targets, touches, truth, verdict }))
    }

    /// What `switch` does to it.
    ///
    /// # Errors
    /// If the switched scene cannot be built.
    pub fn change(&self, switch: &Switch, budget: Budget) -> Result<Change, MeasureError> {
        let is_on = (switch.is_on)(self.environment.scene());
        let environment = Arc::new(Environment::build(switched(self.environment.scene(), switch))?);
        let touches = touch_all(&environment, &self.targets, 0, &mut || true)?;
        let contacts = touches.iter().flat_map(|touches| &touches.contacts);
        let shifts: Vec<f64> = (self.touches.contacts.iter().zip(contacts))
            .filter_map(|(a, b)| Some((a.as_ref()?.p_wc - b.as_ref()?.p_wc).norm()))
            .collect();
        let felt = |apart: &dyn Fn(&ReferenceLoad, &ReferenceLoad) -> Option<f64>| {
            let felt = touches.iter().flat_map(|touches| &touches.felt);
            let values: Vec<f64> = (self.touches.felt.iter().zip(felt))
                .filter_map(|(a, b)| apart(a.as_ref()?, b.as_ref()?))
                .collect();
            Spread::of(&values)
        };
        let worlds = if is_on {
            [&environment, &self.environment]
        } else {
            [&self.environment, &environment]
        };
        let other = verdict(&environment, &self.truth, budget);
        let [without, with] = worlds;
        Ok(Change {
            name: switch.name,
            is_on,
            shift_m: Spread::of(&shifts),
            force_n: felt(&|a, b| Some((a.force_n - b.force_n).abs())),
            electrode_counts: felt(&electrodes_apart),
            time_ratio: time_ratio(without, with, &self.targets, budget.pairs)?,
            state_bytes: state_bytes(with) - state_bytes(without),
            runs: runs(switch.name, without, &self.targets)?
                .zip(runs(switch.name, with, &self.targets)?)
                .map(|(without, with)| [without, with]),
            off_ratio: overhead::ratio(switch.name, without, &self.poses(), budget.pairs),
            verdict: if is_on { [other, self.verdict] } else { [self.verdict, other] },
        })
    }
}

impl Base {
    /// How the finger stood at the contacts.
    pub fn poses(&self) -> Vec<TipMotion> {
        self.touches.felt.iter().flatten().map(|felt| felt.motion).collect()
    }
}

fn state_bytes(environment: &Environment) -> i64 {
    environment.fingertip().map_or(0, |tip| {
        FingertipState::new(tip, &crate::math::seed::stream(0, 0, "finger")).bytes() as i64
    })
}

/// How often the stage `name` runs in the first touch.
fn runs(
    name: &str,
    environment: &Arc<Environment>,
    targets: &[Vec<f64>],
) -> Result<Option<u64>, MeasureError> {
    let name = name.rsplit('.').next().unwrap_or(name);
    let stage = counter::STAGES.iter().position(|(_, stage)| *stage == name);
    let (Some(stage), Some(target)) = (stage, targets.first()) else { return Ok(None) };
    let mut probe = Simulator::new(Arc::clone(environment))?.probe(0)?;
    let before = counter::counts();
    let _ = probe.touch(&environment.task().approach(target));
    Ok(counter::counts().zip(before).map(|(after, before)| after[stage] - before[stage]))
}

/// Interleaved, so that what else the machine does falls on both alike.
fn time_ratio(
    without: &Arc<Environment>,
    with: &Arc<Environment>,
    targets: &[Vec<f64>],
    pairs: usize,
) -> Result<Option<f64>, MeasureError> {
    let open = |environment: &Arc<Environment>| -> Result<_, MeasureError> {
        Ok(Simulator::new(Arc::clone(environment))?.probe(0)?)
    };
    let mut probes = [open(without)?, open(with)?];
    let mut ratios = Vec::with_capacity(pairs);
    for (i, target) in targets.iter().cycle().take(pairs).enumerate() {
        let mut taken_s = [0.0; 2];
        // Which goes first alternates: the second finds the caches warm.
        for k in [i % 2, (i + 1) % 2] {
            let begun = Instant::now();
            let _ = std::hint::black_box(probes[k].touch(&with.task().approach(target)));
            taken_s[k] = begun.elapsed().as_secs_f64();
        }
        ratios.push(taken_s[1] / taken_s[0]);
    }
    Ok(median(&ratios))
}

/// `active` against `random` in the same trials.
fn verdict(environment: &Arc<Environment>, truth: &Truth, budget: Budget) -> Option<Paired> {
    let planners = [planner::by_name("active")?, planner::by_name("random")?];
    if budget.trials == 0 {
        return None;
    }
    let names = planners.map(|planner| planner.name);
    let experiment = Experiment::on(environment.scene(), &names, budget.trials, budget.touches);
    let environment = Arc::clone(environment);
    let simulation = Simulation::against(experiment, environment, truth.clone()).ok()?;
    let pairs: Vec<(f64, f64)> = (0..budget.trials)
        .into_par_iter()
        .filter_map(|number| {
            let [active, random] = planners.map(|planner| {
                let row = simulation.trial(planner, number);
                row.touches.last().and_then(|touch| Some(touch.metrics?.rmse_m))
            });
            active.zip(random)
        })
        .collect();
    Paired::new(&pairs, 0)
}
