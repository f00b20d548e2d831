//! Why an arm behind topics cannot be driven on.

use super::joints::JointsError;
use super::transport::TransportError;
use thiserror::Error;

/// Why an arm behind topics cannot be driven on.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LinkFault {
    /// The transport does not work.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Nothing was heard on some topics since the link was opened.
    #[error(
        "nothing heard for {patience_s} s on {}; is the arm's side running, with the same domain, and are \
         names and types those of [backend.topics]?{}", missing.join(", "), skipped_words(skipped)
    )]
    NotThere {
        /// Topics with their types.
        missing: Vec<String>,
        /// How long was waited.
        patience_s: f64,
        /// Messages of other devices that were skipped, in words.
        skipped: Vec<String>,
    },
    /// A topic fell silent.
    #[error("nothing new on {topic} for {:.0} ms{}", 1e3 * age_s, silent_words(*late_s, *backward))]
    Silent {
        /// Its name.
        topic: String,
        /// Age of what was last received.
        age_s: f64,
        /// If messages come, but too old by their stamps: how old.
        late_s: Option<f64>,
        /// Messages dropped because their stamps ran backwards.
        backward: u64,
    },
    /// A status topic whose publisher is gone; its messages come on change only.
    #[error("no publisher on {topic} any more")]
    Gone {
        /// Its name.
        topic: String,
    },
    /// A message without a stamp.
    #[error(
        "message on {topic} refused: its stamp is zero, so its age is unknown; stamp it, or set \
         backend.accept_unstamped = true to count its age from receipt"
    )]
    Unstamped {
        /// The topic's name.
        topic: String,
    },
    /// A message about joints is of no use.
    #[error("message on {topic} refused: {cause}")]
    Joints {
        /// The topic's name.
        topic: String,
        /// Why.
        cause: JointsError,
    },
    /// A message cannot be used.
    #[error("message on {topic} refused: {words}")]
    Message {
        /// The topic's name.
        topic: String,
        /// Why.
        words: String,
    },
    /// A message was measured later than it came.
    #[error(
        "message on {topic} refused: its stamp is {:.0} ms in the future; are the clocks synchronised?",
        1e3 * ahead_s
    )]
    Future {
        /// The topic's name.
        topic: String,
        /// By how much.
        ahead_s: f64,
    },
    /// A joint went farther than it can.
    #[error("joint \"{joint}\" went from {from:.4} to {to:.4} in {:.0} ms, farther than it can", 1e3 * dt_s)]
    Jump {
        /// Its name.
        joint: String,
        /// Position before.
        from: f64,
        /// Position after.
        to: f64,
        /// Time between.
        dt_s: f64,
    },
    /// Somebody else commands too.
    #[error("{count} publishers on {topic}, allowed is one: this program")]
    Publishers {
        /// The topic's name.
        topic: String,
        /// How many, this program among them.
        count: usize,
    },
    /// The arm's own computer refuses to move.
    #[error("the arm does not move: {words}")]
    Arm {
        /// What it says.
        words: String,
    },
    /// A service did not answer, or refused.
    #[error("service {name}: {words}")]
    Service {
        /// Its name.
        name: String,
        /// What it says.
        words: String,
    },
}

fn silent_words(late_s: Option<f64>, backward: u64) -> String {
    let late = late_s.map(|late_s| {
        format!(
            "; messages come, but their stamps are {:.0} ms old: are the clocks synchronised?",
            1e3 * late_s
        )
    });
    let dropped = (backward > 0)
        .then(|| format!("; {backward} messages were dropped because their stamps ran backwards"));
    [late, dropped].into_iter().flatten().collect()
}

fn skipped_words(skipped: &[String]) -> String {
    skipped.iter().map(|words| format!(" Skipped a message: {words}.")).collect()
}
