//! From files to what runs: notices of what is simulated otherwise, and steps that take long, go to
//! standard error.

use crate::experiment::{Experiment, Simulation};
use crate::sim::simulator::Simulator;
use crate::sim::{Environment, Scene};
use anyhow::Context;
use std::io::Write;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// Bounds the threads of all that follows; 0 means all cores.
pub(super) fn bound_threads(threads: u16) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
    pool.build_global().with_context(|| format!("cannot start {threads} threads"))
}

/// Makes an experiment ready to run, and says on standard error what is not simulated as it asks.
pub(super) fn simulation(experiment: Experiment) -> anyhow::Result<Simulation> {
    let simulation = with_patience(|tell| Simulation::new_telling(experiment, tell))?;
    tell(simulation.simulator());
    Ok(simulation)
}

/// Loads what a scene names.
pub(super) fn environment(scene: Scene) -> anyhow::Result<Environment> {
    Ok(with_patience(|tell| Environment::build_telling(scene, tell))?)
}

/// Makes an environment ready for bodies, and says on standard error what is not simulated as its
/// scene asks.
pub(super) fn simulator(environment: &Arc<Environment>) -> anyhow::Result<Simulator> {
    let simulator = Simulator::new(Arc::clone(environment))?;
    tell(&simulator);
    Ok(simulator)
}

fn tell(simulator: &Simulator) {
    simulator.notice().iter().for_each(|notice| eprintln!("note: {notice}"));
}

/// How long a step may take before its name is shown; chosen.
const PATIENCE: Duration = Duration::from_secs(1);

/// Does `work`, which tells the name of each of its steps as it begins, and shows on standard error
/// those that take long.
pub(super) fn with_patience<T>(work: impl FnOnce(&dyn Fn(&str)) -> T) -> T {
    // Whoever closed standard error does not want to know.
    let show = |step: &str| drop(writeln!(std::io::stderr(), "{step} ..."));
    showing_slow(PATIENCE, show, work)
}

fn showing_slow<T>(
    patience: Duration,
    show: impl Fn(&str) + Send,
    work: impl FnOnce(&dyn Fn(&str)) -> T,
) -> T {
    let (begin, begun) = channel();
    std::thread::scope(|scope| {
        scope.spawn(move || show_slow(patience, show, &begun));
        work(&move |step| drop(begin.send(step.to_owned())))
    })
}

/// Shows each of the `begun` steps that no other follows in time.
fn show_slow(patience: Duration, show: impl Fn(&str), begun: &Receiver<String>) {
    while let Ok(mut step) = begun.recv() {
        loop {
            match begun.recv_timeout(patience) {
                Ok(next) => step = next,
                Err(RecvTimeoutError::Timeout) => break show(&step),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// The first step ends once it was shown.
    #[test]
    fn a_step_that_outlasts_patience_is_shown_once() {
        let (shown, was_shown) = channel();
        let done = showing_slow(
            Duration::from_millis(1),
            move |step| shown.send(step.to_owned()).expect("somebody waits"),
            |tell| {
                tell("slow");
                was_shown.recv()
            },
        );
        assert_eq!(done.as_deref(), Ok("slow"));
    }

    #[test]
    fn steps_within_patience_are_not_shown() {
        let shown = Mutex::new(Vec::new());
        let done = showing_slow(
            Duration::from_secs(3600),
            |step| shown.lock().expect("no panic").push(step.to_owned()),
            |tell| {
                ["one", "two"].map(tell);
                3
            },
        );
        assert_eq!((done, shown.into_inner().expect("no panic")), (3, Vec::new()));
    }
}
