//! Quality of service of readers and writers, and their registration with the poll.

use crate::transport::cannot_open;
use palpate_input::error::InputError;
use ros2_client::QosProfile;
use ros2_client::qos::{Durability, History, WhenFull};
use rustdds::mio1;
use rustdds::mio1::{Interest, Poll, Token};

/// Queue length of a reader or writer; a heuristic: more than arrive while a thread is delayed.
const DEPTH: usize = 64;

/// Token of the waker; all other sources are read after every wake-up.
pub(super) const WAKE: Token = Token(0);

/// QoS of a writer: compatible with all readers, and never blocking.
pub(super) fn reliable() -> QosProfile {
    QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: DEPTH })
}

/// QoS of a reader: compatible with sensor drivers.
pub(super) fn best_effort() -> QosProfile {
    QosProfile::subscription_default().history(History::KeepLast { depth: DEPTH })
}

/// QoS of a reader that also receives the last message published before its creation.
pub(super) fn latched() -> QosProfile {
    reliable().durability(Durability::TransientLocal)
}

/// QoS of a writer whose last `depth` messages are kept for later readers.
pub(super) fn kept(depth: usize) -> QosProfile {
    latched().history(History::KeepLast { depth })
}

/// Registers `source` with the poll; all sources are read after every wake-up.
///
/// # Errors
/// If the operating system refuses.
pub(super) fn watch(
    poll: &Poll,
    source: &mut impl mio1::event::Source,
    name: &str,
) -> Result<(), InputError> {
    let token = Token(WAKE.0 + 1);
    poll.registry().register(source, token, Interest::READABLE).map_err(cannot_open(name))
}
