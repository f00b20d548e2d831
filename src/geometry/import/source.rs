//! What every importer is given: the bytes of a file, and where else it may look.

use crate::error::Invalid;
use std::path::Path;

/// Where the buffers of a glTF document may lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Buffers {
    /// In the folder of the document or below it, so that a mesh from a stranger opens no other
    /// file.
    #[default]
    Beside,
    /// Anywhere.
    Anywhere,
}

impl Buffers {
    /// Anywhere if `outside` is allowed.
    pub fn outside(outside: bool) -> Self {
        if outside { Self::Anywhere } else { Self::Beside }
    }
}

/// A file that is read.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
    pub buffers: Buffers,
}

/// Most bytes of a mesh file, and of all buffers it refers to; chosen: the most triangles that are
/// accepted take 1.3 GB as the longest of texts, an STL.
pub(super) const BYTES_MAX: u64 = 2 << 30;

/// A line of a text format that cannot be parsed, which the message shows cut if it is long; lines
/// count from 1.
pub(super) fn bad_line(line: usize, expected: &str, found: &str) -> Invalid {
    let found: String = found.trim().chars().take(60).collect();
    Invalid::new(format!("line {line}: expected {expected}, found \"{found}\""))
}
