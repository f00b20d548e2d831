//! The skin as a thin shell over the fluid: it carries load to its neighbours.
//!
//! `sheet` is the silicone, `springs` the contact problem of the places that may touch, `membrane`
//! puts them together with fluid and core and finds where they are in balance, `touching` is that
//! under the rays by which the skin meets an object.

pub mod membrane;
pub mod sheet;
mod softness;
pub mod springs;
mod touching;

pub use touching::{Shell, ShellState};
