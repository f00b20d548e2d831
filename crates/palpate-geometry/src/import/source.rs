//! Input of the importers: the bytes of a file, and permitted other files.

use palpate_input::error::InputError;
use std::path::Path;

/// A file to import.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
    /// Whether the buffers of a glTF document may lie outside its folder; if not, a mesh of unknown
    /// origin cannot open other files.
    pub allow_external_buffers: bool,
}

/// Largest size of a mesh file, and of all buffers it refers to; a heuristic: the largest number of
/// triangles takes 1.3 GB in the longest format, a text STL.
pub(super) const BYTES_MAX: u64 = 2 << 30;

/// Returns the error of a line of a text format that cannot be parsed, shortened if it is long;
/// lines count from 1.
pub(super) fn bad_line(line: usize, expected: &str, found: &str) -> InputError {
    let found: String = found.trim().chars().take(60).collect();
    InputError::new(format!("line {line}: expected {expected}, found \"{found}\""))
}
