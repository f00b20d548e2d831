//! From files to what runs: notices of what is simulated otherwise go to standard error.

use super::terminal;
use crate::experiment::{Experiment, Simulation};
use crate::sim::Environment;
use crate::sim::simulator::Simulator;
use std::sync::Arc;

/// Makes an experiment ready to run, and says on standard error what is not simulated as it asks.
pub(super) fn simulation(experiment: Experiment) -> anyhow::Result<Simulation> {
    let simulation = Simulation::new(experiment)?;
    tell(simulation.simulator());
    Ok(simulation)
}

/// Makes an environment ready for bodies, and says on standard error what is not simulated as its
/// scene asks.
pub(super) fn simulator(environment: &Arc<Environment>) -> anyhow::Result<Simulator> {
    let simulator = Simulator::new(Arc::clone(environment))?;
    tell(&simulator);
    Ok(simulator)
}

fn tell(simulator: &Simulator) {
    simulator.notice().iter().for_each(|notice| terminal::tell(&format!("note: {notice}")));
}
