//! Preparation of files for a run: invalid input is an error, likely mistakes are notes on stderr.

use super::find::is_experiment;
use super::slow_steps::report_slow_steps;
use super::terminal::Verbosity;
use crate::experiment::store::Journal;
use crate::experiment::{Experiment, Simulation};
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use anyhow::{Context, bail};
use palpate_explore::backend::arm::Arm;
use palpate_explore::backend::interlock::StartCheckSettings;
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

/// Connects to a real arm and checks that it may be moved; first clears latched faults if
/// `clears_fault`. A simulation needs nothing.
///
/// # Errors
/// If a fault halted the run of this folder, with the command that continues it; if the arm cannot
/// be reached, or may not move.
pub(super) fn connect_arm(
    simulation: &mut Simulation,
    folder: &Path,
    clears_fault: bool,
    command: String,
) -> anyhow::Result<()> {
    if !simulation.is_real() {
        return Ok(());
    }
    // Before the connection: another program may hold the folder.
    if let Some(reason) = Journal::open(folder)?.halt_reason().filter(|_| !clears_fault) {
        bail!(
            "{}: a fault halted the run: {reason}\ncheck the arm, then continue with: {command}\n(or use --fresh to \
             start again)",
            folder.display(),
        );
    }
    match simulation.connect()? {
        Some(arm) => prepare_arm(&arm, &simulation.experiment().backend.start_checks, clears_fault),
        None => Ok(()),
    }
}

/// Checks that a real arm may be moved; first clears faults latched on the robot if `clear_fault`.
pub(super) fn prepare_arm(
    arm: &Arc<dyn Arm>,
    settings: &StartCheckSettings,
    clear_fault: bool,
) -> anyhow::Result<()> {
    if clear_fault {
        arm.clear_fault()?;
    }
    Ok(Arc::clone(arm).check_start(settings)?)
}
