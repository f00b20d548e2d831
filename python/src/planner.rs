//! Python planners in experiments.

use crate::belief::Belief;
use crate::desk::{NoTarget, PlannerChannel, TrialEnd};
use crate::known::Known;
use crate::target::TargetInput;
use crate::zone::Zone;
use palpate::explore::planner::{
    Offer, Plan, PlanError, Planner, PlannerFactory, PlanningSettings, RefinedPlanner,
};
use palpate::task;
use pyo3::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Factory of a Python planner for each trial.
pub(crate) struct PythonFactory {
    /// Name, `MODULE:CLASS`.
    pub(crate) name: String,
    /// Function that starts a planner from the zone (None around an object) and the seed. The
    /// result has `close()`, and either `desk` with `abandon()` or `plan(belief) -> target`, whose
    /// exception is the reason for a missing target.
    pub(crate) start: Py<PyAny>,
    /// Source code that determines the plans.
    pub(crate) source: String,
}

impl PlannerFactory for PythonFactory {
    fn name(&self) -> &str {
        &self.name
    }

    fn source(&self) -> Option<String> {
        Some(self.source.clone())
    }

    fn make(&self, _: &PlanningSettings, mut random: ChaCha8Rng) -> Box<dyn Planner> {
        let start = Python::attach(|py| self.start.clone_ref(py));
        Box::new(RefinedPlanner(PythonPlanner { start, seed: random.random(), begun: None }))
    }
}

impl PythonFactory {
    /// Creates the factory of planner `name` from `start`, whose attribute `source` is the source
    /// code.
    ///
    /// # Errors
    /// If `start` has no source.
    pub(crate) fn new(py: Python<'_>, name: String, start: Py<PyAny>) -> PyResult<Self> {
        let source = start.getattr(py, "source")?.extract(py)?;
        Ok(Self { name, start, source })
    }
}

/// Planner of one trial, created at its first plan.
struct PythonPlanner {
    start: Py<PyAny>,
    seed: u64,
    begun: Option<Result<StartedPlanner, String>>,
}

struct StartedPlanner {
    planner: Py<PyAny>,
    /// Channel to the planner, if it has its own thread.
    desk: Option<TrialEnd>,
}

impl PythonPlanner {
    fn begin(&self, zone: Option<&task::Zone>) -> Result<StartedPlanner, String> {
        Python::attach(|py| {
            let zone = zone.map(|zone| Zone(zone.clone()));
            let planner = self.start.call1(py, (zone, self.seed));
            let planner = planner.map_err(|error| reason(py, &error))?;
            let desk = planner.getattr(py, "desk").ok();
            let desk =
                desk.and_then(|desk| desk.cast_bound::<PlannerChannel>(py).ok()?.get().trial());
            Ok(StartedPlanner { planner, desk })
        })
    }

    fn target(&mut self, belief: &Known) -> Result<TargetInput, String> {
        if self.begun.is_none() {
            self.begun = Some(self.begin(belief.region().zone()));
        }
        let Some(begun) = &self.begun else { return Err("the planner was not started".into()) };
        let StartedPlanner { planner, desk } = begun.as_ref().map_err(Clone::clone)?;
        if let Some(desk) = desk {
            return desk.ask(belief.clone()).map_err(|no_target| match no_target {
                NoTarget::Failed(reason) => reason,
                NoTarget::Timeout(limit) => {
                    // A failure here has no consequence.
                    Python::attach(|py| planner.call_method0(py, "abandon").is_ok());
                    format!("the planner did not return within {} s", limit.as_secs_f64())
                }
            });
        }
        let belief = Belief(belief.clone());
        Python::attach(|py| {
            let planned = planner.call_method1(py, "plan", (belief,));
            planned.and_then(|target| target.extract(py)).map_err(|error| reason(py, &error))
        })
    }
}

impl Planner for PythonPlanner {
    fn plan(&mut self, belief: &Known, _offer: &Offer) -> Result<Plan, PlanError> {
        let planned = self.target(belief);
        let target = planned.and_then(|target| target.in_region(&belief.region()));
        target.map(Plan::at).map_err(|reason| PlanError { reason })
    }
}

impl Drop for PythonPlanner {
    fn drop(&mut self) {
        if let Some(Ok(StartedPlanner { planner, desk })) = self.begun.take() {
            // Ends the planner's thread.
            drop(desk);
            // A failure here has no consequence.
            Python::try_attach(|py| planner.call_method0(py, "close").is_ok());
        }
    }
}

/// Message of an exception.
fn reason(py: Python<'_>, error: &PyErr) -> String {
    error.value(py).to_string()
}
