//! What does accuracy cost? The same touches over a ladder of scenes, from a cast to a fine skin at
//! a fine time step.
//!
//! `rung` is a named change to a scene, `ladder` lists the rungs. `touches` touches with one of
//! them, `reference_load` says how the finger was loaded when it was read, `rung_result` is what
//! came of it and `spread` how its errors are spread; `comparison` goes through the ladder,
//! `tolerance` picks from it. `order` and `step_in_contact` measure how fast the error falls with
//! the resolution.

pub mod comparison;
pub mod ladder;
pub mod order;
pub mod reference_load;
pub mod rung;
pub mod rung_result;
pub mod spread;
pub mod step_in_contact;
pub mod tolerance;
pub mod touches;
