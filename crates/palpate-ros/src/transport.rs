//! Packets, and the transports that carry them: ROS 2, or a channel for tests.

use super::control_message::{Clock, GoalStatusArray, RobotDescription};
use super::franka_message::FrankaRobotState;
use super::message::{
    BioTacHand, BiotacAll, Bool, DiagnosticArray, Float64, Float64MultiArray, Image, JointState,
    JointTrajectory, RobotMode, SafetyMode, Time, Touching, WrenchStamped,
};
use super::planning_scene::CollisionObject;
use super::service::{Answer, Service};
use super::topics::Topic;
use super::view::{MarkerArray, PointCloud2, TFMessage};
use palpate_input::error::InputError;
use std::time::{Duration, Instant};

/// A message type of a [`Packet`].
pub trait PacketMessage: Into<Packet> {
    /// Returns the message in `packet`, if it is of this type.
    fn in_packet(packet: &Packet) -> Option<&Self>;
}

macro_rules! packets {
    ($($(#[$doc:meta])* $kind:ident($held:ty): $message:ident on $topic:ident,)*) => {
        /// A message of any [`Topic`], in the layout of ROS 2.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Packet {
            $($(#[$doc])* $kind($held),)*
        }

        impl Packet {
            /// Returns the packet's topic.
            pub fn topic(&self) -> Topic {
                match self {
                    $(Self::$kind(_) => Topic::$topic,)*
                }
            }
        }

        $(
            impl From<$message> for Packet {
                fn from(message: $message) -> Self {
                    Self::$kind(message.into())
                }
            }

            impl PacketMessage for $message {
                fn in_packet(packet: &Packet) -> Option<&Self> {
                    let Packet::$kind(message) = packet else { return None };
                    Some(message)
                }
            }
        )*
    };
}

packets! {
    /// Joint states of the arm.
    Joints(JointState): JointState on Joints,
    /// Force and torque.
    Wrench(WrenchStamped): WrenchStamped on Wrench,
    /// A tactile frame of the BioTac's own driver.
    Hand(Box<BioTacHand>): BioTacHand on Tactile,
    /// Tactile frame of a Shadow hand.
    Fingers(Box<BiotacAll>): BiotacAll on Tactile,
    /// Whether a switch at the tip is closed.
    Touching(Touching): Touching on Tactile,
    /// Depths of a pad.
    Depth(Box<Image>): Image on Tactile,
    /// State of the arm.
    Status(DiagnosticArray): DiagnosticArray on Status,
    /// Mode of a Universal Robots arm.
    RobotMode(RobotMode): RobotMode on RobotMode,
    /// Its safety mode.
    SafetyMode(SafetyMode): SafetyMode on SafetyMode,
    /// Whether it runs the driver's program.
    ProgramRunning(Bool): Bool on ProgramRunning,
    /// Its speed, in percent of the commanded one.
    SpeedScaling(Float64): Float64 on SpeedScaling,
    /// State of a Franka arm.
    FrankaState(Box<FrankaRobotState>): FrankaRobotState on FrankaState,
    /// Joint velocities with names and validity, or a trajectory of joint positions.
    Command(JointTrajectory): JointTrajectory on Command,
    /// Shapes for viewers.
    Markers(Box<MarkerArray>): MarkerArray on Markers,
    /// Points for viewers.
    Points(Box<PointCloud2>): PointCloud2 on Points,
    /// Frames for viewers; received ones are those of the robot's links.
    Frames(TFMessage): TFMessage on Frames,
    /// Joint velocities for `ros_control`.
    Velocities(Float64MultiArray): Float64MultiArray on Command,
    /// Goals of other programs.
    Goals(GoalStatusArray): GoalStatusArray on Goals,
    /// URDF of the robot.
    Description(RobotDescription): RobotDescription on Description,
    /// Time of a simulated robot.
    Clock(Clock): Clock on Clock,
    /// A solid to avoid.
    CollisionObject(Box<CollisionObject>): CollisionObject on CollisionObject,
}

impl Packet {
    /// Returns the stamp in the message's header, if the message type has one.
    pub fn stamp_mut(&mut self) -> Option<&mut Time> {
        let header = match self {
            Self::Joints(message) => &mut message.header,
            Self::Wrench(message) => &mut message.header,
            Self::Hand(message) => &mut message.header,
            Self::Fingers(message) => &mut message.header,
            Self::Depth(message) => &mut message.header,
            Self::Status(message) => &mut message.header,
            Self::FrankaState(message) => &mut message.header,
            Self::Command(message) => &mut message.header,
            Self::Touching(_)
            | Self::RobotMode(_)
            | Self::SafetyMode(_)
            | Self::ProgramRunning(_)
            | Self::SpeedScaling(_)
            | Self::Markers(_)
            | Self::Points(_)
            | Self::Frames(_)
            | Self::Velocities(_)
            | Self::Goals(_)
            | Self::Description(_)
            | Self::Clock(_)
            | Self::CollisionObject(_) => return None,
        };
        Some(&mut header.stamp)
    }
}

/// A received item.
#[derive(Clone, Debug, PartialEq)]
pub enum Delivery {
    /// A packet.
    Packet {
        /// Packet.
        packet: Packet,
        /// Identifier of the publisher.
        sender: u64,
        /// Time of receipt, by this machine's monotonic clock.
        received: Instant,
    },
    /// Data that cannot be read as its topic's type.
    Malformed {
        /// Topic.
        topic: Topic,
        /// Description of the error.
        words: String,
    },
    /// Call of a service, to be answered through [`Transport::answer`].
    Call {
        /// Service.
        service: Service,
        /// Identifier of the call.
        call: u64,
    },
    /// Answer to a call made by this side.
    Response {
        /// Service.
        service: Service,
        /// Answer.
        answer: Answer,
    },
}

/// Returns the error of a part of a transport that cannot be opened.
pub(super) fn cannot_open<E: std::fmt::Display>(what: &str) -> impl Fn(E) -> InputError {
    move |error| InputError::new(format!("cannot open {what}: {error}"))
}

/// Returns the error of a message that cannot be sent to `what`.
#[cfg(feature = "ros2")]
pub(super) fn cannot_send(what: &str, error: impl std::fmt::Display) -> InputError {
    InputError::new(format!("cannot send to {what}: {error}"))
}

/// A publisher of another program, as announced on the network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Publisher {
    /// Name of its topic.
    pub topic: String,
    /// Type of its messages.
    pub type_name: String,
    /// Whether lost messages are sent again.
    pub is_reliable: bool,
    /// Whether the last message is kept for later readers.
    pub is_kept: bool,
}

/// Wakes a waiting transport from another thread.
pub type Waker = std::sync::Arc<dyn Fn() + Send + Sync>;

/// One side of a transport. It belongs to one thread, which waits in [`receive`](Self::receive).
pub trait Transport {
    /// Returns a function that ends a wait early.
    fn waker(&self) -> Waker;

    /// Sends a packet to all subscribers, if there are any.
    ///
    /// # Errors
    /// If the transport can no longer send.
    fn send(&mut self, packet: &Packet) -> Result<(), InputError>;

    /// Waits for at most `timeout` and passes all received items to `take`.
    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery));

    /// Returns the number of known publishers of a topic, including this side's own.
    fn publisher_count(&self, topic: Topic) -> usize;

    /// Returns all known publishers, if the network announces them.
    fn publishers(&self) -> Vec<Publisher> {
        Vec::new()
    }

    /// Returns the number of known subscribers of a topic.
    fn subscriber_count(&self, topic: Topic) -> usize;

    /// Creates the explorer's publisher of commands; without it no command can be sent. Until then
    /// another explorer does not see this one.
    ///
    /// # Errors
    /// If it cannot be created.
    fn open_commands(&mut self) -> Result<(), InputError>;

    /// Whether a server of `service` has been found, so that a call reaches it.
    fn is_served(&mut self, service: &Service) -> bool;

    /// Calls a service of the other side; its answer arrives as a [`Delivery`].
    ///
    /// # Errors
    /// If the call cannot be sent.
    fn call(&mut self, service: &Service) -> Result<(), InputError>;

    /// Answers a call.
    ///
    /// # Errors
    /// If the answer cannot be sent.
    fn answer(&mut self, service: &Service, call: u64, answer: Answer) -> Result<(), InputError>;
}

/// Creates a transport in the thread that will own it.
pub type Connect = Box<dyn FnOnce() -> Result<Box<dyn Transport>, InputError> + Send>;
