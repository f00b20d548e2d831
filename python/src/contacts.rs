//! Contacts of a file or of arrays: a belief fitted to them, and the objects of a library.

use crate::belief::Belief;
use crate::errors;
use crate::experiment::RunCallbacks;
use crate::fork;
use nalgebra::{Point3, Vector3};
use palpate::experiment::contact_log::{ContactLog, LoggedTouch, REACH_M};
use palpate::explore::evidence::Contact;
use palpate::report::{fit as fit_text, identify as identify_text};
use palpate::sim::scene::Unit;
use palpate::study::fit::{FitSpec, HeightAxis, run as run_fit};
use palpate::study::identify::{RecordedSpec, recorded};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::json;
use std::path::PathBuf;

/// Contacts: a file, or points with what is known of each.
#[derive(FromPyObject)]
pub(crate) enum Contacts {
    /// File (.csv, .parquet).
    File(PathBuf),
    /// Points, then normals, standard deviations and groups, where given.
    Arrays(Arrays),
}

/// Points with their normals, standard deviations and groups.
type Arrays = (Vec<[f64; 3]>, Option<Vec<[f64; 3]>>, Option<Vec<f64>>, Option<Vec<String>>);

/// Reads contacts.
pub(crate) fn log(contacts: Contacts) -> PyResult<ContactLog> {
    match contacts {
        Contacts::File(path) => ContactLog::read(&path).map_err(errors::other),
        Contacts::Arrays(arrays) => of_arrays(arrays),
    }
}

fn of_arrays((points, normals, sds, groups): Arrays) -> PyResult<ContactLog> {
    let count = points.len();
    let lengths = [
        ("normals", normals.as_ref().map(Vec::len)),
        ("sd_m", sds.as_ref().map(Vec::len)),
        ("groups", groups.as_ref().map(Vec::len)),
    ];
    if let Some((name, Some(found))) =
        lengths.iter().find(|(_, length)| length.is_some_and(|length| length != count))
    {
        return Err(PyValueError::new_err(format!("{name} has {found} rows; allowed are {count}")));
    }
    let touch = |i: usize| -> PyResult<LoggedTouch> {
        let normal = normals.as_ref().map(|normals| Vector3::from(normals[i]));
        let unit = normal.map(|normal| normal.try_normalize(1e-9));
        let sd_m = sds.as_ref().map(|sds| sds[i]);
        if points[i].iter().any(|x| x.abs() > REACH_M) {
            let words = format!(
                "contact {i}: allowed is up to {REACH_M} m from the origin; points are in metres"
            );
            return Err(PyValueError::new_err(words));
        }
        let is_finite = points[i].iter().all(|x| x.is_finite());
        if !is_finite || unit == Some(None) || sd_m.is_some_and(|sd_m| !(0.0..=1.0).contains(&sd_m))
        {
            return Err(PyValueError::new_err(format!(
                "contact {i}: allowed are finite points, normals with a length, sd_m from 0 to 1"
            )));
        }
        let normal_w = unit.flatten();
        let contact = Contact {
            has_normal: normal_w.is_some(),
            ..Contact::new(Point3::from(points[i]), normal_w.unwrap_or_else(Vector3::z))
        };
        let covariance_w = sd_m.map(|sd_m| nalgebra::Matrix3::identity() * (sd_m * sd_m));
        let group = groups.as_ref().map_or_else(|| (i + 1).to_string(), |groups| groups[i].clone());
        Ok(LoggedTouch { group, contact: Some(Contact { covariance_w, ..contact }), free: None })
    };
    if count == 0 {
        return Err(PyValueError::new_err("contacts has 0 rows; allowed are 1 or more"));
    }
    let touches = (0..count).map(touch).collect::<PyResult<_>>()?;
    Ok(ContactLog { touches, has_groups: groups.is_some(), unread: Vec::new() })
}

/// Fits a surface to contacts, as the command `palpate fit` does; returns the belief and the rest
/// as JSON. `look` and `stop` are those of `Experiment.run`.
#[pyfunction]
#[pyo3(signature = (contacts, *, heights, look, stop))]
pub(crate) fn fit(
    py: Python<'_>,
    contacts: Contacts,
    heights: Option<&str>,
    look: Py<PyAny>,
    stop: Py<PyAny>,
) -> PyResult<(Belief, String)> {
    let log = log(contacts)?;
    let axis = |text: &str| {
        text.parse::<HeightAxis>()
            .map_err(|allowed| PyValueError::new_err(format!("heights = {text:?}: {allowed}")))
    };
    let spec = FitSpec { log: &log, heights: heights.map(axis).transpose()? };
    let callbacks = RunCallbacks::new(look, stop, false);
    let run = || run_fit(&spec, &callbacks.is_stopped, &|_, _| callbacks.step());
    let found = callbacks.watched(py, 0, run)?.map_err(errors::study)?;
    let found = found.ok_or_else(|| errors::other("stopped"))?;
    let values = json!({
        "rms_m": found.rms_m(),
        "coverage": found.coverage(),
        "sd_factor": found.sd_factor,
        "common_m": found.common_m(),
        "unread": log.unread,
        "held_out": fit_text::held_out(&found).json(),
        "text": fit_text::sentences(&found, "contacts").join("\n"),
    });
    Ok((Belief(found.belief), values.to_string()))
}

/// Identifies an object of a library by contacts, as `palpate identify --contacts` does.
#[pyfunction]
#[pyo3(signature = (library, contacts, *, unit, offset_max_m, sure))]
pub(crate) fn identify_contacts(
    py: Python<'_>,
    library: PathBuf,
    contacts: Contacts,
    unit: &str,
    offset_max_m: f64,
    sure: f64,
) -> PyResult<String> {
    let log = log(contacts)?;
    let unit: Unit = serde_json::from_value(json!(unit)).map_err(|_| {
        PyValueError::new_err(format!("unit = {unit:?}: allowed are m, cm, mm, um, in"))
    })?;
    let spec = RecordedSpec { library: &library, unit, log: &log, offset_max_m, seed: 0 };
    let found = fork::detach(py, || recorded(&spec))?.map_err(errors::study)?;
    let count = log.contacts().len();
    let Some((name, best)) = found.first() else { return Err(errors::other("no contact")) };
    let (position_m, rotation_deg) = palpate::gp::math::pose::parts(&best.x_wo);
    let probabilities: serde_json::Map<String, serde_json::Value> =
        found.iter().map(|(name, it)| (name.clone(), it.probability.into())).collect();
    let values = json!({
        "object": name,
        "confidence": best.probability,
        "is_sure": best.is_identified(sure),
        "touches": count,
        "probabilities": probabilities,
        "pose": {
            "position_m": position_m,
            "rotation_deg": rotation_deg,
            "distance_95_m": best.distance_95_m,
        },
        "error": null,
        "history": [],
        "text": identify_text::recorded(&found, count),
    });
    Ok(values.to_string())
}
