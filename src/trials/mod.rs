//! Floor 5: experiments, their trials, and the folder their results lie in.

pub mod comparison;
pub mod equal_error;
pub mod experiment;
pub mod fidelity;
pub mod measure;
pub mod metrics;
pub mod row;
pub mod runner;
pub mod scan;
pub mod statistics;
pub mod store;
pub mod stress;
pub mod summary;
pub mod trial;
pub mod truth;
