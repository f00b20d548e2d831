//! STL import, binary or text. Normals, colours and names are ignored; all solids become one mesh.

use std::io::Cursor;

use nalgebra::Point3;
use stl_io::create_stl_reader;

use super::source::{Source, bad_line, text};
use crate::raw::RawMesh;
use palpate_input::error::InputError;
use palpate_input::files::without_bom;

/// Bytes before the triangles of a binary file: a text, then their number.
const HEADER: usize = 84;
/// Bytes per binary triangle.
const TRIANGLE: u64 = 50;
/// Bytes that some programs append to a file: zero, the end mark of DOS, and all bits set.
const PADDING: [u8; 3] = [0, 0x1a, 0xff];

/// First words of the statements of a facet, in order.
const FACET: [&[&str]; 7] = [
    &["facet"],
    &["outer", "loop"],
    &["vertex"],
    &["vertex"],
    &["vertex"],
    &["endloop"],
    &["endfacet"],
];
/// Expected syntax of a text file.
const STATEMENTS: &str = "solid, then facets (facet normal, outer loop, three times vertex and \
                          three finite numbers, endloop, endfacet), then endsolid";

/// Reads an STL file.
pub(super) fn read(source: &Source) -> Result<RawMesh, InputError> {
    let bytes = trim_padding(source.bytes);
    let needed = bytes_needed(source.bytes);
    // The header of a binary file may begin with "solid" like a text file.
    let is_binary = needed == source.bytes.len() as u64 || not_a_text(bytes).is_some();
    let corners = if is_binary { binary(source.bytes)? } else { corners(&text(bytes))? };
    let triangles = (0..corners.len() as u32).step_by(3);
    let triangles = triangles.map(|first| [first, first + 1, first + 2]);
    let mut raw = RawMesh::default();
    raw.add_part("solid", corners.into_iter(), triangles)?;
    Ok(raw)
}

/// Returns a file up to its last byte that is no padding, and the blanks after it.
fn trim_padding(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|byte| !is_padding(byte)).map_or(0, |last| last + 1);
    let blanks = bytes[end..].iter().take_while(|byte| byte.is_ascii_whitespace());
    &bytes[..end + blanks.count()]
}

fn is_padding(byte: &u8) -> bool {
    PADDING.contains(byte) || byte.is_ascii_whitespace()
}

/// Returns the number of triangles that the header of a binary file declares.
fn count(bytes: &[u8]) -> u32 {
    let count = bytes.get(HEADER - 4..HEADER).and_then(<[u8]>::first_chunk);
    count.map_or(0, |&bytes| u32::from_le_bytes(bytes))
}

/// Returns the length of a binary file with the declared number of triangles.
fn bytes_needed(bytes: &[u8]) -> u64 {
    HEADER as u64 + TRIANGLE * u64::from(count(bytes))
}

/// Returns why a file is no text; `None` if it is one.
fn not_a_text(bytes: &[u8]) -> Option<String> {
    let start = without_bom(bytes).trim_ascii_start();
    if !start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        return Some("not a text that begins with \"solid\"".into());
    }
    let is_control = |byte: &u8| byte.is_ascii_control() && !(0x09..=0x0d).contains(byte);
    let place = bytes.iter().position(is_control)?;
    Some(format!("not a text, byte {place} is {:#04x}", bytes[place]))
}

/// Returns the corners of the triangles of a binary file, which padding may follow.
fn binary(bytes: &[u8]) -> Result<Vec<Point3<f64>>, InputError> {
    let (needed, actual) = (bytes_needed(bytes), bytes.len());
    let sizes = || {
        let reason = not_a_text(bytes).unwrap_or_default();
        let count = count(bytes);
        format!(
            "STL: {reason}, and a binary file of {count} triangles has {needed} bytes, not {actual}"
        )
    };
    let parts = usize::try_from(needed).ok().and_then(|needed| bytes.split_at_checked(needed));
    let (data, rest) = parts.ok_or_else(|| InputError::new(sizes()))?;
    if !rest.iter().all(is_padding) {
        let sizes = sizes();
        return Err(InputError::new(format!("{sizes}; what follows is no padding")));
    }
    let data = [&[0; HEADER - 4], &data[HEADER - 4..]].concat();
    let triangles: Result<Vec<_>, _> =
        create_stl_reader(&mut Cursor::new(data)).and_then(Iterator::collect);
    let triangles = triangles.map_err(|error| InputError::new(format!("STL: {error}")))?;
    let corners = triangles.iter().flat_map(|triangle| triangle.vertices);
    Ok(corners.map(|corner| Point3::from(corner.0.map(f64::from))).collect())
}

/// Returns the corners of the triangles of a text. Names and normals may be anything: a bare
/// `solid` and `facet normal nan nan nan` are common.
fn corners(text: &str) -> Result<Vec<Point3<f64>>, InputError> {
    let mut corners = Vec::new();
    let (mut is_open, mut next) = (false, 0);
    for (number, line) in (1..).zip(text.lines()) {
        let wrong = || bad_line(number, STATEMENTS, line);
        let mut words = line.split_whitespace();
        let is = |known: &[&str]| {
            let mut words = line.split_whitespace();
            known.iter().all(|it| words.next().is_some_and(|word| word.eq_ignore_ascii_case(it)))
        };
        if is(FACET[next]) && is_open {
            if FACET[next] == ["vertex"] {
                words.next();
                corners.push(corner(words).ok_or_else(wrong)?);
            }
            next = (next + 1) % FACET.len();
        } else if next == 0 && is(if is_open { &["endsolid"] } else { &["solid"] }) {
            is_open = !is_open;
        } else if words.next().is_some() {
            return Err(wrong());
        }
    }
    match is_open {
        true => Err(bad_line(text.lines().count(), STATEMENTS, "the end of the file")),
        false => Ok(corners),
    }
}

/// Returns a corner from three finite numbers.
fn corner<'a>(words: impl Iterator<Item = &'a str>) -> Option<Point3<f64>> {
    let numbers: Option<Vec<f32>> = words.map(|word| word.parse().ok()).collect();
    let numbers: [f32; 3] = numbers?.try_into().ok()?;
    let is_finite = numbers.iter().all(|number| number.is_finite());
    is_finite.then(|| Point3::from(numbers.map(f64::from)))
}
