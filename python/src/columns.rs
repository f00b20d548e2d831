//! Rows and curves as columns of data frames.

use crate::fork;
use numpy::PyArray1;
use palpate::experiment::measure::measures_with_columns;
use palpate::experiment::statistics::curve_table::{columns, curve_table};
use palpate::experiment::store::Run;
use palpate::experiment::trial::row::{TouchRow, TrialRow};
use palpate::explore::planner::Fallback;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Column names of a target's numbers, for a zone and for a whole object.
const PLACE: [&str; 2] = ["target_x_m", "target_z_m"];
const AIM: [&str; 6] = ["target_x_m", "target_y_m", "target_z_m", "ahead_x", "ahead_y", "ahead_z"];

fn numbers(
    table: &Bound<'_, PyDict>,
    name: &str,
    values: impl Iterator<Item = Option<f64>>,
) -> PyResult<()> {
    let values = values.map(|value| value.unwrap_or(f64::NAN)).collect();
    table.set_item(name, PyArray1::from_vec(table.py(), values))
}

fn counts(
    table: &Bound<'_, PyDict>,
    name: &str,
    values: impl Iterator<Item = usize>,
) -> PyResult<()> {
    let values = values.map(|value| value as i64).collect();
    table.set_item(name, PyArray1::from_vec(table.py(), values))
}

fn words<'a>(
    table: &Bound<'_, PyDict>,
    name: &str,
    values: impl Iterator<Item = Option<&'a str>>,
) -> PyResult<()> {
    table.set_item(name, values.collect::<Vec<_>>())
}

/// Returns the columns of a table with a row per trial.
pub(crate) fn trials<'py>(py: Python<'py>, run: &Run) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let rows = || run.rows.iter();
    counts(&table, "trial", rows().map(|row| row.trial as usize))?;
    words(&table, "planner", rows().map(|row| Some(row.planner.as_str())))?;
    counts(&table, "touches", rows().map(|row| row.touches.len()))?;
    words(&table, "failure", rows().map(|row| row.failure.as_deref()))?;
    Ok(table)
}

/// Returns the columns of a table with a row per touch: its part of the trial's row, and every
/// measure after it.
pub(crate) fn touches<'py>(py: Python<'py>, run: &Run) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let all: Vec<(&TrialRow, usize, &TouchRow)> = (run.rows.iter())
        .flat_map(|row| row.touches.iter().zip(1..).map(move |(touch, count)| (row, count, touch)))
        .collect();
    let touches = || all.iter().map(|(_, _, touch)| *touch);
    counts(&table, "trial", all.iter().map(|(row, ..)| row.trial as usize))?;
    words(&table, "planner", all.iter().map(|(row, ..)| Some(row.planner.as_str())))?;
    counts(&table, "touch", all.iter().map(|(_, count, _)| *count))?;
    words(&table, "outcome", touches().map(|touch| Some(outcome(touch))))?;
    let scene = &run.experiment.scene;
    let coordinates = scene.zone.as_ref().map_or(&AIM[..], |zone| &PLACE[..zone.dimension()]);
    for (axis, name) in coordinates.iter().enumerate() {
        numbers(&table, name, touches().map(|touch| touch.target.numbers().get(axis).copied()))?;
    }
    for (axis, name) in ["contact_x_m", "contact_y_m", "contact_z_m"].iter().enumerate() {
        numbers(&table, name, touches().map(|touch| Some(touch.contact?[axis])))?;
    }
    numbers(&table, "planned_sd_m", touches().map(|touch| touch.planned_sd_m))?;
    words(&table, "fallback", touches().map(|touch| touch.fallback.map(fallback)))?;
    let fit = |of: fn(&palpate::gp::Hyperparameters) -> f64| {
        touches().map(move |touch| Some(of(&touch.fit.as_ref()?.hyperparameters)))
    };
    numbers(&table, "signal_sd_m", fit(|found| found.signal_sd))?;
    numbers(&table, "noise_sd_m", fit(|found| found.noise_sd))?;
    for measure in measures_with_columns(&run.rows) {
        let values = all.iter().map(|(row, count, _)| measure.value(row, *count as u32));
        numbers(&table, measure.id, values)?;
    }
    Ok(table)
}

/// Returns a record per planner and number of touches, with the table of `summary.csv`.
pub(crate) fn summary<'py>(py: Python<'py>, run: &Run) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let records = fork::detach(py, || curve_table(&run.experiment, &run.rows, |_| true))?;
    words(&table, "planner", records.iter().map(|(point, _)| Some(point.planner.as_str())))?;
    counts(&table, "touches", records.iter().map(|(point, _)| point.touches as usize))?;
    counts(&table, "trials", records.iter().map(|(point, _)| point.trials))?;
    for (i, column) in columns(&run.experiment, &run.rows).iter().enumerate() {
        numbers(&table, column, records.iter().map(|(_, values)| values[i]))?;
    }
    Ok(table)
}

fn outcome(touch: &TouchRow) -> &'static str {
    match (touch.contact.is_some(), touch.overload) {
        (true, _) => "contact",
        (false, true) => "overload",
        (false, false) => "miss",
    }
}

fn fallback(reason: Fallback) -> &'static str {
    match reason {
        Fallback::NoVariance => "no_variance",
        Fallback::DuplicateTarget => "duplicate_target",
        Fallback::Unreachable => "unreachable",
    }
}
