//! What does each effect change, and what does it cost? One is switched at a time, the rest of the
//! scene stays as it is.
//!
//! `switches` lists what can be switched, `change` measures what one of them does to contacts,
//! forces, time and the planners' verdict, `need` which of them a scene calls for within a
//! tolerance, `overhead` what all that is switched off still costs.

pub mod change;
pub mod difference;
pub mod need;
pub mod overhead;
pub mod share;
pub mod switches;

pub use change::{Baseline, Budget, Change};
pub use switches::{full, switched, switches};
