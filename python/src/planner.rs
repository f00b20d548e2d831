//! A planner written in Python, as an experiment runs it.

use crate::belief::Belief;
use crate::desk::{Desk, NoTarget, Trial};
use crate::known::{AIM, Known};
use crate::zone::Zone;
use palpate::explore::planner::{Maker, Plan, Planner, PlanningSettings, Sight, Undecided};
use palpate::explore::{around, belief};
use palpate::task;
use pyo3::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Makes a planner of Python for each trial.
pub(crate) struct PythonMaker {
    /// `MODULE:CLASS`.
    pub(crate) name: String,
    /// Called with zone, None around an object, and seed. Its result has `close()`, and `desk` with `abandon()`, or
    /// `plan(belief) -> sequence of float`; what that raises is the reason why there is no target.
    pub(crate) start: Py<PyAny>,
    /// The source that decides its plans.
    pub(crate) source: String,
}

impl Maker for PythonMaker {
    fn name(&self) -> &str {
        &self.name
    }

    fn source(&self) -> Option<String> {
        Some(self.source.clone())
    }

    fn make(
        &self,
        zone: &task::Zone,
        _: &PlanningSettings,
        random: ChaCha8Rng,
    ) -> Box<dyn Planner> {
        Box::new(self.begin(Some(zone), random))
    }

    fn make_around(
        &self,
        _: &PlanningSettings,
        random: ChaCha8Rng,
    ) -> Option<Box<dyn around::planner::Planner>> {
        Some(Box::new(self.begin(None, random)))
    }
}

impl PythonMaker {
    /// Makes the planners of `name` by `start`, which says the source as `source`.
    ///
    /// # Errors
    /// If `start` has no source.
    pub(crate) fn new(py: Python<'_>, name: String, start: Py<PyAny>) -> PyResult<Self> {
        let source = start.getattr(py, "source")?.extract(py)?;
        Ok(Self { name, start, source })
    }

    fn begin(&self, zone: Option<&task::Zone>, mut random: ChaCha8Rng) -> PythonPlanner {
        let seed: u64 = random.random();
        let begun = Python::attach(|py| {
            let zone = zone.map(|zone| Zone(zone.clone()));
            self.start.call1(py, (zone, seed)).map_err(|error| reason(py, &error))
        });
        let desk = begun.as_ref().ok().and_then(|begun| {
            Python::attach(|py| {
                let desk = begun.getattr(py, "desk").ok()?;
                desk.cast_bound::<Desk>(py).ok()?.get().trial()
            })
        });
        PythonPlanner { begun, desk, dimension: zone.map_or(AIM, task::Zone::dimension) }
    }
}

struct PythonPlanner {
    begun: Result<Py<PyAny>, String>,
    /// Where it is asked, if it sits on a thread of its own.
    desk: Option<Trial>,
    dimension: usize,
}

impl PythonPlanner {
    fn target(&self, belief: Known) -> Result<Vec<f64>, String> {
        let begun = self.begun.as_ref().map_err(Clone::clone)?;
        if let Some(desk) = &self.desk {
            return desk.ask(belief).map_err(|no_target| match no_target {
                NoTarget::Said(reason) => reason,
                NoTarget::Late(limit) => {
                    // Nobody is left to be told that it could not be left behind.
                    Python::attach(|py| begun.call_method0(py, "abandon").is_ok());
                    format!("it did not return within {} s", limit.as_secs_f64())
                }
            });
        }
        let belief = Belief(belief);
        Python::attach(|py| {
            let planned = begun.call_method1(py, "plan", (belief,));
            planned.and_then(|target| target.extract(py)).map_err(|error| reason(py, &error))
        })
    }
}

impl PythonPlanner {
    fn decided(&self, belief: Known) -> Result<Plan, Undecided> {
        let of = if matches!(belief, Known::Zone(_)) { "of this zone" } else { "around an object" };
        let target = self.target(belief).map_err(|reason| Undecided { reason })?;
        if target.len() != self.dimension {
            let (found, wanted) = (target.len(), self.dimension);
            let reason = format!("it has {found} coordinates, a target {of} {wanted}");
            return Err(Undecided { reason });
        }
        Ok(Plan { target, sd_m: None, stall: None })
    }

    /// For who cannot be told that there is no target.
    fn anywhere(&self, belief: Known) -> Plan {
        let nowhere = vec![f64::NAN; self.dimension];
        Plan { target: self.target(belief).unwrap_or(nowhere), sd_m: None, stall: None }
    }
}

impl Planner for PythonPlanner {
    fn plan(&mut self, belief: &belief::Belief) -> Plan {
        self.anywhere(Known::Zone(belief.clone()))
    }

    fn decide(&mut self, belief: &belief::Belief, _: &dyn Sight) -> Result<Plan, Undecided> {
        self.decided(Known::Zone(belief.clone()))
    }
}

impl around::planner::Planner for PythonPlanner {
    fn plan(&mut self, belief: &around::Belief) -> Plan {
        self.anywhere(Known::Around(belief.clone()))
    }

    fn decide(
        &mut self,
        belief: &around::Belief,
        _: &dyn around::planner::Sight,
    ) -> Result<Plan, Undecided> {
        self.decided(Known::Around(belief.clone()))
    }
}

impl Drop for PythonPlanner {
    fn drop(&mut self) {
        // So that its thread ends.
        self.desk = None;
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
