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

mod format;
mod reader;
mod writer;

pub use crate::message::{ColorRGBA, Marker, Point, Shape};
pub use format::{About, Ending, TOPICS, Tick, Touch, decoded};
pub use reader::{Player, Recorded};
pub use writer::{Clock, Recorder, Recording, wall_clock};
