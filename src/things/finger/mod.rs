//! The finger: its rigid hull, and the tactile frame that a sensor in it sends.

pub mod frame;
pub mod hull;

pub use frame::Frame;
pub use hull::Finger;
