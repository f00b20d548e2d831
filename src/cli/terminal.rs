//! What a command says, and how it ends.

use std::fmt;
use std::io::{self, Write};

/// How a command ended, if it did not fail.
pub(super) enum Ending {
    /// Whole.
    Done,
    /// What was tested did not hold.
    Failed,
    /// The person who began it stopped it.
    Interrupted,
}

/// Says on standard error what a user may want to know; one who does not listen is no error.
pub(super) fn note(text: impl fmt::Display) {
    let _ = writeln!(io::stderr(), "note: {text}");
}

/// Prints to standard output; a reader who has gone away is no error.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    match writeln!(io::stdout(), "{text}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}
