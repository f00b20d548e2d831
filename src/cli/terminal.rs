//! Terminal output and outcomes of commands.

use anstyle::{AnsiColor, Style};
use anyhow::Context;
use std::fmt;
use std::io::{self, Write};

/// Outcome of a command that did not fail with an error.
pub(super) enum Outcome {
    /// The command completed.
    Done,
    /// A test failed.
    Failed,
    /// The data do not decide the question.
    Undecided,
    /// The user interrupted the command.
    Interrupted,
}

/// Verbosity of a command.
#[derive(Clone, Copy, clap::Args)]
pub(super) struct Verbosity {
    /// Print only errors to stderr: no notes, no progress.
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,
}

impl Verbosity {
    /// Prints a note to stderr, unless quiet.
    pub(super) fn note(self, text: impl fmt::Display) {
        if !self.quiet {
            write_line(AnsiColor::Yellow.on_default().bold(), "note", text);
        }
    }
}

/// Prints an error to stderr.
pub(super) fn error(text: impl fmt::Display) {
    write_line(AnsiColor::Red.on_default().bold(), "error", text);
}

/// Writes a line to stderr, coloured on a terminal; write errors are ignored.
fn write_line(style: Style, kind: &str, text: impl fmt::Display) {
    let _ = writeln!(anstream::stderr(), "{style}{kind}:{style:#} {text}");
}

/// Prints to stdout; a closed pipe is not an error.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    match writeln!(io::stdout(), "{text}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("standard output")
        }
        _ => Ok(()),
    }
}

/// Quotes a word for a shell, if it needs quotes.
pub(super) fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./,:=+@%".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.into(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

/// Returns a command line of words, options with values and flags, quoted for a shell.
pub(super) fn command_line(
    words: &[&str],
    valued: &[(&str, Vec<String>)],
    flags: &[(&str, bool)],
) -> String {
    let mut line: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    for (name, values) in valued {
        line.extend(values.iter().map(|value| format!("--{name} {}", quoted(value))));
    }
    let given = flags.iter().filter(|(_, is_given)| *is_given);
    line.extend(given.map(|(name, _)| format!("--{name}")));
    line.join(" ")
}

/// Prints to stderr; write errors are ignored.
pub(super) fn print_stderr(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn only_words_with_special_characters_are_quoted() {
        assert_eq!(quoted("--set"), "--set");
        assert_eq!(quoted("runs/a-1.toml"), "runs/a-1.toml");
        assert_eq!(quoted(""), "''");
        assert_eq!(quoted("planners=[\"a\"]"), "'planners=[\"a\"]'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
