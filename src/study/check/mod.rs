//! Are planners what they were? The same trials again, held against a committed file.
//!
//! First the rows themselves are compared; where they are the same bytes, nothing has changed.
//! Otherwise new and old are paired by trial, which share seeds, and trials are added in batches
//! until an interval that holds at any time ([`sequence`]) tells. [`judged`] lists by what.

pub mod baseline;
pub mod held;
pub mod judged;
pub mod sequence;

pub use baseline::Baseline;
pub use held::{Held, Judgement, Planner, Rules, differs, hold};
pub use judged::Verdict;
