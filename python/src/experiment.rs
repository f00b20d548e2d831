//! An experiment, and its run with the interpreter lock released.

use crate::errors;
use crate::planner::PythonFactory;
use crate::program::COMMIT;
use crate::run::Run;
use crate::zone::Zone;
use palpate::experiment::runner::{self, Progress};
use palpate::experiment::store::{self, RunFolder, resolved};
use palpate::experiment::{self, Simulation};
use palpate::explore::planner::PlannerFactory;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Interval between two checks of Ctrl-C and two progress reports of a run.
// heuristic: short enough to feel immediate.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// An experiment: planners × trials on one scene.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct Experiment(experiment::Experiment);

#[pymethods]
impl Experiment {
    #[staticmethod]
    fn load(path: PathBuf, sets: Vec<String>) -> PyResult<Self> {
        experiment::Experiment::load(&path, &sets).map(Self).map_err(errors::config)
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

    /// Runs the missing trials. `own` pairs names of Python planners with their factories; `how`
    /// has the folder, whether to start again, and the number of threads. `(look, stop)` are
    /// callbacks: `look` gets the number of finished and of all trials at intervals, `stop` is
    /// called when the run is stopped.
    fn run(
        &self,
        py: Python<'_>,
        own: Vec<(String, Py<PyAny>)>,
        how: (Option<PathBuf>, bool, usize),
        callbacks: (Py<PyAny>, Py<PyAny>),
    ) -> PyResult<Run> {
        let (out, fresh, threads) = how;
        let (look, stop) = callbacks;
        let makers = own
            .into_iter()
            .map(|(name, start)| -> PyResult<Box<dyn PlannerFactory>> {
                Ok(Box::new(PythonFactory::new(py, name, start)?))
            })
            .collect::<PyResult<_>>()?;
        let experiment = self.0.clone();
        let simulation = py.detach(|| Simulation::new(experiment)).map_err(errors::scene)?;
        simulation.simulator().check_reach().map_err(errors::scene)?;
        if simulation.is_real() {
            return Err(errors::scene(
                "backend.kind: only the program (palpate run) moves a real arm, with an operator present; \
                 allowed here is \"simulated\"",
            ));
        }
        let simulation = simulation.with_planners(makers);
        let callbacks = RunCallbacks {
            look,
            stop,
            done: AtomicUsize::new(0),
            is_stopped: AtomicBool::new(false),
        };
        let run = match &out {
            Some(folder) => callbacks.kept(py, &simulation, (folder, fresh), threads),
            None => callbacks.in_memory(py, &simulation, threads),
        };
        // Releases the Python planners before the interpreter continues.
        drop(simulation);
        run
    }
}

/// A run with its callbacks.
struct RunCallbacks {
    look: Py<PyAny>,
    stop: Py<PyAny>,
    done: AtomicUsize,
    is_stopped: AtomicBool,
}

impl RunCallbacks {
    fn kept(
        &self,
        py: Python<'_>,
        simulation: &Simulation,
        (path, fresh): (&Path, bool),
        threads: usize,
    ) -> PyResult<Run> {
        let experiment = simulation.experiment();
        let (mut folder, done) =
            RunFolder::open(path, simulation, COMMIT, fresh).map_err(errors::run)?;
        let jobs = runner::missing_jobs(simulation, &done).map_err(errors::other)?;
        self.done.store(done.len(), Ordering::Relaxed);
        let total = done.len() + jobs.len();
        let outcome = self.watched(py, total, || {
            let tick = |progress: Progress| {
                let trials = usize::from(matches!(progress, Progress::Trial(_)));
                self.done.fetch_add(trials, Ordering::Relaxed);
            };
            runner::run(simulation, (&mut folder, jobs), threads, &self.is_stopped, None, &tick)
        });
        folder.sort(experiment).map_err(errors::run)?;
        outcome?.map_err(errors::run)?;
        store::Run::read(path).map(Run).map_err(errors::run)
    }

    fn in_memory(&self, py: Python<'_>, simulation: &Simulation, threads: usize) -> PyResult<Run> {
        let jobs = runner::missing_jobs(simulation, &[]).map_err(errors::other)?;
        let rows = self.watched(py, jobs.len(), || {
            let tick = |progress: Progress| {
                let trials = usize::from(matches!(progress, Progress::Trial(_)));
                self.done.fetch_add(trials, Ordering::Relaxed);
            };
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
    fn watched<T: Send>(
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
                    let result = work();
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
            (None, Ok(result)) => Ok(result),
            (None, Err(_)) => Err(errors::other("a thread of the run panicked")),
        }
    }
}
