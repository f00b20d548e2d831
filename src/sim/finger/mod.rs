//! The physics of the fingertip: its soft skin, and the effects a scene names.
//!
//! `effects` has the table of them and each in a file of its own, the skin first. `profile` and
//! `samples` say where skin and fluid of a BioTac are, `patches` which of them may meet an object.
//! `foundation` is a skin of columns that the fluid's pressure couples; `shell` carries load to its
//! neighbours instead, over triangles between samples. `fingertip` puts together the effects that a
//! scene names and makes tactile frames of what they sense. `plate` presses the finger on a flat
//! plate and says how stiff the skin is, `calibration` fits the constants to a recording of it.

pub mod calibration;
pub mod effects;
pub mod fingertip;
pub mod foundation;
pub mod load;
pub(crate) mod noise;
mod patches;
pub mod plate;
pub mod recording;
pub mod samples;
pub mod shell;

pub use effects::Effects;
pub use fingertip::{Fingertip, FingertipState};
pub use load::Load;
