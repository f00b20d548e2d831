//! Interactive exploration: touch by touch, with the belief after each.

use crate::belief::Belief;
use crate::known::{self, BeliefErrors, GroundTruth, Known};
use crate::scene::{Scene, Touch};
use crate::{errors, exploration, fork};
use palpate::format::counted;
use palpate::task::Target;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};

/// Interactive exploration of a scene: each touch updates a belief, which is fitted and can be
/// compared with the ground truth.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Exploration {
    scene: Py<Scene>,
    known: Mutex<Known>,
    truth: GroundTruth,
}

/// Default cells along the longest side of a measured surface.
const CELLS: u32 = 64;

#[pymethods]
impl Exploration {
    #[new]
    fn new(py: Python<'_>, scene: Py<Scene>) -> PyResult<Self> {
        let environment = scene.get().environment();
        let (known, truth) = fork::detach(py, || {
            (
                known::empty_belief(environment),
                GroundTruth::of(environment, exploration::TRUTH_PER_SIDE),
            )
        })?;
        Ok(Self { known: Mutex::new(known), truth, scene })
    }

    /// Makes a touch at a target and fits the belief.
    fn touch(&self, py: Python<'_>, target: Vec<f64>) -> PyResult<Touch> {
        let (touch, outcome) = self.scene.get().touched(py, target.clone())?;
        let fitted = py.detach(|| {
            let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(target) = Target::from_numbers(&target) {
                known.observe(&target, &outcome);
            }
            known.refit().map(|_| ())
        });
        fitted.map_err(errors::other)?;
        Ok(touch)
    }

    /// Belief after the touches so far.
    #[getter]
    fn belief(&self) -> Belief {
        Belief(self.known.lock().unwrap_or_else(PoisonError::into_inner).clone())
    }

    /// Errors of the belief, named as in rows; None before the first touch.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let measured = fork::detach(py, || {
            let known = self.known.lock().unwrap_or_else(PoisonError::into_inner).clone();
            self.truth.measure(&known, CELLS)
        })?;
        let json = match measured {
            Some(BeliefErrors::Zone(metrics)) => serde_json::to_value(metrics),
            Some(BeliefErrors::Around(metrics)) => serde_json::to_value(metrics),
            None => return Ok(None),
        };
        let values = PyDict::new(py);
        for (name, value) in json.map_err(errors::other)?.as_object().into_iter().flatten() {
            values.set_item(name, value.as_f64())?;
        }
        Ok(Some(values))
    }

    fn __repr__(&self) -> String {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        format!("Exploration({})", counted(known.targets().len(), "touch"))
    }
}
