//! Experiments, their trials, and the folder their results lie in.

pub mod analysis;
pub mod comparison;
pub mod curve_table;
pub mod equal_error;
#[allow(clippy::module_inception)]
pub mod experiment;
pub mod measure;
pub mod metrics;
pub mod report_settings;
pub mod row;
pub mod runner;
pub mod scan;
pub mod simulation;
pub mod statistics;
pub mod store;
pub mod summary;
pub mod trial;
pub mod truth;

pub use experiment::Experiment;
pub use simulation::Simulation;
