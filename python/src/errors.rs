//! Palpate's errors as exceptions of `palpate.errors`, with what they carry as attributes.

use palpate::config::{ConfigError, Origin};
use palpate::experiment::store::RunError;
use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::Path;

/// An exception of `palpate.errors` with attributes; those that are none stay `None`.
fn exception(class: &str, message: &str, fields: &[(&str, Option<String>)]) -> PyErr {
    Python::attach(|py| {
        let made = || -> PyResult<PyErr> {
            let named = PyDict::new(py);
            for (name, value) in fields {
                named.set_item(name, value)?;
            }
            let class = py.import("palpate.errors")?.getattr(class)?;
            Ok(PyErr::from_value(class.call((message,), Some(&named))?))
        };
        made().unwrap_or_else(|error| error)
    })
}

fn shown(path: &Path) -> Option<String> {
    Some(path.display().to_string())
}

/// Of settings: file, line, key, value, and what is allowed.
pub(crate) fn config(error: ConfigError) -> PyErr {
    let message = error.to_string();
    let (file, line) = match error.origin.as_deref() {
        Some(Origin::File { path, line }) => (shown(path), line.map(|line| line.to_string())),
        _ => (None, None),
    };
    let ConfigError { key, value, allowed, .. } = error;
    let fields =
        [("file", file), ("line", line), ("key", key), ("value", value), ("allowed", allowed)];
    exception("ConfigError", &message, &fields)
}

/// Of a scene that cannot be built or simulated.
pub(crate) fn scene(error: impl std::fmt::Display) -> PyErr {
    exception("SimulationError", &error.to_string(), &[])
}

/// Of a run: of its settings, of its folder, or of anything else.
pub(crate) fn run(error: RunError) -> PyErr {
    let message = error.to_string();
    match error {
        RunError::Config(error) => config(error),
        RunError::Folder { path, .. } => {
            exception("RunFolderError", &message, &[("path", shown(&path))])
        }
        RunError::Invalid(error) => other(error),
    }
}

/// Anything else that was asked for and is not there.
pub(crate) fn other(error: impl std::fmt::Display) -> PyErr {
    exception("PalpateError", &error.to_string(), &[])
}

/// Of what is asked around an object and is of zones only; `there` is what there is.
pub(crate) fn not_around(name: &str, there: &str) -> PyErr {
    PyAttributeError::new_err(format!(
        "`{name}` is of the exploration of a zone, and this is around an object: there is {there}"
    ))
}

/// The other way round.
pub(crate) fn not_over_zone(name: &str, there: &str) -> PyErr {
    PyAttributeError::new_err(format!(
        "`{name}` is of the exploration around an object, and this is over a zone: there is {there}"
    ))
}

/// A number must be in its range.
///
/// # Errors
/// `ValueError`.
pub(crate) fn within(name: &str, value: u32, [least, most]: [u32; 2]) -> PyResult<()> {
    match (least..=most).contains(&value) {
        true => Ok(()),
        false => {
            Err(PyValueError::new_err(format!("{name} = {value}: allowed are {least} to {most}")))
        }
    }
}
