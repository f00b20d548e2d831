//! An experiment, and its run with the interpreter lock released.

use crate::errors;
use crate::fork;
use crate::pickle::{self, Reduced, Version};
use crate::planner::PythonFactory;
use crate::program::COMMIT;
use crate::run::Run;
use crate::zone::Zone;
use palpate::config::Loader;
use palpate::experiment::runner::{self, Progress};
use palpate::experiment::store::{self, RunFolder, resolved, write_whole};
use palpate::experiment::{self, Simulation};
use palpate::explore::planner::{PlannerFactory, is_external};
use palpate::report::check;
use palpate::study::check::{
    CheckOptions, CheckResult, StoredBaseline, accepted, baseline_rows, failures, run_check,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Interval of the checks for Ctrl-C and of the progress reports of a run.
// heuristic: short enough to feel immediate.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// An experiment: planners × trials on one scene.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct Experiment(pub(crate) experiment::Experiment);

#[pymethods]
impl Experiment {
    /// Loads an experiment from its file, or from assignments alone; `home` is the folder of the
    /// shipped files.
    #[staticmethod]
    fn load(path: Option<PathBuf>, sets: Vec<String>, home: PathBuf) -> PyResult<Self> {
        let loader = match &path {
            Some(path) => Loader::read(path),
            None => Loader::from_text(errors::SETTINGS.as_ref(), String::new()),
        };
        let loader = loader.map_err(errors::config)?.with_home(&home);
        experiment::Experiment::from_loader(loader, &sets).map(Self).map_err(errors::config)
    }

    /// Returns the experiment after more assignments.
    fn with_settings(&self, sets: Vec<String>) -> PyResult<Self> {
        parsed(resolved(&self.0), &sets).map(Self)
    }

    #[staticmethod]
    fn _restore(version: Version, toml: String) -> PyResult<Self> {
        pickle::check(&version, "Experiment")?;
        parsed(toml, &[]).map(Self)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, (Version, String)>> {
        let Self(experiment) = slf.get();
        pickle::reduced(slf, (pickle::version(), resolved(experiment)))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn question(&self) -> &str {
        &self.0.question
    }

    #[getter]
    fn planners(&self) -> Vec<String> {
        self.0.planners.clone()
    }

    #[getter]
    fn trials(&self) -> u32 {
        self.0.trials
    }

    #[getter]
    fn touches(&self) -> u32 {
        self.0.touches
    }

    #[getter]
    fn initial_touches(&self) -> u32 {
        self.0.initial_touches
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    #[getter]
    fn zone(&self) -> PyResult<Zone> {
        let zone = self.0.scene.zone.clone().map(Zone);
        zone.ok_or_else(|| errors::not_around("zone", "ball, of its run"))
    }

    fn to_toml(&self) -> String {
        resolved(&self.0)
    }

    /// Runs the missing trials, in the folder `out` if there is one. `own` pairs names of Python
    /// planners with their factories; with `raises`, the first error of one of them ends the run.
    /// `look` is called with the number of finished and of all trials at intervals, `stop` when
    /// the run is stopped.
    #[pyo3(signature = (own, *, out, fresh, threads, raises, look, stop))]
    #[allow(clippy::too_many_arguments)]
    fn run(
        &self,
        py: Python<'_>,
        own: Vec<(String, Py<PyAny>)>,
        out: Option<PathBuf>,
        fresh: bool,
        threads: usize,
        raises: bool,
        look: Py<PyAny>,
        stop: Py<PyAny>,
    ) -> PyResult<Run> {
        let simulation = self.simulation(py, own)?;
        let callbacks = RunCallbacks::new(look, stop, raises);
        let run = match &out {
            Some(folder) => callbacks.kept(py, &simulation, folder, fresh, threads),
            None => callbacks.in_memory(py, &simulation, threads),
        };
        // Releases the Python planners before the interpreter continues.
        drop(simulation);
        match callbacks.failure.into_inner().unwrap_or_default() {
            Some(failure) => Err(errors::planner(failure)),
            None => run,
        }
    }

    /// Tests the planners for regressions against the file `baseline`, as the command
    /// `palpate check` does: returns verdict, remarks, and the columns of a table. With a reason to
    /// `accept`, writes the file instead, without a table. With `is_partial`, the baseline's other
    /// planners are left alone. The other options are those of `run`.
    #[pyo3(signature = (own, *, baseline, accept, tolerance, threads, is_partial, look, stop))]
    #[allow(clippy::too_many_arguments)]
    fn check<'py>(
        &self,
        py: Python<'py>,
        own: Vec<(String, Py<PyAny>)>,
        baseline: PathBuf,
        accept: Option<String>,
        tolerance: f64,
        threads: usize,
        is_partial: bool,
        look: Py<PyAny>,
        stop: Py<PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let old = match accept.is_some() && !baseline.exists() {
            true => None,
            false => Some(StoredBaseline::read(&baseline).map_err(errors::other)?),
        };
        if let Some(old) = &old {
            old.check_pairs(&baseline, &self.0).map_err(errors::other)?;
        }
        let simulation = self.simulation(py, own)?;
        let callbacks = RunCallbacks::new(look, stop, false);
        let tick = |progress: Progress| callbacks.count(&progress);
        let stop = &callbacks.is_stopped;
        let total = runner::missing_jobs(&simulation, &[]).map_err(errors::other)?.len();
        let rules = CheckOptions { tolerance, ..CheckOptions::default() };
        let Some(why) = accept else {
            let mut old = old.ok_or_else(|| errors::other("no baseline"))?;
            if is_partial {
                old.keep_planners(&self.0.planners);
            }
            let run = || run_check(&simulation, &old, &rules, threads, stop, &tick);
            let result = callbacks.watched(py, total, run)?.map_err(errors::other)?;
            return check_table(py, &self.0, &result, &rules);
        };
        let run = || baseline_rows(&simulation, threads, stop, &tick);
        let rows = callbacks.watched(py, total, run)?.map_err(errors::other)?;
        let new = accepted(&simulation, &rows, &why, old.as_ref(), is_partial, &rules);
        let text = new.map_err(errors::other)?.text().map_err(errors::other)?;
        write_whole(&baseline, &text).map_err(errors::other)?;
        let failed = |name: &String| Some(format!("{name}: {}", failures(&rows, name)?));
        let found = PyDict::new(py);
        found.set_item("verdict", "accepted")?;
        let remarks: Vec<String> = self.0.planners.iter().filter_map(failed).collect();
        found.set_item("remarks", remarks)?;
        found.set_item("failures", Vec::<String>::new())?;
        found.set_item("table", PyDict::new(py))?;
        found.set_item("text", format!("baseline in {}", baseline.display()))?;
        found.set_item("svg", None::<String>)?;
        Ok(found)
    }
}

/// Reads an experiment from the text of all its settings, after assignments.
///
/// # Errors
/// `ConfigError`.
pub(crate) fn parsed(toml: String, sets: &[String]) -> PyResult<experiment::Experiment> {
    let text = Loader::from_text(errors::SETTINGS.as_ref(), toml);
    let read = text.and_then(|loader| experiment::Experiment::from_loader(loader, sets));
    read.map_err(errors::config)
}

impl Experiment {
    /// Builds the simulation, with the Python planners `own`.
    pub(crate) fn simulation(
        &self,
        py: Python<'_>,
        own: Vec<(String, Py<PyAny>)>,
    ) -> PyResult<Simulation> {
        let makers = own
            .into_iter()
            .map(|(name, start)| -> PyResult<Box<dyn PlannerFactory>> {
                Ok(Box::new(PythonFactory::new(py, name, start)?))
            })
            .collect::<PyResult<_>>()?;
        let experiment = self.0.clone();
        let simulation =
            fork::detach(py, || Simulation::new(experiment))?.map_err(errors::scene)?;
        simulation.simulator().check_reach().map_err(errors::scene)?;
        if simulation.is_real() {
            return Err(errors::scene(
                "[backend]: only the program (palpate run) moves a real arm, with an operator present; \
                 allowed here is a simulation",
            ));
        }
        Ok(simulation.with_planners(makers))
    }
}

/// Returns verdict, remarks, the columns of the table, and text and figure of a check.
fn check_table<'py>(
    py: Python<'py>,
    experiment: &experiment::Experiment,
    result: &CheckResult,
    rules: &CheckOptions,
) -> PyResult<Bound<'py, PyDict>> {
    let rows = result.planners.iter().flat_map(|planner| {
        let line = |(title, change, verdict): (_, Option<_>, _)| {
            let change = change.unwrap_or([f64::NAN; 3]);
            (planner.name.as_str(), title, change, check::word(verdict), planner.trials)
        };
        planner.lines().into_iter().map(line)
    });
    let rows: Vec<_> = rows.collect();
    let table = PyDict::new(py);
    table.set_item("planner", rows.iter().map(|row| row.0).collect::<Vec<_>>())?;
    table.set_item("measure", rows.iter().map(|row| row.1).collect::<Vec<_>>())?;
    for (i, name) in ["change_percent", "low_percent", "high_percent"].iter().enumerate() {
        table.set_item(*name, rows.iter().map(|row| row.2[i]).collect::<Vec<_>>())?;
    }
    let verdicts = rows.iter().map(|row| row.3.to_lowercase());
    table.set_item("verdict", verdicts.collect::<Vec<_>>())?;
    table.set_item("trials", rows.iter().map(|row| row.4).collect::<Vec<_>>())?;
    let found = PyDict::new(py);
    found.set_item("verdict", check::word(result.verdict()).to_lowercase())?;
    found.set_item("remarks", check::remarks(result, rules, experiment.trials))?;
    found.set_item("failures", check::failures(result))?;
    found.set_item("table", table)?;
    found.set_item("text", check::table(result).text())?;
    found.set_item("svg", check::draw(&experiment.name, result, rules))?;
    Ok(found)
}

/// A run with its callbacks.
pub(crate) struct RunCallbacks {
    look: Py<PyAny>,
    stop: Py<PyAny>,
    done: AtomicUsize,
    /// Whether no further trials are started.
    pub(crate) is_stopped: AtomicBool,
    /// Whether the first failed trial of a Python planner ends the run.
    raises: bool,
    /// First failed trial and its reason.
    failure: Mutex<Option<String>>,
}

impl RunCallbacks {
    pub(crate) fn new(look: Py<PyAny>, stop: Py<PyAny>, raises: bool) -> Self {
        let (done, is_stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
        Self { look, stop, done, is_stopped, raises, failure: Mutex::default() }
    }

    /// Counts a finished trial; stops the run if it failed and errors are raised.
    pub(crate) fn count(&self, progress: &Progress) {
        let Progress::Trial(row) = progress else { return };
        self.done.fetch_add(1, Ordering::Relaxed);
        if let (true, Some(reason)) = (self.raises && is_external(&row.planner), &row.failure)
            && let Ok(mut failure) = self.failure.lock()
        {
            let text = || format!("{}, trial {}: {reason}", row.planner, row.trial);
            failure.get_or_insert_with(text);
            self.is_stopped.store(true, Ordering::Relaxed);
        }
    }

    /// Counts a finished piece of a study.
    pub(crate) fn step(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    /// Whether a failed trial has ended the run.
    pub(crate) fn has_failure(&self) -> bool {
        self.failure.lock().is_ok_and(|failure| failure.is_some())
    }

    fn kept(
        &self,
        py: Python<'_>,
        simulation: &Simulation,
        path: &Path,
        fresh: bool,
        threads: usize,
    ) -> PyResult<Run> {
        let experiment = simulation.experiment();
        let (mut folder, done) =
            RunFolder::open(path, simulation, COMMIT, fresh).map_err(errors::run)?;
        let jobs = runner::missing_jobs(simulation, &done).map_err(errors::other)?;
        self.done.store(done.len(), Ordering::Relaxed);
        let total = done.len() + jobs.len();
        let outcome = self.watched(py, total, || {
            let tick = |progress: Progress| self.count(&progress);
            runner::run(simulation, &mut folder, jobs, threads, &self.is_stopped, None, &tick)
        });
        folder.sort(experiment).map_err(errors::run)?;
        outcome?.map_err(errors::run)?;
        store::Run::read(path).map(Run).map_err(errors::run)
    }

    fn in_memory(&self, py: Python<'_>, simulation: &Simulation, threads: usize) -> PyResult<Run> {
        let jobs = runner::missing_jobs(simulation, &[]).map_err(errors::other)?;
        let rows = self.watched(py, jobs.len(), || {
            let tick = |progress: Progress| self.count(&progress);
            runner::run_in_memory(simulation, jobs, threads, &self.is_stopped, &tick)
        })?;
        Ok(Run(store::Run {
            experiment: simulation.experiment().clone(),
            truth: simulation.truth().clone(),
            rows: rows.map_err(errors::other)?,
            unlisted: 0,
        }))
    }

    /// Runs `work` on its own thread without the interpreter lock and returns its result. This
    /// thread checks for Ctrl-C; after it, running trials are finished.
    ///
    /// # Errors
    /// `KeyboardInterrupt`, or the exception that `look` raises.
    pub(crate) fn watched<T: Send>(
        &self,
        py: Python<'_>,
        total: usize,
        work: impl FnOnce() -> T + Send,
    ) -> PyResult<T> {
        let mut raised = None;
        let result = py.detach(|| {
            std::thread::scope(|scope| {
                let (ended, end) = channel::<()>();
                let working = scope.spawn(move || {
                    let result = fork::install(work);
                    drop(ended);
                    result
                });
                while end.recv_timeout(POLL_INTERVAL) == Err(RecvTimeoutError::Timeout) {
                    let looked = Python::attach(|py| {
                        py.check_signals()?;
                        self.look.call1(py, (self.done.load(Ordering::Relaxed), total)).map(|_| ())
                    });
                    if let Err(error) = looked
                        && raised.is_none()
                    {
                        self.is_stopped.store(true, Ordering::Relaxed);
                        Python::attach(|py| self.stop.call0(py).is_ok());
                        raised = Some(error);
                    }
                }
                working.join()
            })
        });
        self.look.call1(py, (self.done.load(Ordering::Relaxed), total))?;
        match (raised, result) {
            (Some(error), _) => Err(error),
            (None, Ok(result)) => result,
            (None, Err(_)) => Err(errors::other("a thread of the run panicked")),
        }
    }
}
