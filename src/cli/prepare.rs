//! From files to what runs: what cannot be is refused, and what may not be meant is said on
//! standard error.

use super::patience::with_patience;
use super::terminal::Talk;
use crate::experiment::{Experiment, Simulation};
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use anyhow::{Context, bail, ensure};
use palpate_ros::arm::Lab;
use std::path::Path;
use std::sync::Arc;

/// Bounds the threads of all that follows; 0 means all cores.
pub(super) fn bound_threads(threads: u16) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
    pool.build_global().with_context(|| format!("cannot start {threads} threads"))
}

/// Makes an experiment ready to run.
pub(super) fn simulation(experiment: Experiment, talk: Talk) -> anyhow::Result<Simulation> {
    let simulation = with_patience(talk, |tell| Simulation::new_telling(experiment, tell))?;
    simulation.simulator().check_reach()?;
    simulation.notices().iter().for_each(|notice| talk.note(notice));
    Ok(simulation)
}

/// Loads what a scene names.
pub(super) fn environment(scene: Scene, talk: Talk) -> anyhow::Result<Arc<Environment>> {
    Ok(Arc::new(with_patience(talk, |tell| Environment::build_telling(scene, tell))?))
}

/// Refuses a scene of a whole object where a command goes over a zone.
pub(super) fn needs_zone(scene: &Scene, path: &Path) -> anyhow::Result<()> {
    ensure!(
        scene.around.is_none(),
        "{}: [around] explores a whole object; this command goes over one side of it, allowed is a \
         scene with [zone]",
        path.display()
    );
    Ok(())
}

/// Refuses an option that goes with another kind of file or folder than `path`: each is its name,
/// whether it is given, whether it goes with this kind, and with what it goes.
pub(super) fn only_with(path: &Path, options: &[(&str, bool, bool, &str)]) -> anyhow::Result<()> {
    let refused = options.iter().find(|(_, is_given, is_allowed, _)| *is_given && !is_allowed);
    match refused {
        Some((option, _, _, what)) => bail!("{}: {option} goes with {what}", path.display()),
        None => Ok(()),
    }
}

/// Makes an environment ready for bodies.
pub(super) fn simulator(environment: &Arc<Environment>, talk: Talk) -> anyhow::Result<Simulator> {
    let simulator = Simulator::new(Arc::clone(environment))?;
    simulator.check_reach()?;
    simulator.notices().iter().for_each(|notice| talk.note(notice));
    Ok(simulator)
}

/// Makes sure that a real arm may be moved; first clears what its side has latched, if the operator
/// says so.
pub(super) fn ready(lab: &Arc<Lab>, clear_fault: bool) -> anyhow::Result<()> {
    if clear_fault {
        lab.clear_fault()?;
    }
    Ok(lab.check_start()?)
}
