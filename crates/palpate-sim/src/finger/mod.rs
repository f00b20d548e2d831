//! Physics of the fingertip: its soft skin, and the effects that a scene names.
//!
//! `effects` has their table, and a file for each of them, the skin first. `profile` and `samples`
//! define the geometry of skin and fluid of a BioTac; `patches` selects the parts of it that may
//! touch an object. `foundation` models the skin as columns coupled by the fluid's pressure;
//! `shell` models it as triangles between samples, which carry load to their neighbours.
//! `fingertip` combines the effects of a scene and makes tactile frames of their signals. `plate`
//! presses the finger on a flat plate and measures the skin's stiffness; `calibration` fits the
//! constants to a recording.

pub mod calibration;
pub mod effects;
pub mod fingertip;
pub mod foundation;
pub mod gel;
pub mod load;
pub(crate) mod noise;
mod patches;
pub mod plate;
pub mod recording;
pub mod samples;
pub mod shell;

pub use effects::Effects;
pub use fingertip::{Fingertip, FingertipState};
pub use load::ContactLoad;
