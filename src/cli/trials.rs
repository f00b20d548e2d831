//! Trials of experiments at the terminal: progress, an operator's answers, failures.

use super::host::Host;
use super::prepare::prepare_simulation;
use super::progress::{stop_on_interrupt, touch_step, touches_bar};
use super::step::{Stepper, is_unregistered};
use super::terminal::{Completion, Verbosity, error};
use crate::experiment::backend_settings::arm_tables;
use crate::experiment::row::TrialId;
use crate::experiment::runner::{Progress, Shard};
use crate::experiment::store::RowCounts;
use crate::experiment::trial::TrialEvent;
use crate::experiment::{Experiment, Simulation};
use crate::study::run::{MissingTrials, RunResult, RunSpec, open};
use anyhow::bail;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Options of trials.
#[derive(Default)]
pub(super) struct TrialOptions {
    /// Threads; 0 means all cores.
    pub threads: u16,
    /// Whether earlier results are deleted.
    pub is_fresh: bool,
    /// Part of the trials, for one of several machines.
    pub shard: Option<Shard>,
    /// Whether every control tick is recorded.
    pub is_recorded: bool,
    /// Whether faults latched on a real arm are cleared.
    pub clears_fault: bool,
    /// Whether an operator is asked before each touch of a real arm; if absent, as long as the arm
    /// is not registered.
    pub asks: Option<bool>,
    /// Folder of the experiment, where the registration may be.
    pub beside: PathBuf,
    /// Command that continues the run of a real arm after a fault.
    pub command_after_fault: String,
}

impl TrialOptions {
    /// Checks that the options apply to a simulation or a real arm.
    fn check(&self, simulation: &Simulation) -> anyhow::Result<()> {
        let simulator = simulation.experiment().scene.simulator;
        if self.is_recorded && !simulator.moves_finger() && !simulation.is_real() {
            let body = simulator.name();
            bail!(
                "--record: simulator = \"{body}\" does not move, so there is nothing to record; allowed are \
                 \"kinematic\" and \"dynamic\""
            );
        }
        if self.asks == Some(true) && !simulation.is_real() {
            bail!("--step: a simulation needs no operator; allowed with {}", arm_tables());
        }
        if self.shard.is_some() && simulation.is_real() {
            bail!("--shard: a real arm runs one trial at a time; remove --shard");
        }
        Ok(())
    }

    /// Whether an operator is asked before each touch of a real arm.
    fn is_asked(&self, run: &Path, talk: Verbosity) -> bool {
        if let Some(asks) = self.asks {
            return asks;
        }
        if !is_unregistered(&[Path::new(""), &self.beside, run]) {
            return false;
        }
        let is_terminal = std::io::stdin().is_terminal();
        if !is_terminal {
            talk.note(
                "the arm has no registration.toml, and stdin is no terminal: touches are made without \
                 asking; --step reads the answers from stdin",
            );
        }
        is_terminal
    }
}

/// Trials of one or several experiments, until Ctrl-C.
pub(super) struct Trials<'a> {
    options: TrialOptions,
    talk: Verbosity,
    host: &'a Host<'a>,
    /// Set by Ctrl-C during trials.
    stop: Option<Arc<AtomicBool>>,
}

impl<'a> Trials<'a> {
    pub(super) fn new(options: TrialOptions, talk: Verbosity, host: &'a Host<'a>) -> Self {
        Self { options, talk, host, stop: None }
    }

    /// Whether Ctrl-C, or an operator, has stopped the trials.
    pub(super) fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Runs the trials of an experiment that a folder lacks.
    pub(super) fn run(&mut self, experiment: Experiment, path: &Path) -> anyhow::Result<RunResult> {
        let (options, talk) = (&self.options, self.talk);
        let (own, lacking) = self.host.load_planners(&experiment.planners);
        let mut simulation = prepare_simulation(experiment, talk)?.with_planners(own);
        options.check(&simulation)?;
        let spec = RunSpec {
            folder: path,
            commit: self.host.commit,
            is_fresh: options.is_fresh,
            clears_fault: options.clears_fault,
            command_after_fault: &options.command_after_fault,
        };
        let (folder, done) = open(&mut simulation, spec)?;
        let simulation = &simulation;
        let stop = match &mut self.stop {
            Some(stop) => &*stop,
            none => none.insert(stop_on_interrupt("trials")?),
        };
        let trials = MissingTrials {
            simulation,
            folder,
            done,
            shard: options.shard,
            threads: options.threads.into(),
            is_recorded: options.is_recorded,
            stop,
        };
        // A planner that cannot be loaded is an error only if trials of it are missing.
        let count = trials.count().map_err(|error| lacking.unwrap_or(error))?;
        let experiment = simulation.experiment();
        let bar = touches_bar(talk, experiment, [count, trials.done.len()]);
        let tick = |progress: Progress| touch_step(talk, &bar, experiment, progress);
        let is_asked = simulation.is_real() && options.is_asked(path, talk);
        let new = || Stepper::new(simulation, std::io::stdin().lock());
        let mut stepper = is_asked.then(new).transpose()?;
        let mut ask = |event: &TrialEvent| match (event, &mut stepper) {
            (TrialEvent::Next(next), Some(stepper)) => {
                bar.suspend(|| stepper.ask(next)).inspect_err(|_| {
                    // The operator's stop is one between two touches, like Ctrl-C.
                    stop.store(true, Ordering::Relaxed);
                })
            }
            (TrialEvent::Next(_) | TrialEvent::Finished(_), _) => Ok(None),
        };
        let result = trials.run(&tick, &mut ask)?;
        bar.finish_and_clear();
        Ok(result)
    }
}

/// Returns how a run ends the program: it failed if a planner failed in each of its trials. Prints
/// to stderr the number of failed trials and the first failure.
pub(super) fn completion(result: &RunResult, talk: Verbosity) -> Completion {
    let RowCounts { trials, failed, incomplete } = &result.tally;
    let is_one_without = !incomplete.is_empty();
    if let Some((TrialId { trial, planner }, reason)) = failed.first() {
        let words = format!(
            "{} of {trials} trials failed, the first ({planner}, trial {trial}): {reason}",
            failed.len()
        );
        match is_one_without {
            true => error(words),
            false => talk.note(words),
        }
    }
    match () {
        () if !result.is_finished() => Completion::Interrupted,
        () if is_one_without => Completion::Failed,
        () => Completion::Done,
    }
}
