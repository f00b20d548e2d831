//! Trials of an experiment in other processes: jobs that run some of them, and the collection of
//! their rows.

use crate::errors;
use crate::experiment::{Experiment, RunCallbacks};
use crate::program::COMMIT;
use crate::run::Run;
use palpate::experiment::metrics::truth::Truth;
use palpate::experiment::row::{TrialId, TrialRow};
use palpate::experiment::runner::{self, Progress};
use palpate::experiment::store::{self, RunFolder, input_hashes, resolved_beside};
use palpate::experiment::{self, Simulation};
use palpate::explore::planner::is_external;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

/// Name of an experiment that is sent to another process. It has no folder, so the text has
/// absolute paths.
const JOB_FILE: &str = "/palpate-job.toml";

/// Python planners by name, as in `Experiment.run`.
type OwnPlanners = Vec<(String, Py<PyAny>)>;

/// Built experiment that runs any of its trials.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct JobRunner {
    simulation: Simulation,
    /// SHA-256 of the input files and Python planners by key.
    #[pyo3(get)]
    inputs: BTreeMap<String, String>,
}

#[pymethods]
impl JobRunner {
    /// Builds the experiment `text`, from `RowCollector`, with the Python planners `own`.
    #[new]
    fn new(py: Python<'_>, text: String, own: OwnPlanners) -> PyResult<Self> {
        let experiment = experiment::Experiment::parse(Path::new(JOB_FILE), text, &[]);
        let experiment = Experiment(experiment.map_err(errors::config)?);
        let simulation = experiment.simulation(py, own)?;
        let inputs = input_hashes(&simulation).map_err(errors::run)?;
        Ok(Self { simulation, inputs })
    }

    /// Runs `trials`, pairs of number and planner. Returns lines of `trials.jsonl` in any order,
    /// and the exception that interrupted it. The options are those of `Experiment.run`.
    #[pyo3(signature = (trials, *, threads, raises, look, stop))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        trials: Vec<(u32, String)>,
        threads: usize,
        raises: bool,
        look: Py<PyAny>,
        stop: Py<PyAny>,
    ) -> PyResult<(Bound<'py, PyBytes>, Option<PyErr>)> {
        let mut jobs = runner::missing_jobs(&self.simulation, &[]).map_err(errors::other)?;
        let wanted: HashSet<_> = trials.iter().map(|(i, name)| (*i, name.as_str())).collect();
        jobs.retain(|(trial, planner)| wanted.contains(&(*trial, planner.name())));
        let callbacks = RunCallbacks::new(look, stop, raises);
        let lines = Mutex::new(Ok(Vec::new()));
        let tick = |progress: Progress| {
            callbacks.count(&progress);
            let Progress::Trial(row) = progress else { return };
            // The interruption may have caused the failure; the trial is run again.
            let is_certain = row.failure.is_none()
                || !callbacks.is_stopped.load(Ordering::Relaxed)
                || callbacks.has_failure();
            let mut lines = lines.lock().unwrap_or_else(PoisonError::into_inner);
            if let (true, Ok(bytes)) = (is_certain, &mut *lines)
                && let Err(error) = append_line(bytes, row)
            {
                *lines = Err(error);
            }
        };
        let total = jobs.len();
        let run = callbacks.watched(py, total, || {
            let stop = &callbacks.is_stopped;
            runner::run_in_memory(&self.simulation, jobs, threads, stop, &tick).map(|_| ())
        });
        let interruption = match run {
            Ok(done) => done.map_err(errors::other).map(|()| None)?,
            Err(error) => Some(error),
        };
        let lines = lines.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok((PyBytes::new(py, &lines.map_err(errors::other)?), interruption))
    }
}

/// Appends a row as a line of `trials.jsonl`.
fn append_line(lines: &mut Vec<u8>, row: &TrialRow) -> serde_json::Result<()> {
    serde_json::to_writer(&mut *lines, row)?;
    lines.push(b'\n');
    Ok(())
}

/// Collection of the rows of an experiment whose trials run in other processes.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct RowCollector {
    experiment: experiment::Experiment,
    truth: Truth,
    /// SHA-256 of the input files and Python planners by key.
    #[pyo3(get)]
    inputs: BTreeMap<String, String>,
    /// Folder of the run; `None` for a run in memory.
    path: Option<PathBuf>,
    rows: Mutex<CollectedRows>,
}

struct CollectedRows {
    /// Folder open for writing, until it is closed.
    folder: Option<RunFolder>,
    /// Rows of a run in memory.
    rows: Vec<TrialRow>,
    /// Trials with a row.
    done: HashSet<TrialId>,
}

#[pymethods]
impl RowCollector {
    /// Opens the run folder `out`, or a run in memory. `own` and `fresh` are those of
    /// `Experiment.run`.
    #[new]
    fn new(
        py: Python<'_>,
        experiment: &Experiment,
        own: OwnPlanners,
        out: Option<PathBuf>,
        fresh: bool,
    ) -> PyResult<Self> {
        let simulation = experiment.simulation(py, own)?;
        let (folder, done) = match &out {
            None => (None, Vec::new()),
            Some(path) => {
                let opened = RunFolder::open(path, &simulation, COMMIT, fresh);
                let (folder, done) = opened.map_err(errors::run)?;
                (Some(folder), done)
            }
        };
        // Checks that all planners are available.
        runner::missing_jobs(&simulation, &done).map_err(errors::other)?;
        let done = done.into_iter().collect();
        Ok(Self {
            experiment: simulation.experiment().clone(),
            truth: simulation.truth().clone(),
            inputs: input_hashes(&simulation).map_err(errors::run)?,
            path: out,
            rows: Mutex::new(CollectedRows { folder, rows: Vec::new(), done }),
        })
    }

    /// Experiment as text for `JobRunner`, with absolute paths.
    #[getter]
    fn text(&self) -> String {
        resolved_beside(&self.experiment, Path::new(JOB_FILE))
    }

    /// Trials without a row, pairs of number and planner, ordered by trial.
    #[getter]
    fn missing(&self) -> Vec<(u32, String)> {
        let rows = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        let missing = self.experiment.missing_trials(&rows.done).into_iter();
        missing.map(|(trial, planner)| (trial, planner.into())).collect()
    }

    /// Number of trials with a row.
    #[getter]
    fn done(&self) -> usize {
        self.rows.lock().unwrap_or_else(PoisonError::into_inner).done.len()
    }

    /// Adds rows, lines of `trials.jsonl`; returns trial, planner and reason of each failed trial
    /// of a Python planner.
    ///
    /// # Errors
    /// If a line is not a row of a missing trial, or cannot be stored.
    fn add(&self, lines: &[u8]) -> PyResult<Vec<(u32, String, String)>> {
        let mut all = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        let mut failed = Vec::new();
        for line in lines.split_inclusive(|&byte| byte == b'\n') {
            let row: TrialRow = serde_json::from_slice(line)
                .map_err(|error| errors::other(format!("a job returned no row: {error}")))?;
            let id = row.id();
            if !self.experiment.contains_trial(&id) || all.done.contains(&id) {
                let (trial, planner) = (id.trial, id.planner);
                let problem =
                    format!("a job returned trial {trial} of {planner}, which is not missing");
                return Err(errors::other(problem));
            }
            if let (true, Some(reason)) = (is_external(&row.planner), &row.failure) {
                failed.push((row.trial, row.planner.clone(), reason.clone()));
            }
            match &mut all.folder {
                Some(folder) => folder.append(&row).map_err(errors::run)?,
                None => all.rows.push(row),
            }
            all.done.insert(id);
        }
        Ok(failed)
    }

    /// Sorts the rows and closes the folder, so that another run can use it.
    fn close(&self) -> PyResult<()> {
        let mut all = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        match all.folder.take() {
            Some(folder) => folder.sort(&self.experiment).map(|_| ()).map_err(errors::run),
            None => Ok(()),
        }
    }

    /// Closes the folder and returns the run.
    fn run(&self) -> PyResult<Run> {
        self.close()?;
        if let Some(path) = &self.path {
            return store::Run::read(path).map(Run).map_err(errors::run);
        }
        let mut all = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        let mut rows = std::mem::take(&mut all.rows);
        let planners = &self.experiment.planners;
        rows.sort_by_key(|row| {
            (row.trial, planners.iter().position(|planner| *planner == row.planner))
        });
        let (experiment, truth) = (self.experiment.clone(), self.truth.clone());
        Ok(Run(store::Run { experiment, truth, rows, unlisted: 0 }))
    }
}
