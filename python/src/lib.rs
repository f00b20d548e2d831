//! Palpate as a Python extension, the core of the package `palpate`.
//!
//! It returns arrays and plain values. Data frames, progress, and the conventions of scikit-learn
//! and Gymnasium are in the package's Python files.

mod action_space;
mod ball;
mod belief;
mod columns;
mod contacts;
mod desk;
mod envs;
mod episode_scene;
mod errors;
mod executor;
mod experiment;
mod exploration;
mod explorer;
mod fork;
mod gaussian_process;
mod known;
mod mesh;
mod pickle;
mod picture;
mod places;
mod planner;
mod program;
mod recognition;
mod run;
mod scene;
mod studies;
mod target;
mod zone;

use pyo3::prelude::*;

#[pymodule]
fn _palpate(module: &Bound<'_, PyModule>) -> PyResult<()> {
    fork::remember_process();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("COMMIT", program::COMMIT)?;
    module.add("PROTOCOL", palpate::study::benchmark::PROTOCOL)?;
    module.add_class::<ball::Ball>()?;
    module.add_class::<belief::Belief>()?;
    module.add_class::<desk::PlannerChannel>()?;
    module.add_class::<envs::ParallelExplorations>()?;
    module.add_class::<experiment::Experiment>()?;
    module.add_class::<executor::JobRunner>()?;
    module.add_class::<executor::RowCollector>()?;
    module.add_class::<explorer::Exploration>()?;
    module.add_class::<gaussian_process::Fitted>()?;
    module.add_class::<recognition::RecognitionEpisode>()?;
    module.add_class::<run::Run>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<scene::Touch>()?;
    module.add_class::<zone::Zone>()?;
    module.add_function(wrap_pyfunction!(contacts::fit, module)?)?;
    module.add_function(wrap_pyfunction!(contacts::identify_contacts, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::read_mesh, module)?)?;
    module.add_function(wrap_pyfunction!(program::main, module)?)?;
    module.add_function(wrap_pyfunction!(program::planners, module)?)?;
    module.add_function(wrap_pyfunction!(studies::accuracy, module)?)?;
    module.add_function(wrap_pyfunction!(studies::benchmark, module)?)?;
    module.add_function(wrap_pyfunction!(studies::benchmark_experiments, module)?)?;
    module.add_function(wrap_pyfunction!(studies::calibrate_band, module)?)?;
    module.add_function(wrap_pyfunction!(studies::compare, module)?)?;
    module.add_function(wrap_pyfunction!(studies::identify, module)?)?;
    Ok(())
}
