//! Trials × planners on all cores.

pub mod lab_runner;
pub mod shard;

use crate::backend::Fault;
use crate::experiment::simulation::Simulation;
use crate::experiment::store::{RunFolder, StoreError};
use crate::experiment::trial::entrant::Entrant;
use crate::experiment::trial::recorded_trial::{self, recording_path};
use crate::experiment::trial::row::{TrialId, TrialRow};
use crate::experiment::trial::witness::{Touched, Witness};
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, ParallelBridge, ParallelIterator,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use thiserror::Error;

/// Why an experiment could not be run.
#[derive(Debug, Error)]
pub enum RunError {
    /// Its folder is unusable.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// It lists a planner that is not built in, and that nobody brought.
    #[error(
        "planner `{name}` is not built into this program: run it with the Python package's palpate, or \
         from Rust by Simulation::with_planners"
    )]
    NoPlanner {
        /// Its name.
        name: String,
    },
    /// Threads could not be started.
    #[error("cannot start {threads} threads: {message}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        message: String,
    },
}

/// How far a run has come.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// A touch of a running trial is done.
    Touch,
    /// A trial is done.
    Trial(&'a TrialRow),
}

/// Takes what has come of a run, from any thread.
pub type OnProgress<'a> = &'a (dyn Fn(Progress) + Sync);

/// Counts the touches of a trial.
struct Counted<'a>(OnProgress<'a>);

impl Witness for Counted<'_> {
    fn touched(&mut self, _: &Touched) -> Result<(), Fault> {
        (self.0)(Progress::Touch);
        Ok(())
    }
}

/// One piece of work.
pub type Job<'a> = (u32, Entrant<'a>);

/// Runs `jobs` and adds each row to `folder` as it finishes; returns how many trials it ran.
///
/// A trial is recorded if `recorded` says in which run's folder.
///
/// `progress` is called after each touch and each trial. When `stop` becomes true, running
/// trials are finished and no others begun. `threads` 0 means all cores.
///
/// # Errors
/// If a row cannot be stored, or threads cannot be started.
pub fn run(
    simulation: &Simulation,
    (folder, jobs): (&mut RunFolder, Vec<Job>),
    threads: usize,
    stop: &AtomicBool,
    recorded: Option<&Path>,
    progress: OnProgress,
) -> Result<usize, RunError> {
    let pool = pool(threads)?;
    let finished = Mutex::new((folder, 0));
    // Handed out one by one, so that rows finish about in order and an interrupted run has
    // whole pairs.
    pool.install(|| {
        jobs.into_iter().par_bridge().try_for_each(|(trial, planner)| {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let row = run_caught(simulation, (planner, trial), recorded, progress);
            if row.failure.is_some() && stop.load(Ordering::Relaxed) {
                // What stopped the run may have failed it: it is run again.
                return Ok(());
            }
            let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
            finished.0.append(&row)?;
            finished.1 += 1;
            progress(Progress::Trial(&row));
            Ok(())
        })
    })
    .map_err(|error: StoreError| RunError::Store(error))?;
    let (_, count) = finished.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok(count)
}

/// Runs `jobs` and keeps their rows in memory, in the jobs' order; those begun after `stop` became
/// true are left out.
///
/// # Errors
/// If threads cannot be started.
pub fn rows(
    simulation: &Simulation,
    jobs: Vec<Job>,
    threads: usize,
    stop: &AtomicBool,
    progress: OnProgress,
) -> Result<Vec<TrialRow>, RunError> {
    let run = |(trial, planner): Job| {
        let row = (!stop.load(Ordering::Relaxed))
            .then(|| run_caught(simulation, (planner, trial), None, progress))?;
        progress(Progress::Trial(&row));
        Some(row)
    };
    let found: Vec<Option<TrialRow>> =
        pool(threads)?.install(|| jobs.into_par_iter().with_max_len(1).map(run).collect());
    Ok(found.into_iter().flatten().collect())
}

/// Threads of its own for a piece of work; 0 means all cores.
///
/// # Errors
/// If they cannot be started.
pub(super) fn pool(threads: usize) -> Result<rayon::ThreadPool, RunError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| RunError::Threads { threads, message: error.to_string() })
}

/// Runs one trial; a planner's or probe's panic becomes the trial's failure, so that one fault
/// in somebody's code does not lose the others' work.
fn run_caught(
    simulation: &Simulation,
    (planner, trial): (Entrant, u32),
    recorded: Option<&Path>,
    progress: OnProgress,
) -> TrialRow {
    let mut counted = Counted(progress);
    let run = || match recorded {
        None => simulation.trial_seen(planner, trial, &mut counted),
        Some(folder) => {
            let path = recording_path(folder, planner, trial);
            recorded_trial::go_on(simulation, planner, trial, &path, &[], &mut counted)
        }
    };
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let words = panic.downcast_ref::<String>().map(String::as_str);
        let words = words.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
        let failure = Some(format!("panicked: {words}"));
        TrialRow {
            trial,
            planner: planner.name().into(),
            failure,
            touches: Vec::new(),
            verification: Vec::new(),
        }
    })
}

/// Every trial of every planner that `done` lacks, trial by trial.
///
/// # Errors
/// If the experiment lists a planner that is not there.
pub fn jobs<'a>(simulation: &'a Simulation, done: &[TrialId]) -> Result<Vec<Job<'a>>, RunError> {
    let known = |(trial, name): (u32, &str)| {
        let planner = simulation.planner(name);
        Ok((trial, planner.ok_or_else(|| RunError::NoPlanner { name: name.into() })?))
    };
    simulation.experiment().lacks(done).into_iter().map(known).collect()
}
