//! Questions asked of many touches.
//!
//! * [`accuracy`]: what does accuracy cost? Variants of a scene, coarser, finer, or with an effect
//!   switched, against a reference: error, time, and the cheapest scene within a tolerance.
//! * [`check`]: are planners what they were? The same trials again, held against a committed file.
//! * [`compare`](mod@compare): planners over several runs.
//! * [`bench`](mod@bench): how long does each piece take, and how far is it from what the machine
//!   can do?
//! * [`stress`]: where does it break, and does it say so? Hard cases at rising severity, each with
//!   the law it must keep.

pub mod accuracy;
pub mod bench;
pub mod check;
pub mod compare;
pub mod stress;
pub mod suite;
