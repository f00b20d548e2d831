//! Robot arm behind ROS 2 topics, a simulated robot, and recordings of touches.
//!
//! | module | content |
//! |---|---|
//! | [`arm`] | the arm: a [`Backend`](palpate_explore::backend::Backend) over topics |
//! | [`driver`] | the drivers of arms, and where they differ |
//! | [`topics`], [`service`], [`message`] | the topics and services of an arm, and their messages |
//! | [`camera`] | one view of a depth camera |
//! | [`view`] | messages that RViz, Foxglove and other viewers draw |
//! | [`transport`] | sends and receives packets; [`connect`] creates one from settings |
//! | [`server`] | a simulated robot behind the same topics, in real time |
//! | [`recording`] | every tick of a trial as an MCAP file, and a backend that replays it |
//!
//! Joints are matched by name, so that a driver's messages may have them in any order:
//!
//! ```
//! use palpate_ros::joints::JointNames;
//!
//! let arm = JointNames::new(vec!["shoulder".into(), "elbow".into()]);
//! let state = JointNames::new(vec!["elbow".into(), "hand".into(), "shoulder".into()]);
//! let message = state.state(0.0, &[0.2, 0.9, 0.1], &[0.0; 3]);
//! let (mut q, mut qdot) = (Vec::new(), Vec::new());
//! arm.read(&message, &mut q, &mut qdot)?;
//! assert_eq!(q, [0.1, 0.2]);
//! # Ok::<(), palpate_input::error::InputError>(())
//! ```

pub mod arm;
mod backend;
pub mod camera;
mod connector;
pub mod control_message;
pub mod controllers;
pub mod definition;
pub mod driver;
mod engage;
pub mod frames;
pub mod franka_message;
pub mod joints;
pub mod link;
pub mod listen;
pub mod message;
pub mod net_ft;
pub mod network;
pub mod planning_scene;
pub mod receiver;
pub mod recording;
#[cfg(feature = "ros2")]
mod ros2;
pub mod server;
pub mod service;
pub mod settings;
pub mod status;
pub mod tactile;
pub mod topics;
pub mod trajectory_stream;
pub mod transport;
pub mod view;

#[cfg(not(feature = "ros2"))]
use camera::CameraMessage;
use camera::{CameraTopics, Cloud, FirstMessages};
use palpate_input::error::InputError;
use service::Service;
use settings::RosSettings;
use topics::Endpoint;
use transport::Connect;

/// Returns a function that opens the transport of `settings`, to be called in the thread that will
/// own it.
///
/// # Errors
/// If this build lacks the transport.
#[cfg(feature = "ros2")]
pub fn connect(
    settings: &RosSettings,
    side: Endpoint,
    services: Vec<Service>,
) -> Result<Connect, InputError> {
    let owned = settings.clone();
    Ok(Box::new(move || {
        Ok(Box::new(ros2::Ros2::open(&owned, side, services)?) as Box<dyn transport::Transport>)
    }))
}

/// Returns a function that opens the transport of `settings`.
///
/// # Errors
/// Always: this build lacks the transport.
#[cfg(not(feature = "ros2"))]
pub fn connect(_: &RosSettings, _: Endpoint, _: Vec<Service>) -> Result<Connect, InputError> {
    Err(no_transport())
}

/// Receives one view of a depth camera.
///
/// # Errors
/// If none arrives within the time, its message is invalid, or this build lacks the transport.
pub fn look(settings: &RosSettings, topics: &CameraTopics) -> Result<Cloud, InputError> {
    let mut first = FirstMessages::default();
    let mut take = |message| first.take(message);
    #[cfg(feature = "ros2")]
    let listened = ros2::camera::listen(settings, topics, &mut take);
    #[cfg(not(feature = "ros2"))]
    let listened = {
        // Without a transport nothing else names its type.
        let _: (&RosSettings, &mut dyn FnMut(CameraMessage) -> bool) = (settings, &mut take);
        Err(no_transport())
    };
    let published: Vec<String> = listened?;
    let note = network::discovery_note(|name| std::env::var(name).ok());
    first.cloud(topics, &published, note)
}

/// Returns the error of a build that lacks the transport.
#[cfg(not(feature = "ros2"))]
fn no_transport() -> InputError {
    InputError::new(
        "[backend.ros2] needs a build with the feature `ros2`: \
         cargo build --release --features ros2",
    )
}
