//! Input of the importers: the bytes of a file, and permitted other files.

use palpate_input::error::InputError;
use palpate_input::files::without_bom;
use std::path::Path;

/// A file to import.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
    /// Whether the buffers of a glTF document may lie outside its folder; if not, a mesh of unknown
    /// origin cannot open other files.
    pub allow_external_buffers: bool,
    /// Whether a glTF model is turned upright; if not, it keeps the frame of its file.
    pub upright: bool,
}

/// Largest size of a mesh file, and of all buffers it refers to; a heuristic: the largest number of
/// triangles takes 1.3 GB in the longest format, a text STL.
pub(super) const BYTES_MAX: u64 = 2 << 30;

/// Returns a text in which every line ends with a line feed, also if those of the file end with a
/// carriage return alone. UTF-16 is decoded after its byte order mark. Bytes that are not UTF-8, as
/// in comments in Latin-1, are replaced.
pub(super) fn text(bytes: &[u8]) -> String {
    let text = match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes).into(),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes).into(),
        _ => String::from_utf8_lossy(without_bom(bytes)),
    };
    match text.contains('\r') {
        true => text.replace("\r\n", "\n").replace('\r', "\n"),
        false => text.into_owned(),
    }
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units: Vec<u16> = bytes.as_chunks().0.iter().map(|&pair| unit(pair)).collect();
    String::from_utf16_lossy(&units)
}

/// Returns the error of a line of a text format that cannot be parsed, shortened if it is long;
/// lines count from 1.
pub(super) fn bad_line(line: usize, expected: &str, found: &str) -> InputError {
    let found: String = found.trim().chars().take(60).collect();
    InputError::new(format!("line {line}: expected {expected}, found \"{found}\""))
}
