//! Regression test of planners: repeats the trials of a stored baseline and compares the results.
//!
//! Rows are compared first; identical bytes mean no change. Otherwise new and old trials with the
//! same seeds are paired, and trials are added in batches until an anytime-valid interval
//! ([`sequence`]) decides. [`measures`] lists the measures.

pub mod baseline;
pub mod measures;
pub mod regression;
pub mod sequence;

pub use baseline::StoredBaseline;
pub use measures::Verdict;
pub use regression::{
    CheckOptions, CheckResult, MeasureResult, PlannerResult, accepted, baseline_rows, failures,
    run_check,
};
