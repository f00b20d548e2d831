//! Conversion of Palpate's errors to exceptions of `palpate.errors` with attributes.

use palpate::config::{ConfigError, Origin};
use palpate::experiment::store::RunError;
use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::Path;

/// Creates an exception of `palpate.errors`; missing attributes are `None`.
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

/// Stands for the file of settings that are not from a file.
pub(crate) const SETTINGS: &str = "settings";

fn shown(path: &Path) -> Option<String> {
    Some(path.display().to_string())
}

/// Converts a settings error; attributes are file, line, key, value and the allowed values.
pub(crate) fn config(error: ConfigError) -> PyErr {
    let message = error.to_string();
    // Python has keyword arguments in place of `--set`.
    let message = message.strip_prefix("--set ").unwrap_or(&message);
    let (file, line) = match error.origin.as_deref() {
        Some(Origin::File { path, .. }) if *path == Path::new(SETTINGS) => (None, None),
        Some(Origin::File { path, line }) => (shown(path), line.map(|line| line.to_string())),
        _ => (None, None),
    };
    let ConfigError { key, value, allowed, .. } = error;
    let fields =
        [("file", file), ("line", line), ("key", key), ("value", value), ("allowed", allowed)];
    exception("ConfigError", message, &fields)
}

/// Converts an error of a scene that cannot be built or simulated.
pub(crate) fn scene(error: impl std::fmt::Display) -> PyErr {
    exception("SimulationError", &error.to_string(), &[])
}

/// Converts an error of a run: of its settings, its folder, or its other inputs.
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

/// Converts an error of a study: of its settings, or another.
pub(crate) fn study(error: anyhow::Error) -> PyErr {
    match error.downcast::<ConfigError>() {
        Ok(error) => config(error),
        Err(error) => other(format!("{error:#}")),
    }
}

/// Converts any other error.
pub(crate) fn other(error: impl std::fmt::Display) -> PyErr {
    exception("PalpateError", &error.to_string(), &[])
}

/// Error of an attribute for zones that is used around an object; `there` lists the alternatives.
pub(crate) fn not_around(name: &str, there: &str) -> PyErr {
    PyAttributeError::new_err(format!(
        "`{name}` exists only for a zone; this explores a whole object: use {there}"
    ))
}

/// Error of an attribute for objects that is used over a zone; `there` lists the alternatives.
pub(crate) fn not_over_zone(name: &str, there: &str) -> PyErr {
    PyAttributeError::new_err(format!(
        "`{name}` exists only for a whole object; this explores a zone: use {there}"
    ))
}

/// Checks that a number is in its range.
///
/// # Errors
/// `ValueError` if it is not.
pub(crate) fn within(name: &str, value: u32, [least, most]: [u32; 2]) -> PyResult<()> {
    match (least..=most).contains(&value) {
        true => Ok(()),
        false => {
            Err(PyValueError::new_err(format!("{name} = {value}: allowed are {least} to {most}")))
        }
    }
}

/// Creates the error of a Python planner.
pub(crate) fn planner(error: impl std::fmt::Display) -> PyErr {
    exception("PlannerError", &error.to_string(), &[])
}
