//! What carries packets between the two sides: ROS 2, ROS 1, or a channel of this process.

use super::packet::Packet;
use super::service::{Answer, Service};
use super::topics::Topic;
use std::time::{Duration, Instant};
use thiserror::Error;

/// What arrived.
#[derive(Clone, Debug, PartialEq)]
pub enum Delivery {
    /// A packet.
    Packet {
        /// It.
        packet: Packet,
        /// Who sent it: the same number for the same publisher.
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
        answer: Answer,
    },
}

/// Why a transport cannot carry.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TransportError {
    /// This build lacks it.
    #[error(
        "kind = \"{kind}\" needs a build with the feature `{kind}`: \
         cargo build --release --features {kind}"
    )]
    NotBuilt {
        /// As `[backend]` names it.
        kind: &'static str,
    },
    /// There is nothing to connect to.
    #[error("kind = \"simulated\" has no arm to connect to; allowed are \"ros2\", \"ros1\"")]
    Simulated,
    /// It cannot be set up.
    #[error("cannot open {what}: {words}")]
    Open {
        /// What part of it.
        what: String,
        /// What the library says.
        words: String,
    },
    /// It does not send.
    #[error("cannot send to {what}: {words}")]
    Send {
        /// Where.
        what: String,
        /// What the library says.
        words: String,
    },
}

#[cfg(any(feature = "ros1", feature = "ros2"))]
impl TransportError {
    /// What came of sending to `topic`: what the writer says, or none if it is not this side's.
    pub(super) fn of_sending(topic: &str, sent: Option<Result<(), String>>) -> Result<(), Self> {
        sent.unwrap_or(Err("not this side's".into()))
            .map_err(|words| Self::Send { what: topic.into(), words })
    }
}

/// Wakes a transport that waits, from another thread.
pub type Waker = std::sync::Arc<dyn Fn() + Send + Sync>;

/// One side's end. It belongs to one thread, which waits in [`receive`](Self::receive).
pub trait Transport {
    /// What ends a wait early.
    fn waker(&self) -> Waker;

    /// Sends a packet to whoever listens; nobody may.
    ///
    /// # Errors
    /// If the transport does not send any more.
    fn send(&mut self, packet: &Packet) -> Result<(), TransportError>;

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
    fn call(&mut self, service: &Service) -> Result<(), TransportError>;

    /// Answers a call.
    ///
    /// # Errors
    /// If the answer cannot be sent.
    fn answer(
        &mut self,
        service: &Service,
        call: u64,
        answer: &Answer,
    ) -> Result<(), TransportError>;
}

/// What makes a transport in the thread that is going to own it.
pub type Connect = Box<dyn FnOnce() -> Result<Box<dyn Transport>, TransportError> + Send>;
