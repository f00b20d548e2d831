//! Thin-shell model of the skin over the fluid: it carries load to its neighbours.
//!
//! `elastic_sheet` models the silicone, `compliance` its response. `membrane` has its energy
//! with fluid, core and object, under the rays by which the skin meets an object. `equilibrium`
//! minimises that energy, with `springs` for the points that may touch.

mod compliance;
pub mod elastic_sheet;
mod equilibrium;
pub mod membrane;
pub mod springs;
