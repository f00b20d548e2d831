//! Runs in folders: the experiments of a file, the trials that a folder lacks, and what became of
//! them.

use super::compare::{SuiteComparison, compare, name_objects};
use super::planners::with_planners;
use crate::experiment::row::TrialId;
use crate::experiment::runner::{self, Progress, RealRun, Shard};
use crate::experiment::store::{Journal, RECORDINGS, RowCounts, Run, RunFolder};
use crate::experiment::sweep::sweep_cases;
use crate::experiment::trial::TrialObserver;
use crate::experiment::{Experiment, Simulation};
use anyhow::{Context, bail};
use palpate_explore::backend::arm::Arm;
use palpate_explore::backend::interlock::StartCheckSettings;
use palpate_input::files;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Experiments of a file: one, or one for each combination of a `[sweep]`.
pub struct Cells {
    /// Name of the sweep; `None` without one.
    pub sweep: Option<String>,
    /// Experiments, at least one.
    pub experiments: Vec<Experiment>,
}

/// Loads all experiments of a file with the settings of `--set` and further planners.
///
/// # Errors
/// See [`Experiment::load`].
pub fn cells(path: &Path, sets: &[String], planners: &[String]) -> anyhow::Result<Cells> {
    let cases = sweep_cases(path)?;
    let Some(first) = cases.first() else {
        let experiment = with_planners(sets, planners, |sets| Experiment::load(path, sets))?;
        return Ok(Cells { sweep: None, experiments: vec![experiment] });
    };
    let load = |case| with_planners(sets, planners, |sets| Experiment::load_cell(path, case, sets));
    let experiments = cases.iter().map(load).collect::<Result<Vec<_>, _>>()?;
    let name = experiments.first().map_or("", |experiment| &experiment.name);
    let name = name.strip_suffix(&first.label).unwrap_or(name).to_owned();
    Ok(Cells { sweep: Some(name), experiments })
}

/// Preferred reference planner of a sweep's comparison.
const REFERENCE: &str = "sobol";

/// Compares the finished runs of a sweep; `None` if they have different planners or no ground
/// truth.
///
/// # Errors
/// If a run cannot be read.
pub fn compare_cells(
    name: &str,
    first: &Experiment,
    paths: Vec<PathBuf>,
) -> anyhow::Result<Option<SuiteComparison>> {
    let read = |path: PathBuf| anyhow::Ok((path.display().to_string(), Run::read(&path)?));
    let runs: Vec<(String, Run)> = paths.into_iter().map(read).collect::<Result<_, _>>()?;
    let is_usual = first.planners.iter().any(|planner| planner == REFERENCE);
    let against = if is_usual { REFERENCE } else { first.baselines()[0] };
    let Ok(mut compared) = compare(&runs, against) else { return Ok(None) };
    name_objects(&mut compared, name);
    Ok(Some(compared))
}

/// Folder of a run, and how its trials are run.
pub struct RunSpec<'a> {
    /// Folder of the run.
    pub folder: &'a Path,
    /// Commit of the build.
    pub commit: &'a str,
    /// Whether earlier results are deleted.
    pub is_fresh: bool,
    /// Whether faults latched on a real arm are cleared.
    pub clears_fault: bool,
    /// Command that continues the run of a real arm after a fault.
    pub command_after_fault: &'a str,
}

/// Opens the folder of a run and connects to a real arm. Returns the folder and its finished
/// trials.
///
/// # Errors
/// If the folder has results of another experiment, if a fault halted its run, or if the arm cannot
/// be reached or may not move.
pub fn open(
    simulation: &mut Simulation,
    spec: RunSpec,
) -> anyhow::Result<(RunFolder, Vec<TrialId>)> {
    let opened = RunFolder::open(spec.folder, simulation, spec.commit, spec.is_fresh)?;
    if !simulation.is_real() {
        return Ok(opened);
    }
    // Before the connection: another program may hold the folder.
    let journal = Journal::open(spec.folder)?;
    if let Some(reason) = journal.halt_reason().filter(|_| !spec.clears_fault) {
        bail!(
            "{}: a fault halted the run: {reason}\ncheck the arm, then continue with: {}\n(or use \
             --fresh to start again)",
            spec.folder.display(),
            spec.command_after_fault
        );
    }
    if let Some(arm) = simulation.connect()? {
        start_arm(&arm, &simulation.experiment().backend.start_checks, spec.clears_fault)?;
    }
    Ok(opened)
}

/// Checks that a real arm may be moved; first clears faults latched on the robot if `clears_fault`.
///
/// # Errors
/// If the arm may not move.
pub fn start_arm(
    arm: &Arc<dyn Arm>,
    settings: &StartCheckSettings,
    clears_fault: bool,
) -> anyhow::Result<()> {
    if clears_fault {
        arm.clear_fault()?;
    }
    Ok(Arc::clone(arm).check_start(settings)?)
}

/// Trials of a run that a folder lacks.
pub struct MissingTrials<'a> {
    /// Simulation with its planners.
    pub simulation: &'a Simulation,
    /// Folder of the run.
    pub folder: RunFolder,
    /// Finished trials.
    pub done: Vec<TrialId>,
    /// Part of the trials, for one of several machines.
    pub shard: Option<Shard>,
    /// Threads; 0 means all cores.
    pub threads: usize,
    /// Whether every control tick is recorded.
    pub is_recorded: bool,
    /// Becomes true to stop between two trials, on a real arm between two touches.
    pub stop: &'a AtomicBool,
}

/// Outcome of a run.
#[derive(Debug)]
pub struct RunResult {
    /// Folder of the run.
    pub path: PathBuf,
    /// Trials that were run now.
    pub count: usize,
    /// Trials that were finished before.
    pub done: usize,
    /// Duration of the trials, in seconds.
    pub time_s: f64,
    /// Stored trials.
    pub tally: RowCounts,
    /// Expected number of trials.
    pub total: usize,
    /// Place and reason of a real arm's halt, and the results kept.
    pub halt: Option<String>,
}

impl RunResult {
    /// Whether all trials are stored.
    pub fn is_finished(&self) -> bool {
        self.tally.trials == self.total
    }
}

impl<'a> MissingTrials<'a> {
    /// Number of trials to run.
    ///
    /// # Errors
    /// If a planner is not available.
    pub fn count(&self) -> anyhow::Result<usize> {
        Ok(self.jobs()?.len())
    }

    fn jobs(&self) -> anyhow::Result<Vec<runner::Job<'a>>> {
        let mut jobs = runner::missing_jobs(self.simulation, &self.done)?;
        if let Some(shard) = self.shard {
            shard.retain(&mut jobs);
        }
        Ok(jobs)
    }

    /// Runs the trials, those of a real arm in sequence with the observer.
    ///
    /// # Errors
    /// If a row cannot be stored.
    pub fn run(
        mut self,
        progress: &(dyn Fn(Progress) + Sync),
        observer: &mut TrialObserver,
    ) -> anyhow::Result<RunResult> {
        let simulation = self.simulation;
        let path = self.folder.path().to_owned();
        let recorded = self.is_recorded.then_some(path.as_path());
        if self.is_recorded {
            let folder = path.join(RECORDINGS);
            files::make_folder(&folder).with_context(|| folder.display().to_string())?;
        }
        let jobs = self.jobs()?;
        let (done, total) = (self.done.len(), self.done.len() + jobs.len());
        let (folder, stop) = (&mut self.folder, self.stop);
        let begun = Instant::now();
        let (count, halt) = match simulation.is_real() {
            true => {
                let view = None;
                let run = RealRun { simulation, folder, stop, recorded, view, progress, observer };
                run.run(&self.done)?
            }
            false => {
                let threads = self.threads;
                (runner::run(simulation, folder, jobs, threads, stop, recorded, progress)?, None)
            }
        };
        let tally = self.folder.sort(simulation.experiment())?;
        let time_s = begun.elapsed().as_secs_f64();
        Ok(RunResult { path, count, done, time_s, tally, total, halt })
    }
}
