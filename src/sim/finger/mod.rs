//! The physics of the fingertip: its soft skin, and the effects a scene names.
//!
//! `effects` has the table of them and each in a file of its own, the skin first. `profile` and
//! `samples` say where skin and fluid of a BioTac are, `patches` which of them may meet an object.
//! `column` is the law of one column of skin over fluid over core, `foundation` a skin of them that
//! the fluid's pressure couples; `shell` carries load to its neighbours instead, over the triangles
//! of `lattice`. `fingertip` puts together the effects that a scene names, `shear` says what the
//! electrodes feel of friction, `converter` makes tactile frames of what they sense, `counter`
//! counts how often each did its work. `plate` presses the finger on a flat plate and says how
//! stiff the skin is, `calibration` fits the constants to a `recording` of it.

pub mod calibration;
pub mod column;
mod converter;
pub mod counter;
pub mod effects;
pub mod fingertip;
mod foundation;
pub mod lattice;
pub mod load;
pub(crate) mod noise;
mod patches;
pub mod plate;
pub mod recording;
pub mod samples;
pub mod shear;
pub mod shell;

pub use effects::Effects;
pub use fingertip::{Fingertip, FingertipState};
pub use load::Load;
