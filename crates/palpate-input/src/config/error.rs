//! Errors of a configuration, with their place.

use crate::format::shorten;
use std::fmt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Origin of a value.
#[derive(Clone, Debug, PartialEq)]
pub enum Origin {
    /// A file, and the line if it contains the key.
    File {
        /// Path of the file, as given.
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
            Self::Set(text) => write!(f, "--set {}", shorten(text)),
        }
    }
}

/// Error of a configuration: a message with its place, and its parts.
#[derive(Debug, Error)]
#[error("{message}")]
pub struct ConfigError {
    pub(super) message: String,
    /// Origin of the value; `None` for a `--set` that is not an assignment.
    pub origin: Option<Box<Origin>>,
    /// The key.
    pub key: Option<String>,
    /// Value of the key, as found.
    pub value: Option<String>,
    /// Allowed values.
    pub allowed: Option<String>,
}

impl ConfigError {
    /// Creates an error from the place and the message.
    pub(super) fn new(origin: Origin, message: impl fmt::Display) -> Self {
        let message = format!("{origin}: {message}");
        Self { message, origin: Some(Box::new(origin)), key: None, value: None, allowed: None }
    }

    /// Creates the error of a file that cannot be read.
    pub fn unreadable(path: &Path, cause: &std::io::Error) -> Self {
        Self::new(Origin::File { path: path.into(), line: None }, cause)
    }

    /// Creates the error of a value that is not allowed.
    pub fn not_allowed(origin: Origin, key: String, value: String, allowed: String) -> Self {
        let message = format!("`{key}` = {}: allowed is {allowed}", shorten(&value));
        let (key, value, allowed) = (Some(key), Some(value), Some(allowed));
        Self { key, value, allowed, ..Self::new(origin, message) }
    }

    /// Creates the error of a value of the wrong type, an unknown choice, or a repeated key.
    pub(super) fn invalid(
        origin: Origin,
        key: String,
        value: Option<String>,
        allowed: String,
    ) -> Self {
        let shown = value.as_ref().map_or(String::new(), |value| format!(" = {}", shorten(value)));
        let message = format!("`{key}`{shown}: {allowed}");
        Self { key: Some(key), value, allowed: Some(allowed), ..Self::new(origin, message) }
    }

    /// Creates the error of a file that is not TOML.
    pub(super) fn syntax(origin: Origin, expected: String) -> Self {
        let message = format!("not valid TOML: {expected}");
        Self { allowed: Some(expected), ..Self::new(origin, message) }
    }

    /// Creates the error of a `--set` that is not `key=value`, or whose key leads through a value.
    pub(super) fn assignment(text: &str) -> Self {
        let message = format!(
            "--set {}: use key=value, with dots between tables, e.g. gp.noise=[1e-4,0.1]",
            shorten(text)
        );
        Self { message, origin: None, key: None, value: Some(text.into()), allowed: None }
    }
}
