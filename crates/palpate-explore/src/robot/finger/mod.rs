//! Finger: its shape, electrodes, data frames, contact detection and contact location.

pub mod contact_point;
pub mod detection;
pub mod electrode_table;
pub mod frame;
pub mod plane_fit;
pub mod profile;
pub mod shape;

pub use contact_point::PointOfContact;
pub use detection::{Detection, Detector, RestState};
pub use frame::Frame;
pub use shape::{Finger, TipMotion};
