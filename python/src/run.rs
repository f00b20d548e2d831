//! A run, in memory or read from a folder.

use crate::ball::Ball;
use crate::belief::Belief;
use crate::columns;
use crate::errors;
use crate::fork;
use crate::known::Known;
use crate::places::rows;
use crate::zone::Zone;
use numpy::{PyArray1, PyArrayDyn};
use palpate::experiment::store;
use palpate::experiment::trial::row::TrialRow;
use palpate::report::replay::BeliefReplay;
use palpate::report::{tables, whole_object};
use palpate::task;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;

/// Rows of a run, with its experiment and ground truth.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct Run(pub(crate) store::Run);

/// Places and heights.
type Surface<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArray1<f64>>);

impl Run {
    fn over_zone(&self, name: &str) -> PyResult<&task::Zone> {
        let zone = self.0.experiment.scene.zone.as_ref();
        zone.ok_or_else(|| errors::not_around(name, "ball, and palpate.Scene's mesh()"))
    }

    fn row(&self, trial: u32, planner: &str) -> PyResult<&TrialRow> {
        let found = self.0.rows.iter().find(|row| row.trial == trial && row.planner == planner);
        found.ok_or_else(|| errors::other(format!("no trial {trial} of {planner} in this run")))
    }
}

#[pymethods]
impl Run {
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        py.detach(|| store::Run::read(&folder)).map(Self).map_err(errors::run)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.experiment.name
    }

    /// Settings of the run, with all defaults.
    fn to_toml(&self) -> String {
        store::resolved(&self.0.experiment)
    }

    #[getter]
    fn planners(&self) -> Vec<String> {
        self.0.experiment.planners.clone()
    }

    #[getter]
    fn zone(&self) -> PyResult<Zone> {
        Ok(Zone(self.over_zone("zone")?.clone()))
    }

    #[getter]
    fn ball(&self) -> PyResult<Ball> {
        let Some(around) = &self.0.experiment.scene.whole_object else {
            return Err(errors::not_over_zone("ball", "zone, truth()"));
        };
        let ball = around.ball().ok_or_else(|| errors::other("[whole_object] is incomplete"))?;
        Ok(Ball(ball))
    }

    /// Places (n, d) and heights (n,) of the true surface; NaN outside the object.
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Surface<'py>> {
        let zone = self.over_zone("truth")?;
        let truth = &self.0.truth;
        let heights_m = truth.heights_m.iter().map(|height_m| height_m.unwrap_or(f64::NAN));
        let places = rows(py, &truth.places, zone.dimension())?;
        Ok((places, PyArray1::from_iter(py, heights_m)))
    }

    /// Rows as bytes of `trials.jsonl`.
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        for row in &self.0.rows {
            serde_json::to_writer(&mut bytes, row).map_err(errors::other)?;
            bytes.push(b'\n');
        }
        Ok(PyBytes::new(py, &bytes))
    }

    fn trials<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns::trials(py, &self.0)
    }

    fn touches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns::touches(py, &self.0)
    }

    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns::summary(py, &self.0)
    }

    fn belief(&self, trial: u32, planner: &str, touch: u32) -> PyResult<Belief> {
        let row = self.row(trial, planner)?;
        let experiment = &self.0.experiment;
        let known = if experiment.scene.whole_object.is_some() {
            let touches = row.touches.get(..touch as usize).unwrap_or_default();
            whole_object::belief(experiment, touches).map_err(errors::other)?.map(Known::from)
        } else {
            let replay = BeliefReplay::of(experiment, row, touch).map_err(errors::other)?;
            replay.map(|replay| Known::HeightField(replay.belief))
        };
        let none = || {
            let (made, first) = (row.touches.len(), experiment.initial_touches);
            errors::other(format!(
                "no belief after touch {touch} of trial {trial} of {planner}: allowed are {first} to {made}"
            ))
        };
        known.map(Belief).ok_or_else(none)
    }

    fn __str__(&self) -> PyResult<String> {
        fork::install(|| tables::summary::text(&self.0))
    }
}
