//! What accuracy costs: the same touches over a ladder of scenes, from a cast to a fine skin
//! at a fine time step.
//!
//! `ladder` names the scenes, `measure` touches with one of them, `trace` and `felt` say how the
//! finger was loaded when it was read, `order` and `press` how fast the error falls with the
//! resolution, `effects` what each piece of physics changes and costs, `off` what it costs where it
//! is off.

pub mod comparison;
pub mod ladder;
pub mod order;
pub mod press;
pub mod reference_load;
pub mod row;
pub mod rung;
pub mod tolerance;
pub mod touches;
