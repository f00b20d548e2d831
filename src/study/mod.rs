//! Questions asked of many touches.
//!
//! * [`accuracy`]: what does accuracy cost? Variants of a scene, coarser, finer, or with an effect
//!   switched, against a reference: error, time, and the cheapest scene within a tolerance.
//! * [`check`]: are planners what they were? The same trials again, held against a committed file.
//! * [`compare`](mod@compare): planners over several runs.

pub mod accuracy;
pub mod check;
pub mod compare;
