//! What every importer is given: the bytes of a file, and where else it may look.

use palpate_input::error::Invalid;
use std::path::Path;

/// A file that is read.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
    /// Whether the buffers of a glTF document may lie outside its folder; otherwise a mesh of
    /// unknown origin opens no other file.
    pub outside_buffers: bool,
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
