//! What a command says, and how it ends.

use anyhow::Context;
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

/// Prints to standard output; a reader who has gone away is no error.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    match writeln!(io::stdout(), "{text}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("standard output")
        }
        _ => Ok(()),
    }
}

/// Prints to standard error. There is no one to tell that it cannot be written, and no work is
/// worth less for that.
pub(super) fn tell(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
