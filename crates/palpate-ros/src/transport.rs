//! Packets and what carries them between the two sides: ROS 2, ROS 1, or a channel of a test.

use super::message::{
    BioTacHand, BiotacAll, DiagnosticArray, Float64MultiArray, JointState, JointTrajectory, Time,
    TriggerResponse, WrenchStamped,
};
use super::topics::{Service, Topic};
use palpate_input::error::Invalid;
use std::time::{Duration, Instant};

/// A message that is sent in a [`Packet`].
pub trait Packed: Into<Packet> {
    /// The message in `packet`, if it is of this type.
    fn in_packet(packet: &Packet) -> Option<&Self>;
}

macro_rules! packets {
    ($($(#[$doc:meta])* $kind:ident($held:ty): $message:ident on $topic:ident,)*) => {
        /// A message of any topic of the table, in the layout of ROS 2.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Packet {
            $($(#[$doc])* $kind($held),)*
        }

        impl Packet {
            /// Over which topic it goes.
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

            impl Packed for $message {
                fn in_packet(packet: &Packet) -> Option<&Self> {
                    let Packet::$kind(message) = packet else { return None };
                    Some(message)
                }
            }
        )*
    };
}

packets! {
    /// The arm's joints.
    Joints(JointState): JointState on Joints,
    /// Force and torque.
    Wrench(WrenchStamped): WrenchStamped on Wrench,
    /// A tactile frame of the BioTac's own driver.
    Hand(Box<BioTacHand>): BioTacHand on Tactile,
    /// The same of a Shadow hand.
    Fingers(Box<BiotacAll>): BiotacAll on Tactile,
    /// The arm's state.
    Status(DiagnosticArray): DiagnosticArray on Status,
    /// Joint velocities with names and validity.
    Command(JointTrajectory): JointTrajectory on Command,
    /// Joint velocities as `ros_control` takes them.
    Velocities(Float64MultiArray): Float64MultiArray on Command,
}

impl Packet {
    /// The stamp of its header, where the message type has one.
    pub fn stamp_mut(&mut self) -> Option<&mut Time> {
        let header = match self {
            Self::Joints(message) => &mut message.header,
            Self::Wrench(message) => &mut message.header,
            Self::Hand(message) => &mut message.header,
            Self::Fingers(message) => &mut message.header,
            Self::Status(message) => &mut message.header,
            Self::Command(message) => &mut message.header,
            Self::Velocities(_) => return None,
        };
        Some(&mut header.stamp)
    }
}

/// Something that arrived.
#[derive(Clone, Debug, PartialEq)]
pub enum Delivery {
    /// A packet.
    Packet {
        /// It.
        packet: Packet,
        /// The same number for the same publisher.
        sender: u64,
        /// When, by this machine's monotonic clock.
        received: Instant,
    },
    /// Something that cannot be read as its topic's type.
    Garbled {
        /// Where it came.
        topic: Topic,
        /// What is wrong with it.
        words: String,
    },
    /// A call of a service, to be answered through [`Transport::answer`].
    Call {
        /// Which.
        service: Service,
        /// Whose.
        call: u64,
    },
    /// The answer to a call of this side's own.
    Answered {
        /// Of which service.
        service: Service,
        /// What it says.
        answer: TriggerResponse,
    },
}

/// The error of a part of a transport that cannot be opened.
pub(super) fn cannot_open<E: std::fmt::Display>(what: &str) -> impl Fn(E) -> Invalid {
    move |error| Invalid::new(format!("cannot open {what}: {error}"))
}

/// The error of a message that cannot be sent to `what`.
#[cfg(any(feature = "ros1", feature = "ros2"))]
pub(super) fn cannot_send(what: &str, error: impl std::fmt::Display) -> Invalid {
    Invalid::new(format!("cannot send to {what}: {error}"))
}

/// Wakes a transport that waits, from another thread.
pub type Waker = std::sync::Arc<dyn Fn() + Send + Sync>;

/// One side's end. It belongs to one thread, which waits in [`receive`](Self::receive).
pub trait Transport {
    /// Returns what ends a wait early.
    fn waker(&self) -> Waker;

    /// Sends a packet to all subscribers, if there are any.
    ///
    /// # Errors
    /// If the transport does not send any more.
    fn send(&mut self, packet: &Packet) -> Result<(), Invalid>;

    /// Waits for at most `timeout` and hands over all that has arrived.
    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery));

    /// How many publishers of a topic are known, this side's own among them.
    fn publisher_count(&self, topic: Topic) -> usize;

    /// Whether a server of `service` has been found, so that a call reaches it.
    fn is_served(&mut self, service: &Service) -> bool;

    /// Calls a service of the other side; its answer is a delivery.
    ///
    /// # Errors
    /// If the call cannot be sent.
    fn call(&mut self, service: &Service) -> Result<(), Invalid>;

    /// Answers a call.
    ///
    /// # Errors
    /// If the answer cannot be sent.
    fn answer(
        &mut self,
        service: &Service,
        call: u64,
        answer: TriggerResponse,
    ) -> Result<(), Invalid>;
}

/// Makes a transport in the thread that is going to own it.
pub type Connect = Box<dyn FnOnce() -> Result<Box<dyn Transport>, Invalid> + Send>;
