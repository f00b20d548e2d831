//! The finger: its rigid hull, its soft skin, and the tactile frame that a sensor in it sends.
//!
//! `profile`, `samples` and `table` say where skin, fluid and electrodes of a BioTac are. `column`
//! is the law of one column of skin over fluid over core, `cavity` couples columns by the fluid's
//! pressure, `skin` presses them against a mesh. `flex` and `lattice` are the skin as a shell
//! instead. `electrodes`, `fluid`, `thermal`, `friction` and `timing` are the effects; `tip` puts
//! together those a scene names. `contact_point` reads a frame back; `wrench` is the force/torque
//! sensor behind the finger, `registration` what is not where it is believed to be. `plate` presses
//! the finger on a flat plate, `calibration` fits the constants to recordings of it, `stiffness` asks
//! it how stiff the skin is.

pub mod calibration;
mod cavity;
pub mod column;
pub mod contact_point;
mod converter;
pub mod effects;
pub mod electrodes;
pub mod flex;
pub mod fluid;
pub mod frame;
pub mod friction;
pub mod hull;
pub mod lattice;
pub mod load;
mod noise;
pub mod plate;
pub mod profile;
pub mod registration;
pub mod samples;
pub mod skin;
pub mod stiffness;
pub mod table;
pub mod thermal;
pub mod timing;
pub mod tip;
pub mod wrench;

pub use contact_point::{Detection, Detector, PointOfContact, Tare};
pub use effects::Effects;
pub use frame::Frame;
pub use hull::Finger;
pub use load::Load;
pub use tip::{Feel, FeelError, Fingertip, Motion};
