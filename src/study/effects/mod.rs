//! What does each effect change, and what does it cost? One is switched at a time, the rest of the
//! scene stays as it is.
//!
//! `switches` lists what can be switched, `change` measures what one of them does to contacts,
//! forces, time and the planners' verdict, `need` which of them a scene calls for by a `yardstick`:
//! within a tolerance of its touches (`difference`) or of that verdict (`verdict`). `overhead`
//! measures what all that is switched off still costs.

pub mod change;
pub mod difference;
pub mod need;
pub mod overhead;
pub mod share;
pub mod switches;
pub mod verdict;
pub mod yardstick;

pub use change::{Baseline, Budget, Change};
pub use switches::{full, switched, switches};
