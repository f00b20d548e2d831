//! Studies: accuracy, the calibration of the band, and identification, as JSON.

use crate::errors;
use crate::experiment::{Experiment, RunCallbacks};
use palpate::sim::Scene;
use palpate::study::accuracy::tolerance::{Criterion, Origin};
use palpate::study::accuracy::{AccuracyProgress, AccuracySpec, run as run_accuracy};
use palpate::study::band::{self, BandProgress, BandSpec};
use palpate::study::identify::{IdentifySpec, run as run_identify};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Measures the levels and effects of the scene at `path`, as the command `palpate accuracy` does.
/// `counts` are the touches, trials and held-out targets or trials, where given, then the pairs,
/// the touches per trial and the seed. `look` and `stop` are those of `Experiment.run`.
#[pyfunction]
#[pyo3(signature = (path, sets, *, against, tolerance, counts, is_full, look, stop))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn accuracy(
    py: Python<'_>,
    path: PathBuf,
    sets: Vec<String>,
    against: Option<&str>,
    tolerance: Option<&str>,
    counts: (Option<u16>, Option<u16>, Option<u16>, u16, u16, u16),
    is_full: bool,
    look: Py<PyAny>,
    stop: Py<PyAny>,
) -> PyResult<String> {
    let tolerance = tolerance.map(|text| text.parse::<Criterion>().map_err(|e| (text, e)));
    let refused = |(text, allowed)| {
        PyValueError::new_err(format!("tolerance = {text:?}: allowed is {allowed}"))
    };
    let (touches, trials, held_out, pairs, trial_touches, seed) = counts;
    let spec = AccuracySpec {
        scene: Scene::load(&path, &sets).map_err(errors::config)?,
        path,
        against: against.map(origin).transpose()?,
        tolerance: tolerance.transpose().map_err(refused)?,
        touches,
        pairs,
        trials,
        trial_touches,
        held_out,
        seed,
        is_full,
    };
    let total = spec.variants().map_err(errors::study)?;
    let callbacks = RunCallbacks::new(look, stop, false);
    let mut progress = |progress: AccuracyProgress| {
        if matches!(progress, AccuracyProgress::Variant) {
            callbacks.step();
        }
        Ok(())
    };
    let run = || run_accuracy(&spec, &callbacks.is_stopped, &mut progress);
    let found = callbacks.watched(py, total, run)?.map_err(errors::study)?;
    let name = spec.path.file_stem().unwrap_or_default().to_string_lossy();
    let mut values = found.json(&name);
    if let Some(cheapest) = &found.cheapest {
        values["cheapest"]["scene"] = cheapest.toml().map_err(errors::study)?.into();
    }
    Ok(values.to_string())
}

/// Returns the reference of errors by its name.
fn origin(name: &str) -> PyResult<Origin> {
    match name {
        "scene" => Ok(Origin::Scene),
        "reference" => Ok(Origin::Reference),
        "truth" => Ok(Origin::Truth),
        _ => Err(PyValueError::new_err(format!(
            "against = {name:?}: allowed are \"scene\", \"reference\", \"truth\""
        ))),
    }
}

/// Learns the 95 % band from the experiment at `path`, or tests its own, as the command
/// `palpate calibrate --band` does. `look` and `stop` are those of `Experiment.run`.
#[pyfunction]
#[pyo3(signature = (path, sets, *, trials, is_test, look, stop))]
pub(crate) fn calibrate_band(
    py: Python<'_>,
    path: PathBuf,
    sets: Vec<String>,
    trials: u32,
    is_test: bool,
    look: Py<PyAny>,
    stop: Py<PyAny>,
) -> PyResult<String> {
    let spec = BandSpec::load(&path, &sets, trials, is_test).map_err(errors::study)?;
    let total = usize::try_from(spec.touches()).unwrap_or(usize::MAX);
    let callbacks = RunCallbacks::new(look, stop, false);
    let progress = |progress: BandProgress| {
        if matches!(progress, BandProgress::Touch) {
            callbacks.step();
        }
    };
    let run = || band::run(spec, &callbacks.is_stopped, &progress);
    let found = callbacks.watched(py, total, run)?.map_err(errors::study)?;
    let found = found.ok_or_else(|| errors::other("stopped"))?;
    Ok(json!({"band": found.band, "coverage": found.coverage}).to_string())
}

/// Identifies an object of a library in the scene or experiment at `path`, as the command
/// `palpate identify` does. `look` and `stop` are those of `Experiment.run`.
#[pyfunction]
#[pyo3(signature = (library, path, sets, *, planner, sure, touches, trial, look, stop))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn identify(
    py: Python<'_>,
    library: PathBuf,
    path: PathBuf,
    sets: Vec<String>,
    planner: String,
    sure: f64,
    touches: u32,
    trial: u32,
    look: Py<PyAny>,
    stop: Py<PyAny>,
) -> PyResult<String> {
    let spec = IdentifySpec { library, planner, sure, touches, trial };
    let experiment = Experiment(spec.experiment(&path, &sets).map_err(errors::study)?);
    let simulation = experiment.simulation(py, Vec::new())?;
    let callbacks = RunCallbacks::new(look, stop, false);
    let mut history = Vec::new();
    let run = || {
        run_identify(&simulation, &spec, &callbacks.is_stopped, &mut |touches, found| {
            callbacks.step();
            let mut row = json!(found.probabilities);
            row["touches"] = touches.into();
            history.push(row);
        })
    };
    let found = callbacks.watched(py, touches as usize, run)?.map_err(errors::study)?;
    let found = found.ok_or_else(|| errors::other("stopped"))?;
    let mut values = json!(found.found);
    values["confidence"] = found.found.confidence().into();
    values["is_sure"] = found.is_sure.into();
    values["touches"] = found.touches.into();
    values["history"] = Value::Array(history);
    Ok(values.to_string())
}
