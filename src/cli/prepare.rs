//! Preparation of files for a run: invalid input is an error, likely mistakes are notes on stderr.

use super::find::is_experiment;
use super::slow_steps::report_slow_steps;
use super::terminal::Verbosity;
use crate::experiment::{Experiment, Simulation};
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use anyhow::{Context, bail};
use palpate_input::config::ConfigError;
use palpate_input::format::counted;
use std::path::Path;
use std::sync::Arc;

/// Limits the number of threads of the process; 0 means all cores.
pub(super) fn set_thread_count(threads: u16) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
    pool.build_global().with_context(|| format!("cannot start {}", counted(threads, "thread")))
}

/// Number of touches of a scene's trial.
// heuristic: the number that `palpate new` writes.
const TOUCHES: u32 = 40;

/// Loads an experiment; for a scene, one trial of `active`.
pub(super) fn load_experiment(path: &Path, sets: &[String]) -> Result<Experiment, ConfigError> {
    match is_experiment(path) {
        true => Experiment::load(path, sets),
        false => Ok(Experiment::with_defaults(&Scene::load(path, sets)?, &["active"], 1, TOUCHES)),
    }
}

/// Prepares the simulation of an experiment.
pub(super) fn prepare_simulation(
    experiment: Experiment,
    talk: Verbosity,
) -> anyhow::Result<Simulation> {
    let simulation =
        report_slow_steps(talk, |tell| Simulation::new_with_progress(experiment, tell))?;
    simulation.simulator().check_reach()?;
    simulation.notices().iter().for_each(|notice| talk.note(notice));
    Ok(simulation)
}

/// Loads the files that a scene names.
pub(super) fn prepare_environment(
    scene: Scene,
    talk: Verbosity,
) -> anyhow::Result<Arc<Environment>> {
    Ok(Arc::new(report_slow_steps(talk, |tell| Environment::build_with_progress(scene, tell))?))
}

/// Rejects an option that does not apply to `path`. Each entry holds the option's name, whether it
/// is given, whether it applies to this kind of path, and the kind that it applies to.
pub(super) fn check_applicable(
    path: &Path,
    options: &[(&str, bool, bool, &str)],
) -> anyhow::Result<()> {
    let refused = options.iter().find(|(_, is_given, is_allowed, _)| *is_given && !is_allowed);
    match refused {
        Some((option, _, _, what)) => bail!("{}: {option} applies only to {what}", path.display()),
        None => Ok(()),
    }
}

/// Prepares the simulator of an environment.
pub(super) fn prepare_simulator(
    environment: &Arc<Environment>,
    talk: Verbosity,
) -> anyhow::Result<Simulator> {
    let simulator = Simulator::new(Arc::clone(environment))?;
    simulator.check_reach()?;
    simulator.notices().iter().for_each(|notice| talk.note(notice));
    Ok(simulator)
}
