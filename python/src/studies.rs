//! Studies: accuracy, the calibration of the band, identification, the comparison of runs, and the
//! benchmark, as JSON with the text and the figure of the commands.

use crate::errors;
use crate::experiment::{Experiment, RunCallbacks};
use crate::fork;
use crate::program::COMMIT;
use crate::run::Run;
use palpate::error::InputError;
use palpate::experiment::store;
use palpate::report::tables::accuracy::{effects, levels};
use palpate::report::{
    accuracy as accuracy_figure, benchmark as benchmark_table, compare as suite,
    identify as identified, reliability,
};
use palpate::sim::Scene;
use palpate::study::accuracy::tolerance::{Criterion, Origin};
use palpate::study::accuracy::{
    AccuracyProgress, AccuracyResult, AccuracySpec, run as run_accuracy,
};
use palpate::study::band::{self, BandProgress, BandSpec, LEVELS};
use palpate::study::benchmark::BenchmarkSpec;
use palpate::study::compare::{
    Entrant, SuiteComparison, compare as compare_runs, gap_closed, geometric_mean,
};
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
    let AccuracyResult { levels: of_levels, orders, effects: of_effects, .. } = &found;
    let texts = [of_levels.as_ref().map(|it| levels(it, orders)), of_effects.as_ref().map(effects)];
    values["text"] = texts.into_iter().flatten().collect::<Vec<_>>().join("\n\n").into();
    values["svg"] = accuracy_figure::draw(of_levels.as_ref(), orders, of_effects.as_ref()).into();
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
    let shares = found.reliability.iter().flat_map(|(touches, shares)| {
        let row = |(p, share)| json!({"touches": touches, "probability": p, "share": share});
        LEVELS.into_iter().zip(*shares).map(row).collect::<Vec<_>>()
    });
    let values = json!({
        "band": found.band,
        "coverage": found.coverage,
        "reliability": shares.collect::<Vec<_>>(),
        "text": reliability::table(&found.coverage),
        "svg": reliability::draw(&found.reliability),
    });
    Ok(values.to_string())
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
    values["text"] = identified::conclusion(&found).into();
    Ok(values.to_string())
}

/// Loads the experiments of the benchmark's protocol at `path`, one per object; `objects` is the
/// folder of the meshes that it lists.
#[pyfunction]
pub(crate) fn benchmark_experiments(
    path: PathBuf,
    objects: Option<PathBuf>,
    is_quick: bool,
) -> PyResult<Vec<Experiment>> {
    let spec = BenchmarkSpec { path: &path, objects: objects.as_deref(), is_quick, commit: COMMIT };
    let experiments = spec.experiments(&[]).map_err(errors::study)?;
    Ok(experiments.into_iter().map(Experiment).collect())
}

/// Results of the finished runs of all experiments of the benchmark's protocol at `path`.
#[pyfunction]
pub(crate) fn benchmark(
    py: Python<'_>,
    path: PathBuf,
    is_quick: bool,
    runs: Vec<Py<Run>>,
) -> PyResult<String> {
    let runs: Vec<(String, &store::Run)> =
        runs.iter().map(|run| (run.get().0.experiment.name.clone(), &run.get().0)).collect();
    let spec = BenchmarkSpec { path: &path, objects: None, is_quick, commit: COMMIT };
    let result = fork::detach(py, || spec.result(&runs))?.map_err(errors::study)?;
    let tables = benchmark_table::tables(&result);
    let document = serde_json::to_string_pretty(&result).map_err(errors::other)? + "\n";
    let mut values = json!(result);
    let text: Vec<String> = tables.iter().map(|(_, table)| table.text()).collect();
    let html: Vec<String> = tables.iter().map(|(_, table)| table.html("palpate")).collect();
    values["text"] = text.join("\n").into();
    values["html"] = html.concat().into();
    values["document"] = document.into();
    Ok(values.to_string())
}

/// Compares runs, each with its name, relative to the planner `against`, as the command
/// `palpate compare` does.
#[pyfunction]
pub(crate) fn compare(
    py: Python<'_>,
    runs: Vec<(String, Py<Run>)>,
    against: String,
) -> PyResult<String> {
    let runs: Vec<(String, &store::Run)> =
        runs.iter().map(|(name, run)| (name.clone(), &run.get().0)).collect();
    let found = fork::detach(py, || -> Result<Value, _> {
        let compared = compare_runs(&runs, &against)?;
        Ok(json!({
            "reference": compared.reference,
            "objects": compared.objects,
            "planners": compared.contenders.iter().map(|it| &it.name).collect::<Vec<_>>(),
            "conclusion": suite::conclusion(&compared),
            "table": suite::file(&compared).json(),
            "overall": over_all_objects(&compared),
            "text": suite::text(&compared).trim_end(),
            "html": suite::overall(&compared).html("palpate"),
            "svg": suite::profiles(&compared),
        }))
    })?;
    found.map(|found| found.to_string()).map_err(|error: InputError| errors::other(error))
}

/// Returns the error of each planner over all objects, relative to the reference, with its
/// interval, and the share of the gap from random to the oracle that it closes.
fn over_all_objects(compared: &SuiteComparison) -> Vec<Value> {
    let objects: Vec<usize> = (0..compared.objects.len()).collect();
    let row = |it: &Entrant| {
        let error = geometric_mean(&it.scores(), suite::SEED);
        let ends = error.and_then(|error| error.interval);
        json!({
            "planner": it.name,
            "error": error.map(|error| error.value),
            "error_low": ends.map(|[low, _]| low),
            "error_high": ends.map(|[_, high]| high),
            "gap_closed": gap_closed(compared, it, &objects, suite::SEED).map(|gap| gap.value),
        })
    };
    compared.contenders.iter().map(row).collect()
}
