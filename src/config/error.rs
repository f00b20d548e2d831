//! What can be wrong with a configuration, and where.

use crate::words::brief;
use std::fmt;
use std::path::PathBuf;
use thiserror::Error;

/// Where a value came from.
#[derive(Clone, Debug, PartialEq)]
pub enum Origin {
    /// A file, and the line if the key stands in it.
    File {
        /// Its path as given.
        path: PathBuf,
        /// Line of the key, counted from 1.
        line: Option<usize>,
    },
    /// A `--set` on the command line, as typed.
    Set(String),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::File { path, line: Some(line) } => write!(f, "{}:{line}", path.display()),
            Self::File { path, line: None } => write!(f, "{}", path.display()),
            Self::Set(text) => write!(f, "--set {}", brief(text)),
        }
    }
}

/// What is wrong with a configuration.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {cause}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The file is not TOML.
    #[error("{origin}: not valid TOML: {message}")]
    Syntax {
        /// Where.
        origin: Origin,
        /// What the parser expected.
        message: String,
    },
    /// No such key.
    #[error("{origin}: unknown key `{key}`{}; allowed here: {}", did_you_mean(nearest), allowed.join(", "))]
    UnknownKey {
        /// Where.
        origin: Origin,
        /// The key.
        key: String,
        /// The known key most like it.
        nearest: Option<String>,
        /// All keys known there.
        allowed: Vec<String>,
    },
    /// A key that must be there.
    #[error("{origin}: `{key}` is missing")]
    Missing {
        /// Where.
        origin: Origin,
        /// The key.
        key: String,
    },
    /// The file is one of another kind.
    #[error("{}: this is {found}; {remedy}", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What it holds.
        found: &'static str,
        /// What to do with it.
        remedy: &'static str,
    },
    /// A value of the wrong type, or an unknown choice.
    #[error("{origin}: `{key}`{}: {message}", shown(value))]
    Invalid {
        /// Where.
        origin: Origin,
        /// The key.
        key: String,
        /// The value found there.
        value: Option<String>,
        /// What was expected.
        message: String,
    },
    /// A value that is not allowed.
    #[error("{origin}: `{key}` = {}: allowed is {allowed}", brief(value))]
    NotAllowed {
        /// Where.
        origin: Origin,
        /// The key.
        key: String,
        /// The value.
        value: String,
        /// What may stand there.
        allowed: String,
    },
    /// A `--set` that is not `key=value`, or whose key leads through a value.
    #[error(
        "--set {}: write it as key=value, with dots between tables, as in gp.noise=[1e-4,0.1]",
        brief(text)
    )]
    Assignment {
        /// As typed.
        text: String,
    },
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |key| format!(", did you mean `{key}`?"))
}

fn shown(value: &Option<String>) -> String {
    value.as_ref().map_or(String::new(), |value| format!(" = {}", brief(value)))
}
