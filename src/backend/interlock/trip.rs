//! What an interlock found.

use std::fmt;

/// An interlock's reason to stop the body: what was found where, and what is allowed.
#[derive(Clone, Debug, PartialEq)]
pub struct Trip {
    /// The interlock.
    pub interlock: &'static str,
    /// Of what: a joint, a pair of links, an electrode; empty where there is only one.
    pub part: String,
    /// What was measured or foreseen.
    pub found: f64,
    /// The limit.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

impl fmt::Display for Trip {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { interlock, part, found, limit, unit } = self;
        let of = if part.is_empty() { "" } else { " of " };
        write!(f, "{interlock}{of}{part} is {found:.4} {unit}, its limit {limit:.4} {unit}")
    }
}
