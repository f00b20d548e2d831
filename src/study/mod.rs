//! Studies over many touches.
//!
//! * [`accuracy`]: accuracy against cost. Compares coarser, finer or switched variants of a scene
//!   with a reference: error, time, and the cheapest scene within a tolerance.
//! * [`band`]: learning of the 95 % band from objects, with its coverage.
//! * [`benchmark`]: fixed protocol of objects, planners and touches, with its results.
//! * [`check`]: regression test of planners against a stored baseline.
//! * [`compare`](mod@compare): comparison of planners over several runs.
//! * [`sensors`]: the same experiment with every kind of fingertip.

pub mod accuracy;
pub mod band;
pub mod benchmark;
pub mod check;
pub mod compare;
pub mod sensors;
