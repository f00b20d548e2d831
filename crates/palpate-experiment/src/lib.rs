//! Experiments, their trials, and the folder of their results.
//!
//! An [`Experiment`] is a set of settings, read from a file or built in code. A [`Simulation`] runs
//! its trials. Each trial is a row, and all results are computed from the rows.
//!
//! ```
//! use palpate_experiment::{Experiment, Simulation, measure};
//! use palpate_explore::planner;
//!
//! # let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
//! # std::env::set_current_dir(folder)?;
//! let sets = ["touches=8".into()];
//! let experiment = Experiment::load("experiments/toy.toml".as_ref(), &sets)?;
//! let simulation = Simulation::new(experiment)?;
//! let active = planner::by_name("active").expect("it is there");
//! let row = simulation.trial(active, 0);
//! assert_eq!((row.touches.len(), row.failure.clone()), (8, None));
//! let rmse = measure::RMSE.value(&row, 8).expect("it was measured");
//! assert!(rmse > 0.0 && rmse < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod analysis;
pub mod backend_settings;
pub mod contact_log;
#[allow(clippy::module_inception)]
pub mod experiment;
pub mod log_table;
pub mod measure;
pub mod metrics;
pub mod notice;
pub mod planner_names;
pub mod real_robot;
pub mod recording;
pub mod report_settings;
pub mod row;
pub mod runner;
pub mod scan;
pub mod simulation;
pub mod statistics;
pub mod stop;
pub mod store;
pub mod sweep;
pub mod trial;
pub mod wrench_log;

pub use experiment::Experiment;
pub use simulation::Simulation;
