//! The physics of the fingertip: its soft skin, and the effects a scene names.
//!
//! `profile` and `samples` say where skin and fluid of a BioTac are. `column` is the law of one
//! column of skin over fluid over core, `cavity` couples columns by the fluid's pressure, `skin`
//! presses them against a mesh. `flex` and `lattice` are the skin as a shell instead.
//! `electrodes`, `fluid`, `thermal`, `friction` and `timing` are the effects; `fingertip` puts
//! together those a scene names. `wrench` is the force/torque sensor behind the finger,
//! `registration` what is not where it is believed to be. `plate` presses the finger on a flat
//! plate, `calibration` fits the constants to recordings of it, `stiffness` asks it how stiff the
//! skin is.

pub mod calibration;
mod cavity;
pub mod column;
mod converter;
pub mod counter;
pub mod effects;
pub mod electrodes;
pub mod fingertip;
pub mod flex;
pub mod fluid;
pub mod friction;
pub mod lattice;
pub mod load;
mod noise;
pub mod plate;
pub mod profile;
pub mod registration;
pub mod samples;
pub mod skin;
pub mod stiffness;
pub mod thermal;
pub mod timing;
pub mod wrench;

pub use effects::Effects;
pub use fingertip::{Fingertip, FingertipError, FingertipState};
pub use load::Load;
