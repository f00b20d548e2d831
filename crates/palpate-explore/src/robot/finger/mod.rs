//! The finger as a lab knows it: its shape, where its electrodes are, what it sends, and what a
//! frame says of a contact.

pub mod contact_point;
pub mod detection;
pub mod electrode_table;
pub mod frame;
pub mod plane_fit;
pub mod profile;
pub mod shape;

pub use contact_point::PointOfContact;
pub use detection::{Detection, Detector, Rest};
pub use frame::Frame;
pub use shape::{Finger, TipMotion};
