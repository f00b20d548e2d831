//! What one effect does to touches, their cost, and the verdict on planners.

use super::switches::switched;
use super::verdict::{GRID, advantages, verdict};
use crate::experiment::statistics::{Paired, median};
use crate::experiment::truth::Truth;
use crate::robot::finger::TipMotion;
use crate::sim::finger::FingertipState;
use crate::sim::finger::counter::count_of;
use crate::sim::finger::effects::switch::Switch;
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use crate::study::fidelity::reference_load::ReferenceLoad;
use crate::study::fidelity::rung_result::electrode_rms_counts;
use crate::study::fidelity::spread::Spread;
use crate::study::fidelity::touches::{MeasureError, Touches, touch_all};
use crate::task::Target;
use std::sync::Arc;
use std::time::Instant;

/// What one effect does.
pub struct Change {
    /// The effect.
    pub name: String,
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
    /// How often it does its work in a touch, without it and with it; none if that is not counted.
    pub runs: Option<[u64; 2]>,
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

/// The scene as it is, measured once.
pub struct Baseline {
    environment: Arc<Environment>,
    targets: Vec<Target>,
    touches: Touches,
    truth: Truth,
    verdict: Option<Paired>,
}

impl Baseline {
    /// Touches `targets` and runs the trials; none if stopped.
    ///
    /// # Errors
    /// If the scene cannot be built.
    pub fn new(
        scene: &Scene,
        targets: Vec<Target>,
        budget: Budget,
        tick: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Self>, MeasureError> {
        let environment = Arc::new(Environment::build(scene.clone())?);
        let truth = Truth::sample(&environment, GRID);
        let Some(touches) = touch_all(&environment, &targets, 0, &mut || true)? else {
            return Ok(None);
        };
        let verdict = verdict(&advantages(&environment, &truth, 0..budget.trials, budget.touches));
        Ok(tick().then_some(Self { environment, targets, touches, truth, verdict }))
    }

    /// What `switch` does to it.
    ///
    /// # Errors
    /// If the switched scene cannot be built.
    pub fn change(&self, switch: &Switch<Scene>, budget: Budget) -> Result<Change, MeasureError> {
        let is_on = switch.is_on(self.environment.scene());
        let environment = Arc::new(Environment::build(switched(self.environment.scene(), switch))?);
        let touches = touch_all(&environment, &self.targets, 0, &mut || true)?;
        let contacts = touches.iter().flat_map(|touches| &touches.contacts);
        let shifts: Vec<f64> = (self.touches.contacts.iter().zip(contacts))
            .filter_map(|(a, b)| Some((a.as_ref()?.p_wc - b.as_ref()?.p_wc).norm()))
            .collect();
        let spread = |apart: &dyn Fn(&ReferenceLoad, &ReferenceLoad) -> Option<f64>| {
            let loads = touches.iter().flat_map(|touches| &touches.loads);
            let values: Vec<f64> = (self.touches.loads.iter().zip(loads))
                .filter_map(|(a, b)| apart(a.as_ref()?, b.as_ref()?))
                .collect();
            Spread::of(&values)
        };
        let trials = 0..budget.trials;
        let other = verdict(&advantages(&environment, &self.truth, trials, budget.touches));
        let [without, with] = match is_on {
            true => [&environment, &self.environment],
            false => [&self.environment, &environment],
        };
        Ok(Change {
            name: switch.name.clone(),
            is_on,
            shift_m: Spread::of(&shifts),
            force_n: spread(&|a, b| Some((a.force_n - b.force_n).abs())),
            electrode_counts: spread(&electrode_rms_counts),
            time_ratio: median(&time_ratios(without, with, &self.targets, budget.pairs)?),
            state_bytes: state_bytes(with) - state_bytes(without),
            runs: runs(&switch.name, without, &self.targets)?
                .zip(runs(&switch.name, with, &self.targets)?)
                .map(|(without, with)| [without, with])
                .filter(|runs| *runs != [0, 0]),
            verdict: if is_on { [other, self.verdict] } else { [self.verdict, other] },
        })
    }

    /// How the finger stood at the contacts.
    pub fn poses(&self) -> Vec<TipMotion> {
        self.touches.loads.iter().flatten().map(|load| load.motion).collect()
    }
}

fn state_bytes(environment: &Environment) -> i64 {
    environment.fingertip().map_or(0, |tip| {
        FingertipState::new(tip, &crate::math::seed::stream(0, 0, "finger")).bytes() as i64
    })
}

/// How often the effect `name` does its work in the first touch.
fn runs(
    name: &str,
    environment: &Arc<Environment>,
    targets: &[Target],
) -> Result<Option<u64>, MeasureError> {
    let Some(target) = targets.first() else { return Ok(None) };
    let mut probe = Simulator::new(Arc::clone(environment))?.probe(0)?;
    let before = count_of(name);
    let Some(approach) = environment.task().approach(target) else { return Ok(None) };
    let _ = probe.touch(&approach);
    Ok(count_of(name).zip(before).map(|(after, before)| after - before))
}

/// Wall time of a touch with `with` over that of the same touch with `without`: interleaved, so
/// that what else the machine does falls on both alike.
pub(super) fn time_ratios(
    without: &Arc<Environment>,
    with: &Arc<Environment>,
    targets: &[Target],
    pairs: usize,
) -> Result<Vec<f64>, MeasureError> {
    let open = |environment: &Arc<Environment>| -> Result<_, MeasureError> {
        Ok(Simulator::new(Arc::clone(environment))?.probe(0)?)
    };
    let mut probes = [open(without)?, open(with)?];
    let mut ratios = Vec::with_capacity(pairs);
    for (i, target) in targets.iter().cycle().take(pairs).enumerate() {
        let Some(approach) = with.task().approach(target) else { continue };
        let mut taken_s = [0.0; 2];
        // Which goes first alternates: the second finds the caches warm.
        for k in [i % 2, (i + 1) % 2] {
            let begun = Instant::now();
            let _ = std::hint::black_box(probes[k].touch(&approach));
            taken_s[k] = begun.elapsed().as_secs_f64();
        }
        ratios.push(taken_s[1] / taken_s[0]);
    }
    Ok(ratios)
}
