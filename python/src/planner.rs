//! A planner written in Python, as an experiment runs it.

use crate::belief::Belief;
use crate::zone::Zone;
use palpate::explore::belief;
use palpate::explore::planner::{Maker, Plan, Planner, PlanningSettings, Sight, Undecided};
use palpate::task;
use pyo3::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Makes a planner of Python for each trial.
pub(crate) struct PythonMaker {
    /// `MODULE:CLASS`.
    pub(crate) name: String,
    /// Called with zone and seed; its result has `plan(belief) -> sequence of float` and `close()`,
    /// and what it raises is the reason why there is no target.
    pub(crate) start: Py<PyAny>,
}

impl Maker for PythonMaker {
    fn name(&self) -> &str {
        &self.name
    }

    fn make(
        &self,
        zone: &task::Zone,
        _: &PlanningSettings,
        mut random: ChaCha8Rng,
    ) -> Box<dyn Planner> {
        let seed: u64 = random.random();
        let begun = Python::attach(|py| {
            self.start.call1(py, (Zone(zone.clone()), seed)).map_err(|error| reason(py, &error))
        });
        Box::new(PythonPlanner { begun, dimension: zone.dimension() })
    }
}

struct PythonPlanner {
    begun: Result<Py<PyAny>, String>,
    dimension: usize,
}

impl PythonPlanner {
    fn target(&self, belief: &belief::Belief) -> Result<Vec<f64>, String> {
        let begun = self.begun.as_ref().map_err(Clone::clone)?;
        let belief = Belief(belief.clone());
        Python::attach(|py| {
            let planned = begun.call_method1(py, "plan", (belief,));
            planned.and_then(|target| target.extract(py)).map_err(|error| reason(py, &error))
        })
    }
}

impl Planner for PythonPlanner {
    fn plan(&mut self, belief: &belief::Belief) -> Plan {
        let nowhere = vec![f64::NAN; self.dimension];
        Plan { target: self.target(belief).unwrap_or(nowhere), sd_m: None, stall: None }
    }

    fn decide(&mut self, belief: &belief::Belief, _: &dyn Sight) -> Result<Plan, Undecided> {
        let target = self.target(belief).map_err(|reason| Undecided { reason })?;
        if target.len() != self.dimension {
            let (found, wanted) = (target.len(), self.dimension);
            let reason = format!("it has {found} coordinates, a target of this zone {wanted}");
            return Err(Undecided { reason });
        }
        Ok(Plan { target, sd_m: None, stall: None })
    }
}

impl Drop for PythonPlanner {
    fn drop(&mut self) {
        if let Ok(begun) = &self.begun {
            // Nobody is left to be told that it could not be ended.
            Python::try_attach(|py| begun.call_method0(py, "close").is_ok());
        }
    }
}

/// What an exception says.
fn reason(py: Python<'_>, error: &PyErr) -> String {
    error.value(py).to_string()
}
