//! The skin as a thin shell over the fluid: it carries load to its neighbours.
//!
//! `sheet` is the silicone and `softness` how it gives way at rest, `membrane` is its energy with
//! fluid, core and object, under the rays by which the skin meets an object; `settle` finds the
//! least of it, with `springs` for the places that may touch.

pub mod membrane;
mod settle;
pub mod sheet;
mod softness;
pub mod springs;
