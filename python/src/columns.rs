//! Rows and curves as columns of data frames.

use crate::fork;
use numpy::PyArray1;
use palpate::experiment::measure::{Measure, PanelAxis, measures_with_columns};
use palpate::experiment::row::{TouchRow, TrialRow};
use palpate::experiment::statistics::comparison::PairedComparison;
use palpate::experiment::statistics::curve_table::{columns, curve_table, uncertainty};
use palpate::experiment::statistics::equal_error::{EqualError, IntervalEstimate};
use palpate::experiment::statistics::summary::{self, CurvePoint};
use palpate::experiment::store::Run;
use palpate::explore::evidence::Contact;
use palpate::explore::planner::Fallback;
use palpate::report::findings;
use palpate::task::Target;
use pyo3::exceptions::PyValueError;
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

/// Adds a column unless no row has a value.
fn some_numbers(
    table: &Bound<'_, PyDict>,
    name: &str,
    mut values: impl Iterator<Item = Option<f64>> + Clone,
) -> PyResult<()> {
    match values.clone().any(|value| value.is_some()) {
        true => numbers(table, name, values.by_ref()),
        false => Ok(()),
    }
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
    words(&table, "outcome", touches().map(|touch| Some(touch.outcome.end.name())))?;
    let scene = &run.experiment.scene;
    let coordinates = scene.zone.as_ref().map_or(&AIM[..], |zone| &PLACE[..zone.dimension()]);
    for (axis, name) in coordinates.iter().enumerate() {
        numbers(&table, name, touches().map(|touch| touch.target.numbers().get(axis).copied()))?;
    }
    for (axis, name) in ["contact_x_m", "contact_y_m", "contact_z_m"].iter().enumerate() {
        numbers(&table, name, touches().map(|touch| Some(touch.contact()?[axis])))?;
    }
    for (axis, name) in ["normal_x", "normal_y", "normal_z"].iter().enumerate() {
        let measured = |touch: &TouchRow| {
            let contact = touch.outcome.contact().filter(|contact| contact.has_normal)?;
            Some(contact.normal_w[axis])
        };
        some_numbers(&table, name, touches().map(measured))?;
    }
    let contact_sd_m = |touch: &TouchRow| sd_m(touch.outcome.contact()?);
    some_numbers(&table, "contact_sd_m", touches().map(contact_sd_m))?;
    for (axis, name) in ["tip_x_m", "tip_y_m", "tip_z_m"].iter().enumerate() {
        let tip_m = |touch: &TouchRow| Some(touch.outcome.free()?.p_wt[axis]);
        some_numbers(&table, name, touches().map(tip_m))?;
    }
    for (axis, name) in ["tip_qx", "tip_qy", "tip_qz", "tip_qw"].iter().enumerate() {
        let part = |touch: &TouchRow| Some(touch.outcome.free()?.r_wt.coords[axis]);
        some_numbers(&table, name, touches().map(part))?;
    }
    for (axis, name) in ["end_x_m", "end_z_m"].iter().enumerate() {
        let end = |touch: &TouchRow| {
            let target = Some(&touch.target).filter(|target| target.slide_m() > 0.0)?;
            target.end()?.get(axis).copied()
        };
        some_numbers(&table, name, touches().map(end))?;
    }
    for (axis, name) in ["way_x_m", "way_y_m", "way_z_m"].iter().enumerate() {
        let way_m = |touch: &TouchRow| match &touch.target {
            Target::StrokeAround { way_w, .. } => Some(way_w[axis]),
            _ => None,
        };
        some_numbers(&table, name, touches().map(way_m))?;
    }
    some_numbers(&table, "pitch_deg", touches().map(|touch| touch.target.pitch_deg()))?;
    counts(&table, "points", touches().map(|touch| touch.outcome.points().len()))?;
    some_numbers(&table, "planned_sd_m", touches().map(|touch| touch.planned_sd_m))?;
    words(&table, "fallback", touches().map(|touch| touch.fallback.map(fallback)))?;
    let fit = |of: fn(&palpate::gp::Hyperparameters) -> f64| {
        touches().map(move |touch| Some(of(&touch.fit.as_ref()?.hyperparameters)))
    };
    numbers(&table, "signal_sd_m", fit(|found| found.signal_sd))?;
    numbers(&table, "noise_sd_m", fit(|found| found.noise_sd))?;
    for measure in measures_with_columns(&run.rows) {
        let values = all.iter().map(|(row, count, _)| measure.value(row, *count as u32));
        some_numbers(&table, measure.id, values)?;
    }
    Ok(table)
}

/// Returns the columns of a table with a row per point of the surface that a touch showed: the
/// contact, then the points of a pad's patch or along a stroke.
pub(crate) fn points<'py>(py: Python<'py>, run: &Run) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let mut all: Vec<(&TrialRow, usize, usize, &Contact)> = Vec::new();
    for row in &run.rows {
        for (touch, count) in row.touches.iter().zip(1..) {
            let points = touch.outcome.points().iter().enumerate();
            all.extend(points.map(|(number, point)| (row, count, number, point)));
        }
    }
    let points = || all.iter().map(|(.., point)| *point);
    counts(&table, "trial", all.iter().map(|(row, ..)| row.trial as usize))?;
    words(&table, "planner", all.iter().map(|(row, ..)| Some(row.planner.as_str())))?;
    counts(&table, "touch", all.iter().map(|(_, count, ..)| *count))?;
    counts(&table, "point", all.iter().map(|(_, _, number, _)| *number))?;
    for (axis, name) in ["x_m", "y_m", "z_m"].iter().enumerate() {
        numbers(&table, name, points().map(|point| Some(point.p_wc[axis])))?;
    }
    for (axis, name) in ["normal_x", "normal_y", "normal_z"].iter().enumerate() {
        let normal = |point: &Contact| point.has_normal.then(|| point.normal_w[axis]);
        some_numbers(&table, name, points().map(normal))?;
    }
    some_numbers(&table, "sd_m", points().map(sd_m))?;
    Ok(table)
}

/// Returns the standard deviation of a contact along its normal, m.
fn sd_m(contact: &Contact) -> Option<f64> {
    let variance = contact.normal_w.dot(&(contact.covariance_w? * contact.normal_w));
    Some(variance.max(0.0).sqrt())
}

/// Returns a record per planner and number of touches, with the table of `summary.csv`.
pub(crate) fn summary<'py>(py: Python<'py>, run: &Run) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let records = fork::detach(py, || curve_table(&run.experiment, &run.rows, |_| true))?;
    words(&table, "planner", records.iter().map(|(point, _)| Some(point.planner.as_str())))?;
    counts(&table, "touches", records.iter().map(|(point, _)| point.touches as usize))?;
    counts(&table, "trials", records.iter().map(|(point, _)| point.trials))?;
    for (i, column) in columns(&run.experiment, &run.rows).iter().enumerate() {
        some_numbers(&table, column, records.iter().map(|(_, values)| values[i]))?;
    }
    Ok(table)
}

/// Returns the columns of a table with a row per planner, baseline and measure, as in
/// `comparison.csv`, with the verdict.
pub(crate) fn comparisons<'py>(
    py: Python<'py>,
    found: &[PairedComparison],
) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let paired = || found.iter().map(|it| &it.paired);
    let end = |i: usize| paired().map(move |it| Some(it.interval?[i]));
    words(&table, "planner", found.iter().map(|it| Some(it.planner)))?;
    words(&table, "baseline", found.iter().map(|it| Some(it.baseline)))?;
    words(&table, "measure", found.iter().map(|it| Some(it.measure.id)))?;
    counts(&table, "trials", paired().map(|it| it.trials))?;
    numbers(&table, "difference", paired().map(|it| Some(it.mean)))?;
    numbers(&table, "difference_low", end(0))?;
    numbers(&table, "difference_high", end(1))?;
    numbers(&table, "won", paired().map(|it| Some(it.won)))?;
    words(&table, "verdict", found.iter().map(findings::established))?;
    Ok(table)
}

/// Returns the columns of a table with a row per planner, baseline and error, as in
/// `equal_error.csv`; infinity if the error is not reached.
pub(crate) fn equal_errors<'py>(
    py: Python<'py>,
    found: &[EqualError],
) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    words(&table, "planner", found.iter().map(|it| Some(it.planner)))?;
    words(&table, "baseline", found.iter().map(|it| Some(it.baseline)))?;
    words(&table, "measure", found.iter().map(|it| Some(it.measure.id)))?;
    counts(&table, "trials", found.iter().map(|it| it.trials))?;
    numbers(&table, "goal", found.iter().map(|it| Some(it.goal)))?;
    numbers(&table, "baseline_touches", found.iter().map(|it| Some(it.baseline_touches)))?;
    let estimates = |name: &str, of: fn(&EqualError) -> IntervalEstimate| -> PyResult<()> {
        let end = |i: usize| found.iter().map(move |it| Some(of(it).interval?[i]));
        numbers(&table, name, found.iter().map(|it| Some(of(it).value)))?;
        numbers(&table, &format!("{name}_low"), end(0))?;
        numbers(&table, &format!("{name}_high"), end(1))
    };
    estimates("touches", |it| it.touches)?;
    estimates("ratio", |it| it.ratio)?;
    estimates("path_ratio", |it| it.path_ratio)?;
    estimates("time_ratio", |it| it.time_ratio)?;
    Ok(table)
}

/// Returns the curves of a measure, by default of the error, as in the report's figure: its title,
/// display unit, scale and statistic; and for each planner touches, values and both ends of bands.
pub(crate) fn curves<'py>(
    py: Python<'py>,
    run: &Run,
    id: Option<&str>,
) -> PyResult<Bound<'py, PyDict>> {
    let id = id.unwrap_or(run.error_measure().id);
    let mut measures = measures_with_columns(&run.rows);
    let Some(measure) = measures.find(|measure| measure.id == id) else {
        let names = measures_with_columns(&run.rows).map(|measure| measure.id);
        let names = names.collect::<Vec<_>>().join(", ");
        return Err(PyValueError::new_err(format!("measure = {id:?}: allowed are {names}")));
    };
    let has_median = measure.aggregate.has_median();
    let found = PyDict::new(py);
    found.set_item("title", measure.title)?;
    found.set_item("unit", measure.unit.symbol)?;
    found.set_item("per_si", measure.unit.per_si)?;
    let is_log = matches!(measure.scale, PanelAxis::Log | PanelAxis::LogBeside(_));
    found.set_item("is_log", is_log)?;
    found.set_item("statistic", if has_median { "median" } else { "mean" })?;
    let planners = PyDict::new(py);
    for planner in &run.experiment.planners {
        let points = py.detach(|| curve(run, planner, measure));
        let column = |i: usize| PyArray1::from_iter(py, points.iter().map(move |point| point[i]));
        planners.set_item(planner, [0, 1, 2, 3].map(column))?;
    }
    found.set_item("planners", planners)?;
    Ok(found)
}

/// Returns touches, value and both ends of the band at each point of a planner's curve.
fn curve(run: &Run, planner: &str, measure: &Measure) -> Vec<[f64; 4]> {
    let reading = |point: &CurvePoint| {
        let summary = point.of(measure)?;
        let has_median = measure.aggregate.has_median();
        let value = if has_median { summary.median } else { summary.mean };
        let band = uncertainty(&run.experiment, &run.rows, point, measure);
        let [low, high] = band.unwrap_or([f64::NAN; 2]);
        Some([point.touches.into(), value, low, high])
    };
    let points = summary::curve(&run.experiment, &run.rows, planner);
    points.iter().filter_map(reading).collect()
}

fn fallback(reason: Fallback) -> &'static str {
    match reason {
        Fallback::NoVariance => "no_variance",
        Fallback::DuplicateTarget => "duplicate_target",
        Fallback::Unreachable => "unreachable",
        Fallback::Operator => "operator",
    }
}
