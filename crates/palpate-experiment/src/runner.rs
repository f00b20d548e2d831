//! Execution of trials × planners: simulated trials in parallel, those of a real arm in sequence.

use crate::planner_names::HUMAN;
use crate::recording::recorded_trial::{self, next_part, recording_path};
use crate::recording::view;
use crate::row::{TouchRow, TrialId, TrialRow};
use crate::simulation::Simulation;
use crate::store::{JOURNAL, Journal, JournalEntry, RunError, RunFolder};
use crate::trial::{FinishedTouch, TrialEvent, TrialObserver};
use palpate_explore::backend::live_view::LiveView;
use palpate_explore::backend::{Fault, pace};
use palpate_explore::planner::{Fallback, PlannerFactory};
use palpate_explore::task::Target;
use palpate_input::error::InputError;
use palpate_input::format::counted;
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, ParallelBridge, ParallelIterator,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Progress of a run, reported from any thread.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// A touch of a running trial is finished.
    Touch,
    /// A trial is finished.
    Trial(&'a TrialRow),
}

/// A trial to run, and its planner.
pub type Job<'a> = (u32, &'a dyn PlannerFactory);

/// Returns every trial of every planner that `done` lacks, ordered by trial.
///
/// # Errors
/// If the experiment lists a planner that is not available.
pub fn missing_jobs<'a>(
    simulation: &'a Simulation,
    done: &[TrialId],
) -> Result<Vec<Job<'a>>, InputError> {
    let known = |(trial, name): (u32, &str)| {
        let planner = simulation.planner(name);
        let problem = format!("planner `{name}` is not available in this program");
        let mend = match name {
            HUMAN => "a person plans in: palpate live EXPERIMENT",
            _ => {
                "run it with the palpate of the Python package, or from Rust with \
                  Simulation::with_planners"
            }
        };
        Ok((trial, planner.ok_or_else(|| InputError::new(problem).remedy(mend))?))
    };
    simulation.experiment().missing_trials(done).into_iter().map(known).collect()
}

/// A part of an experiment's trials for one machine or task: every `count`-th trial, with all
/// planners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the shard, from 1.
    pub index: u32,
    /// Number of shards.
    pub count: u32,
}

impl FromStr for Shard {
    type Err = InputError;

    fn from_str(text: &str) -> Result<Self, InputError> {
        let wrong = || InputError::new("allowed is I/N with I from 1 to N, as in 3/8");
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
        let (index, count) = (number(index)?, number(count)?);
        match index > 0 && index <= count {
            true => Ok(Self { index, count }),
            false => Err(wrong()),
        }
    }
}

impl Shard {
    /// Whether the shard contains a trial.
    pub fn contains(self, trial: u32) -> bool {
        trial % self.count == self.index - 1
    }

    /// Removes the jobs of other shards.
    pub fn retain(self, jobs: &mut Vec<Job>) {
        jobs.retain(|(trial, _)| self.contains(*trial));
    }
}

/// Runs `jobs` and adds each row to `folder` when it finishes; returns the number of trials run.
///
/// A trial is recorded if `recorded` names the run's folder. When `stop` becomes true, running
/// trials finish and no others start. `threads` 0 means all cores.
///
/// # Errors
/// If a row cannot be stored, or threads cannot be started.
pub fn run(
    simulation: &Simulation,
    folder: &mut RunFolder,
    jobs: Vec<Job>,
    threads: usize,
    stop: &AtomicBool,
    recorded: Option<&Path>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<usize, RunError> {
    let pool = thread_pool(threads)?;
    let finished = Mutex::new((folder, 0));
    // Jobs are handed out one by one, so that rows finish roughly in order and an interrupted run
    // has complete pairs.
    pool.install(|| {
        jobs.into_iter().par_bridge().try_for_each(|job| {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let row = run_counted(simulation, job, recorded, progress);
            if row.failure.is_some() && stop.load(Ordering::Relaxed) {
                // The interruption may have caused the failure; the trial is run again.
                return Ok(());
            }
            let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
            finished.0.append(&row)?;
            finished.1 += 1;
            progress(Progress::Trial(&row));
            Ok::<(), RunError>(())
        })
    })?;
    let (_, count) = finished.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok(count)
}

/// Runs `jobs` and returns their rows in the jobs' order; jobs not started before `stop` became
/// true are left out.
///
/// # Errors
/// If threads cannot be started.
pub fn run_in_memory(
    simulation: &Simulation,
    jobs: Vec<Job>,
    threads: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<TrialRow>, InputError> {
    let run = |job: Job| {
        let row = (!stop.load(Ordering::Relaxed))
            .then(|| run_counted(simulation, job, None, progress))?;
        progress(Progress::Trial(&row));
        Some(row)
    };
    let found: Vec<Option<TrialRow>> =
        thread_pool(threads)?.install(|| jobs.into_par_iter().with_max_len(1).map(run).collect());
    Ok(found.into_iter().flatten().collect())
}

/// Thread pool for a piece of work; 0 means all cores.
///
/// # Errors
/// If the threads cannot be started.
pub(super) fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, InputError> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| {
        InputError::new(format!("cannot start {}: {error}", counted(threads, "thread")))
    })
}

/// Runs one trial as [`recorded_trial::run`] does. A panic of a planner or probe becomes the
/// trial's failure, so that it does not lose the other trials.
pub fn run_caught(
    simulation: &Simulation,
    job: Job,
    recorded: Option<&Path>,
    view: Option<&LiveView>,
    observer: &mut TrialObserver,
) -> TrialRow {
    let (trial, planner) = job;
    let run = || recorded_trial::run(simulation, trial, planner, recorded, view, &[], observer);
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let words = panic.downcast_ref::<String>().map(String::as_str);
        let words = words.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
        TrialRow::without_touches(trial, planner.name(), Some(format!("panicked: {words}")))
    })
}

/// Runs one trial, and reports each touch.
fn run_counted(
    simulation: &Simulation,
    job: Job,
    recorded: Option<&Path>,
    progress: &(dyn Fn(Progress) + Sync),
) -> TrialRow {
    let (trial, planner) = job;
    let path = recorded.map(|run| recording_path(run, planner, trial));
    let mut count = |event: &TrialEvent| {
        if matches!(event, TrialEvent::Finished(_)) {
            progress(Progress::Touch);
        }
        Ok(None)
    };
    run_caught(simulation, job, path.as_deref(), None, &mut count)
}

/// Run of the trials of a real arm, in sequence. Every touch is stored in the journal of `folder`,
/// from which an interrupted trial continues.
pub struct RealRun<'a> {
    /// Simulation with the connected arm.
    pub simulation: &'a Simulation,
    /// Folder to which rows and touches are added.
    pub folder: &'a mut RunFolder,
    /// Becomes true to stop the run between two touches.
    pub stop: &'a AtomicBool,
    /// Folder of the run if its trials are recorded.
    pub recorded: Option<&'a Path>,
    /// View that shows the arm.
    pub view: Option<&'a LiveView>,
    /// Called after each touch and each trial.
    pub progress: &'a dyn Fn(Progress),
    /// Called before each new touch, when it may return another target or a fault, and after each
    /// touch.
    pub observer: &'a mut TrialObserver<'a>,
}

impl RealRun<'_> {
    /// Runs the trials that `done` lacks, until one fails or the run is stopped.
    ///
    /// Returns the number of finished trials and, if it stopped early, the trial, the reason and
    /// the stored touches.
    ///
    /// # Errors
    /// If a row or touch cannot be stored, or a planner is not available.
    pub fn run(mut self, done: &[TrialId]) -> Result<(usize, Option<String>), RunError> {
        let mut journal = Journal::open(self.folder.path())?;
        let mut finished = 0;
        for job in missing_jobs(self.simulation, done)? {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            if let Some(halt) = self.trial(job, &mut journal)? {
                return Ok((finished, Some(halt)));
            }
            finished += 1;
        }
        Ok((finished, None))
    }

    /// Runs a trial and adds its row to the folder; if it fails, returns the trial, the reason and
    /// the stored touches.
    fn trial(&mut self, job: Job, journal: &mut Journal) -> Result<Option<String>, RunError> {
        let (trial, planner) = job;
        let name = planner.name();
        let made = journal.touches(trial, name);
        let path = self.recorded.map(|run| next_part(&recording_path(run, planner, trial)));
        let (simulation, view) = (self.simulation, self.view);
        let mut stored =
            StoredTrial { run: self, journal, job, made: &made, is_asked: false, unstored: None };
        let mut observe = |event: &TrialEvent| stored.observe(event);
        let path = path.as_deref();
        let row = recorded_trial::run(simulation, trial, planner, path, view, &made, &mut observe);
        let StoredTrial { is_asked, unstored, .. } = stored;
        if let Some(error) = unstored {
            return Err(error);
        }
        let Some(reason) = row.failure else {
            self.folder.append(&row)?;
            (self.progress)(Progress::Trial(&row));
            return Ok(None);
        };
        if !is_asked {
            journal.add(journal_entry(job, None, Some(reason.clone())))?;
        }
        let touches = journal.touches(trial, name).len();
        let kept = self.folder.path().join(JOURNAL);
        let verb = if touches == 1 { "is" } else { "are" };
        let kept = format!("{} {verb} stored in {}", counted(touches, "touch"), kept.display());
        Ok(Some(format!("{name}, trial {trial}: {reason}\n{kept}")))
    }
}

/// Returns the entry of a touch or a fault of a trial, at this time.
fn journal_entry(job: Job, touch: Option<TouchRow>, fault: Option<String>) -> JournalEntry {
    let (trial, planner) = (job.0, job.1.name().to_owned());
    JournalEntry { time_unix_s: pace::now_s(), trial, planner, touch, fault }
}

/// A trial of a real arm whose touches are stored.
struct StoredTrial<'a, 'b> {
    run: &'a mut RealRun<'b>,
    journal: &'a mut Journal,
    job: Job<'a>,
    /// Touches made before an interruption.
    made: &'a [TouchRow],
    /// Whether the trial was stopped on request.
    is_asked: bool,
    /// Error of a touch that could not be stored.
    unstored: Option<RunError>,
}

impl StoredTrial<'_, '_> {
    /// Shows an event of the trial, stores a finished touch, and calls the run's observer.
    fn observe(&mut self, event: &TrialEvent) -> Result<Option<Target>, Fault> {
        // Touches made before an interruption are not shown again, except the last.
        let is_shown = event.count() as usize >= self.made.len();
        let simulation = self.run.simulation;
        if let Some(arm) = simulation.arm().filter(|_| is_shown) {
            view::show(arm, simulation, event);
        }
        let made = self.made.get(event.count() as usize - 1);
        match (event, made) {
            (TrialEvent::Next(_), Some(made)) => {
                // An operator's target is repeated, as the planner's own is planned again.
                let chosen = made.fallback == Some(Fallback::Operator);
                Ok(chosen.then(|| made.target.clone()))
            }
            (TrialEvent::Next(_), None) => {
                let answer = (self.run.observer)(event);
                self.is_asked |= matches!(answer, Err(Fault::Stopped { .. }));
                answer
            }
            (TrialEvent::Finished(touched), made) => {
                (self.run.progress)(Progress::Touch);
                let observed = (self.run.observer)(event);
                match made {
                    Some(made) => check_repeated(touched, made).map(|()| None),
                    None => self.store(touched.row).and(observed),
                }
            }
        }
    }

    /// Stores a finished touch.
    ///
    /// # Errors
    /// If it cannot be stored, or the run is stopped.
    fn store(&mut self, touch: &TouchRow) -> Result<(), Fault> {
        let time_s = touch.outcome.time_s.unwrap_or_default();
        let entry = journal_entry(self.job, Some(touch.clone()), None);
        if let Err(error) = self.journal.add(entry) {
            let message = error.to_string();
            self.unstored = Some(error);
            return Err(Fault::RecordingFailed { time_s, message });
        }
        self.is_asked |= self.run.stop.load(Ordering::Relaxed);
        if self.is_asked { Err(Fault::Stopped { time_s }) } else { Ok(()) }
    }
}

/// Checks that a touch repeats the recorded one.
fn check_repeated(touched: &FinishedTouch, made: &TouchRow) -> Result<(), Fault> {
    if made.target == touched.row.target {
        return Ok(());
    }
    let (touch, target) = (touched.count, made.target.numbers());
    Err(Fault::from(InputError::new(format!(
        "touch {touch}: recorded target {target:?} differs from the current plan; program or \
         experiment changed, use --fresh to start again"
    ))))
}
