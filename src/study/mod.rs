//! Questions asked of many touches.
//!
//! * [`fidelity`]: what does accuracy cost? The same touches over a ladder of scenes, from a rigid
//!   hull that is swept to a fine skin at a fine time step.
//! * [`effects`]: what does each piece of physics change, and what does it cost? One is switched,
//!   the rest of the scene stays.
//! * [`check`]: are planners what they were? The same trials again, held against a committed file.
//! * [`compare`](mod@compare): planners over several runs.
//! * [`bench`](mod@bench): how long does each piece take, and how far is it from what the machine
//!   can do?
//! * [`stress`]: where does it break, and does it say so? Hard cases at rising severity, each with
//!   the law it must keep.

pub mod bench;
pub mod check;
pub mod compare;
pub mod effects;
pub mod fidelity;
pub mod stress;
