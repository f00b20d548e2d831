//! The finger as a lab knows it: its shape, where its electrodes are, what it sends, and what a
//! frame says of a contact.

pub mod contact_point;
pub mod detection;
pub mod electrode_table;
pub mod frame;
pub mod motion;
pub mod plane_fit;
pub mod profile;
pub mod rest;
pub mod shape;

pub use contact_point::{PointOfContact, Tare};
pub use detection::{Detection, Detector};
pub use frame::Frame;
pub use motion::TipMotion;
pub use shape::Finger;
