//! Recordings of a robot: all commands and readings, in a standard file format.
//!
//! A [`Recording`] is an MCAP file with ROS 2 messages (schemas `ros2msg`, encoding `cdr`, profile
//! `ros2`), so that Foxglove, Rerun and Python can read it. A [`RecordingBackend`] is a backend
//! that wraps another and writes every tick; the program that runs the trial adds its touches to
//! the same recording and ends it. [`RecordedTrial`] is such a file after reading, even if it was
//! truncated, and a [`ReplayBackend`] is a backend that replays it.
//!
//! The standard messages contain what they can represent; `palpate_msgs/msg/Tick` contains every
//! number of a tick to the bit, and suffices for replay.

mod format;
mod reader;
mod writer;

pub use crate::message::{ColorRGBA, Marker, Point, Shape};
pub use format::{RecordingMetadata, TOPICS, TickMessage, TouchMessage, TrialEnd, decoded};
pub use reader::{RecordedTrial, ReplayBackend};
pub use writer::{Clock, Recording, RecordingBackend, wall_clock};
