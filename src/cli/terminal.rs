//! Terminal output and outcomes of commands.

use anstyle::{AnsiColor, Style};
use anyhow::Context;
use std::fmt;
use std::io::{self, IsTerminal, Write};
use terminal_size::{Width, terminal_size_of};

/// Completion of a command that did not fail with an error.
pub(super) enum Completion {
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

/// Prints to stdout as [`print`] does; on a terminal, sentences that are longer than a line are
/// continued below, indented.
pub(super) fn print_fitted(text: &str) -> anyhow::Result<()> {
    match terminal_size_of(io::stdout()).filter(|_| io::stdout().is_terminal()) {
        Some((Width(columns), _)) => print(&fitted(text, columns.into())),
        None => print(text),
    }
}

/// Breaks lines of single-spaced words that are longer than `columns`; a table has wider gaps, and
/// a path no space.
fn fitted(text: &str, columns: usize) -> String {
    let mut fitted = String::new();
    for line in text.lines() {
        let is_sentence = !line.contains("  ");
        let mut length = 0;
        for (i, word) in line.split(' ').enumerate() {
            let width = word.chars().count();
            match i {
                0 => {}
                _ if is_sentence && length + 1 + width > columns => {
                    fitted += "\n  ";
                    length = 2;
                }
                _ => {
                    fitted.push(' ');
                    length += 1;
                }
            }
            fitted += word;
            length += width;
        }
        fitted.push('\n');
    }
    fitted.trim_end_matches('\n').into()
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
    use super::{fitted, quoted};

    #[test]
    fn long_sentences_are_continued_and_tables_are_not() {
        let text = "one two three four\na  table   of   cells\nshort";
        assert_eq!(fitted(text, 9), "one two\n  three\n  four\na  table   of   cells\nshort");
        assert_eq!(fitted(text, 80), text);
        let path = "report: runs/a/very/long/path/report.html";
        assert_eq!(fitted(path, 12), "report:\n  runs/a/very/long/path/report.html");
    }

    #[test]
    fn only_words_with_special_characters_are_quoted() {
        assert_eq!(quoted("--set"), "--set");
        assert_eq!(quoted("runs/a-1.toml"), "runs/a-1.toml");
        assert_eq!(quoted(""), "''");
        assert_eq!(quoted("planners=[\"a\"]"), "'planners=[\"a\"]'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}

/// State of a part that `palpate doctor` checks.
#[derive(PartialEq)]
pub(super) enum State {
    Ok,
    /// An optional part is missing.
    Absent,
    Wrong,
}

/// A part, its state, and what was found or what to do.
pub(super) type Line = (&'static str, State, String);
