//! Recordings of bodies: everything that was commanded and read, in a file that others open too.
//!
//! A [`Recording`] is an MCAP file with ROS 2 messages (schemas `ros2msg`, encoding `cdr`, profile
//! `ros2`), so that Foxglove, Rerun and Python read it. A [`Recorder`] is a body around a body that
//! writes every tick; who runs the trial adds its touches to the same recording and ends it.
//! [`Recorded`] is such a file read back, also one that was cut short, and a [`Player`] is a body
//! that plays it.
//!
//! The messages of the lab's kind hold what they can; `palpate_msgs/msg/Tick` holds every number of
//! a tick to the bit, and is all that a player needs.

mod about;
mod cdr;
mod entries;
mod error;
mod marker;
mod player;
mod recorded;
mod recorder;
#[allow(clippy::module_inception)]
mod recording;
mod tick;
mod topic;
mod touch;

pub use about::{About, Ending};
pub use cdr::decoded;
pub use error::RecordingError;
pub use marker::{ColorRgba, Marker, Point, Shape};
pub use player::Player;
pub use recorded::{Recorded, Ticks};
pub use recorder::Recorder;
pub use recording::{Clock, Recording, wall_clock};
pub use tick::Tick;
pub use topic::TOPICS;
pub use touch::Touch;
