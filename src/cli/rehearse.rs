//! Rehearsal of a run: `palpate run --dry`.

use super::prepare::prepare_simulation;
use super::progress::stop_on_interrupt;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::Experiment;
use crate::experiment::backend_settings::arm_tables;
use crate::study::run::start_arm;
use anyhow::{Context, bail};
use palpate_explore::backend::pace;
use palpate_explore::belief::Belief;
use palpate_explore::planner::{self, Offer};
use palpate_gp::math::seed;
use palpate_input::format::counted;
use std::sync::atomic::Ordering;

/// Planner of the approaches: it spreads them evenly.
const PLANNER: &str = "sobol";

/// Follows the approaches of a trial above the surface, and touches nothing: the robot needs no
/// forces, tactile frames or status, as mock hardware, URSim and Gazebo have none.
pub(super) fn run(
    mut experiment: Experiment,
    clears_fault: bool,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    experiment.backend.dry = true;
    let mut simulation = prepare_simulation(experiment, talk)?;
    if !simulation.is_real() {
        bail!("--dry: a simulation touches without risk; allowed with {}", arm_tables());
    }
    if let Some(arm) = simulation.connect()? {
        start_arm(&arm, &simulation.experiment().backend.start_checks, clears_fault)?;
    }
    let body = simulation.backend(None)?.context("the arm does not move")?;
    let mut servo = simulation.servo(body, simulation.body_seed(0))?;
    let experiment = simulation.experiment();
    let entry = planner::by_name(PLANNER).with_context(|| format!("no planner {PLANNER}"))?;
    let random = seed::stream(experiment.seed, 0, "rehearsal");
    let mut planner = (entry.make)(&experiment.planning, random);
    let stop = stop_on_interrupt("approaches")?;
    let begun_s = pace::now_s();
    let mut followed = 0;
    let (task, scene) = (simulation.task(), &experiment.scene);
    let belief = Belief::new(task, &scene.effects.surface(), &experiment.gp, &experiment.space);
    while followed < experiment.touches && !stop.load(Ordering::Relaxed) {
        let target = planner.plan(&belief, &Offer::default())?.target;
        let approach = task.approach(&target).context("no approach of a target")?;
        let passed_s = servo.rehearse(&approach)?;
        followed += 1;
        let numbers: Vec<String> =
            target.numbers().iter().map(|number| format!("{number:.4}")).collect();
        print(&format!(
            "approach {followed} of {}: target ({}) m, {passed_s:.1} s",
            experiment.touches,
            numbers.join(", ")
        ))?;
    }
    print(&format!(
        "{} followed in {:.0} s, nothing touched",
        counted(followed, "approach"),
        pace::now_s() - begun_s
    ))?;
    Ok(Completion::Done)
}
