//! From files to what runs: it is refused what cannot be, and said on standard error what may not be
//! meant.

use super::terminal::Talk;
use crate::experiment::{Experiment, Simulation};
use crate::sim::Environment;
use crate::sim::simulator::Simulator;
use std::sync::Arc;

/// Makes an experiment ready to run.
pub(super) fn simulation(experiment: Experiment, talk: Talk) -> anyhow::Result<Simulation> {
    let simulation = Simulation::new(experiment)?;
    simulation.simulator().check_reach()?;
    simulation.notices().iter().for_each(|notice| talk.note(notice));
    Ok(simulation)
}

/// Makes an environment ready for bodies.
pub(super) fn simulator(environment: &Arc<Environment>, talk: Talk) -> anyhow::Result<Simulator> {
    let simulator = Simulator::new(Arc::clone(environment))?;
    simulator.check_reach()?;
    simulator.notices().iter().for_each(|notice| talk.note(notice));
    Ok(simulator)
}
