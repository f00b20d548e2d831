//! STL import, binary or text. Normals, colours and names are ignored; all solids become one mesh.

use std::io::{self, Cursor, Read, Seek, SeekFrom};

use nalgebra::Point3;
use stl_io::{Triangle, create_stl_reader};

use super::source::{Source, bad_line};
use crate::raw::RawMesh;
use palpate_input::error::InputError;
use palpate_input::files::without_bom;

/// Bytes before the triangles of a binary file: a text, then their number.
const HEADER: usize = 84;
/// Bytes per binary triangle.
const TRIANGLE: u64 = 50;

/// Expected syntax of a text file.
const STATEMENTS: &str = "solid, then facets (facet normal, outer loop, three times vertex and \
                          three finite numbers, endloop, endfacet), then endsolid";

/// Reads an STL file.
pub(super) fn read(source: &Source) -> Result<RawMesh, InputError> {
    let mut raw = RawMesh::default();
    if is_binary(source.bytes)? {
        // The header of a binary file may begin with "solid" like a text file.
        let bytes = [&[0; HEADER - 4], &source.bytes[HEADER - 4..]].concat();
        let triangles = create_stl_reader(&mut Cursor::new(bytes)).and_then(Iterator::collect);
        add(triangles.map_err(|error| InputError::new(format!("STL: {error}")))?, &mut raw)?;
        return Ok(raw);
    }
    let text = plain(&String::from_utf8_lossy(without_bom(source.bytes)));
    let mut lines_before = 0;
    for solid in solids(&text) {
        let start = solid.len() - solid.trim_start().len();
        let mut lines = Lines { text: &solid[start..], at: 0 };
        let triangles = create_stl_reader(&mut lines).and_then(Iterator::collect);
        let triangles = triangles.map_err(|_| {
            let read = &solid[..start + lines.at];
            let found = read.lines().last().filter(|line| !line.is_empty());
            let found = found.unwrap_or("the end of the file");
            let line = lines_before + read.lines().count();
            bad_line(line, STATEMENTS, found)
        })?;
        add(triangles, &mut raw)?;
        lines_before += solid.lines().count();
    }
    Ok(raw)
}

/// Whether a file is binary. A file whose length matches its number of triangles is; others are
/// distinguished by the first word of a text; if it is not a text, it is truncated or padded.
fn is_binary(bytes: &[u8]) -> Result<bool, InputError> {
    let is_text = without_bom(bytes).trim_ascii_start().to_ascii_lowercase().starts_with(b"solid");
    let count = bytes.get(HEADER - 4..HEADER).and_then(<[u8]>::first_chunk);
    let count = count.map(|&bytes| u32::from_le_bytes(bytes));
    let count = count.unwrap_or(0);
    let needed = HEADER as u64 + TRIANGLE * u64::from(count);
    let actual = bytes.len();
    match needed == actual as u64 {
        true => Ok(true),
        false if is_text => Ok(false),
        false => Err(InputError::new(format!(
            "STL: not a text that begins with \"solid\", and a binary file of {count} triangles has \
             {needed} bytes, not {actual}"
        ))),
    }
}

/// Returns the text line by line, without names and normals, which may be anything: a bare `solid`
/// and `facet normal nan nan nan` are common.
fn plain(text: &str) -> String {
    let line = |line: &str| {
        let line = line.to_lowercase();
        match line.split_whitespace().next() {
            Some("solid") => "solid \n".into(),
            Some("endsolid") => "endsolid\n".into(),
            Some("facet") => "facet normal 0 0 0\n".into(),
            _ => line + "\n",
        }
    };
    text.lines().map(line).collect()
}

/// Splits the text into pieces that end with `endsolid`, without trailing blanks.
fn solids(text: &str) -> impl Iterator<Item = &str> {
    text.split_inclusive("endsolid\n").filter(|solid| !solid.trim().is_empty())
}

/// A text that is read line by line, so that the position of an error is known.
struct Lines<'a> {
    text: &'a str,
    at: usize,
}

impl Read for Lines<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let rest = &self.text.as_bytes()[self.at..];
        let line = rest.split_inclusive(|&byte| byte == b'\n').next().unwrap_or_default();
        let count = line.len().min(buffer.len());
        buffer[..count].copy_from_slice(&line[..count]);
        self.at += count;
        Ok(count)
    }
}

impl Seek for Lines<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Start(0) => self.at = 0,
            _ => return Err(io::ErrorKind::Unsupported.into()),
        }
        Ok(0)
    }
}

fn add(triangles: Vec<Triangle>, raw: &mut RawMesh) -> Result<(), InputError> {
    let corners: Vec<_> = triangles.iter().flat_map(|triangle| triangle.vertices).collect();
    let positions = corners.iter().map(|corner| Point3::from(corner.0.map(f64::from)));
    let corners = (0..corners.len() as u32).step_by(3);
    raw.add_part("solid", positions, corners.map(|first| [first, first + 1, first + 2]))
}
