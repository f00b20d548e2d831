//! The name of a vertex or triangle in the file it came from.

use std::fmt;

/// A vertex or triangle as its source knows it: number `index` (from 0) of `part`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Element {
    /// The part of the source, such as an object's name.
    pub part: String,
    /// The number within that part, from 0.
    pub index: usize,
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.index, self.part)
    }
}
