//! Command `palpate` of the Python package, with Python planners.

use crate::fork;
use crate::planner::PythonFactory;
use palpate::cli::Host;
use palpate::experiment::planner_names;
use palpate::explore::planner::PlannerFactory;
use pyo3::prelude::*;

/// Commit of the build.
pub(crate) const COMMIT: &str = match option_env!("PALPATE_COMMIT") {
    Some(commit) => commit,
    None => "unknown",
};

/// Runs the program on `arguments`, the first of which is its name; returns its exit code.
/// `load_planner` returns the factory of a planner named `MODULE:CLASS`.
#[pyfunction]
pub(crate) fn main(
    py: Python<'_>,
    arguments: Vec<String>,
    load_planner: Py<PyAny>,
) -> PyResult<u8> {
    let loaded = |name: &str| {
        let start = Python::attach(|py| {
            let start = load_planner.call1(py, (name,));
            let made = start.and_then(|start| PythonFactory::new(py, name.into(), start));
            made.map_err(|error| anyhow::anyhow!("{}", error.value(py)))
        });
        Some(start.map(|made| -> Box<dyn PlannerFactory> { Box::new(made) }))
    };
    fork::detach(py, || {
        let host = Host { commit: COMMIT, load_planner: &loaded };
        palpate::cli::main_with(arguments.into_iter().map(Into::into), &host)
    })
}

/// Names of the built-in planners.
#[pyfunction]
pub(crate) fn planners() -> Vec<&'static str> {
    planner_names::known_planners().map(|(name, _)| name).collect()
}
