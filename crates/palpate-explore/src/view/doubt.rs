//! Doubt about a view: touches contradict it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Reason for which a view is left out of the belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ViewDoubt {
    /// Number of contacts.
    pub contacts: u32,
    /// Number of these that are on the seen surface.
    pub explained: u32,
    /// Number of touches that went through the seen surface.
    pub through: u32,
}

impl fmt::Display for ViewDoubt {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { contacts, explained, through } = self;
        write!(f, "{explained} of {contacts} contacts are on it, {through} touches went through it")
    }
}
