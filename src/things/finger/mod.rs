//! The finger: its rigid hull, and the tactile frame that a sensor in it sends.

pub mod calibration;
mod cavity;
pub mod column;
pub mod electrodes;
pub mod frame;
pub mod hull;
pub mod load;
mod noise;
pub mod profile;
pub mod samples;
pub mod skin;
pub mod table;

pub use frame::Frame;
pub use hull::Finger;
