//! Thin-shell model of the skin over the fluid: it carries load to its neighbours.
//!
//! `sheet` models the silicone, and `softness` its compliance at rest. `membrane` has its energy
//! with fluid, core and object, under the rays by which the skin meets an object. `settle`
//! minimises that energy, with `springs` for the places that may touch.

mod compliance;
pub mod elastic_sheet;
mod equilibrium;
pub mod membrane;
pub mod springs;
