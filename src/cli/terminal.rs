//! What a command says, and how it ends.

use anstyle::{AnsiColor, Style};
use anyhow::Context;
use std::fmt;
use std::io::{self, Write};

/// How a command ended, if it did not fail.
pub(super) enum Ending {
    /// Whole.
    Done,
    /// What was tested did not hold.
    Failed,
    /// What was asked cannot be told.
    Undecided,
    /// The person who began it stopped it.
    Interrupted,
}

/// How much a command says beside its result.
#[derive(Clone, Copy, clap::Args)]
pub(super) struct Talk {
    /// Say nothing on standard error but errors: no notes, no progress.
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,
}

impl Talk {
    /// Says on standard error what a user may want to know.
    pub(super) fn note(self, text: impl fmt::Display) {
        if !self.quiet {
            say(AnsiColor::Yellow.on_default().bold(), "note", text);
        }
    }
}

/// Says on standard error why a command could not do what it was asked.
pub(super) fn error(text: impl fmt::Display) {
    say(AnsiColor::Red.on_default().bold(), "error", text);
}

/// A line on standard error, coloured on a terminal; one who does not listen is no error.
fn say(style: Style, kind: &str, text: impl fmt::Display) {
    let _ = writeln!(anstream::stderr(), "{style}{kind}:{style:#} {text}");
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
