//! A run, in memory or read from a folder.

use crate::ball::Ball;
use crate::belief::Belief;
use crate::columns;
use crate::errors;
use crate::experiment::parsed;
use crate::fork;
use crate::pickle::{self, Reduced, Version};
use crate::places::rows;
use crate::zone::Zone;
use numpy::{PyArray1, PyArrayDyn};
use palpate::experiment::analysis::Analysis;
use palpate::experiment::metrics::truth::Truth;
use palpate::experiment::row::TrialRow;
use palpate::experiment::store::{self, resolved};
use palpate::geometry::mesh::Mesh;
use palpate::report::{figures, findings, tables};
use palpate::task;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::Arc;

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

    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns::points(py, &self.0)
    }

    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns::summary(py, &self.0)
    }

    fn belief(&self, trial: u32, planner: &str, touch: u32) -> PyResult<Belief> {
        let row = self.row(trial, planner)?;
        let experiment = &self.0.experiment;
        let known = row.belief(experiment, touch).map_err(errors::other)?;
        let none = || {
            let (made, first) = (row.touches.len(), experiment.initial_touches);
            errors::other(format!(
                "no belief after touch {touch} of trial {trial} of {planner}: allowed are {first} to {made}"
            ))
        };
        known.map(Belief).ok_or_else(none)
    }

    /// Comparison of the planners with the baselines: sentences, the better planner, the measure
    /// that decides, the columns of two tables, and one table and the error's curves to show.
    fn compare<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let run = &self.0;
        let analysis = py.detach(|| Analysis::new(run));
        let found = PyDict::new(py);
        found.set_item("conclusion", findings::conclusion(run, &analysis))?;
        found.set_item("verdicts", findings::verdicts(run, &analysis))?;
        found.set_item("best", findings::best(run, &analysis))?;
        found.set_item("measure", run.error_measure().id)?;
        found.set_item("table", columns::comparisons(py, &analysis.comparisons)?)?;
        found.set_item("equal_error", columns::equal_errors(py, &analysis.equal_errors)?)?;
        let tables = tables::comparison::comparisons(run, &analysis.comparisons);
        let tables: String = tables.iter().map(|table| table.html("palpate")).collect();
        found.set_item("html", tables)?;
        found.set_item("svg", fork::detach(py, || figures::draw_error(run))?)?;
        Ok(found)
    }

    /// Curves of a measure over touches: its title, unit and scale, and for each planner touches,
    /// values and both ends of the bands.
    #[pyo3(signature = (measure = None))]
    fn curves<'py>(&self, py: Python<'py>, measure: Option<&str>) -> PyResult<Bound<'py, PyDict>> {
        columns::curves(py, &self.0, measure)
    }

    /// Summary after the last touch as a table in HTML.
    fn html(&self) -> String {
        tables::summary::table_after(&self.0, &[self.0.experiment.touches]).html("palpate")
    }

    #[staticmethod]
    fn _restore(
        version: Version,
        toml: String,
        truth: &str,
        rows: &[u8],
        unlisted: usize,
    ) -> PyResult<Self> {
        pickle::check(&version, "Run")?;
        let experiment = parsed(toml, &[])?;
        let truth: TruthState = serde_json::from_str(truth).map_err(errors::other)?;
        let (places, heights_m, is_edge, is_reachable, is_complete, mesh) = truth;
        let mesh = mesh.map(|(vertices, triangles)| {
            let vertices: Vec<_> = vertices.into_iter().map(Into::into).collect();
            Mesh::new(&vertices, &triangles).map(|(mesh, _)| Arc::new(mesh))
        });
        let mesh = mesh.transpose().map_err(errors::scene)?;
        let truth = Truth { places, heights_m, is_edge, is_reachable, is_complete, mesh };
        let rows = serde_json::Deserializer::from_slice(rows)
            .into_iter::<TrialRow>()
            .collect::<Result<_, _>>();
        Ok(Self(store::Run { experiment, truth, rows: rows.map_err(errors::other)?, unlisted }))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, RunState<'py>>> {
        let store::Run { experiment, truth, unlisted, .. } = &slf.get().0;
        let mesh = truth.mesh.as_ref().map(|mesh| {
            let vertices = mesh.vertices().iter().map(|p_w| <[f64; 3]>::from(*p_w));
            (vertices.collect::<Vec<_>>(), mesh.triangles())
        });
        let Truth { places, heights_m, is_edge, is_reachable, is_complete, .. } = truth;
        let truth = (places, heights_m, is_edge, is_reachable, is_complete, mesh);
        let truth = serde_json::to_string(&truth).map_err(errors::other)?;
        let rows = slf.get().rows(slf.py())?;
        let state = (pickle::version(), resolved(experiment), truth, rows, *unlisted);
        pickle::reduced(slf, state)
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __str__(&self) -> PyResult<String> {
        fork::install(|| tables::summary::text(&self.0, false))
    }
}

/// Vertices and triangles.
type Triangles = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Places, heights, flags and mesh of a ground truth.
type TruthState = (Vec<Vec<f64>>, Vec<Option<f64>>, Vec<bool>, Vec<bool>, bool, Option<Triangles>);

/// Settings as TOML, ground truth as JSON, rows as bytes, and the number of rows that are not
/// listed.
type RunState<'py> = (Version, String, String, Bound<'py, PyBytes>, usize);
