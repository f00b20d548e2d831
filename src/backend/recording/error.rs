//! Why a recording cannot be read.

use crate::words::brief;
use std::io;
use thiserror::Error;

/// Why a recording cannot be read.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The system does not hand out the file.
    #[error(transparent)]
    Unreadable(#[from] io::Error),
    /// No MCAP file.
    #[error("not a recording: it does not begin as an MCAP file does")]
    Foreign,
    /// It ends, or goes on, without saying what it is of.
    #[error(
        "not a recording of palpate, or cut before it says of what: it has no metadata `palpate`"
    )]
    Headless,
    /// What it is of is missing or cannot be.
    #[error("in its metadata `{name}` is {}", found.as_deref().map_or("missing".into(), |found| format!("\"{}\"", brief(found))))]
    About {
        /// Which.
        name: &'static str,
        /// As it stands there.
        found: Option<String>,
    },
    /// Its messages have other fields than this program's.
    #[error("its messages {name} have other fields than this version's")]
    Layout {
        /// The message.
        name: &'static str,
    },
    /// What is written there is not what was once.
    #[error("damaged before byte {byte}: {message}")]
    Damaged {
        /// How far it was read.
        byte: usize,
        /// What is wrong.
        message: String,
    },
}
