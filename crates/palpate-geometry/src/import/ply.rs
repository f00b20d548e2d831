//! PLY import, text or binary of either byte order: the elements `vertex`, `face` and `tristrips`;
//! everything else is ignored.

use foldhash::{HashSet, HashSetExt};
use nalgebra::Point3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, Header};

use super::ply_data::{Data, index};
use super::source::{Source, bad_line, text};
use crate::polygon::{strip, triangulate};
use crate::raw::RawMesh;
use palpate_input::error::InputError;
use palpate_input::files::without_bom;

/// Properties of a position.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Usual names of the list of a face's vertices.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads a PLY file.
pub(super) fn read(source: &Source) -> Result<RawMesh, InputError> {
    let Elements { header, vertices, faces, strips } = elements(source.bytes)?;
    if faces.is_empty() && strips.is_empty() && !vertices.is_empty() {
        let list = header.elements.values().map(|element| (&element.name, element.count));
        let list: Vec<_> = list.map(|(name, count)| format!("{name} {count}")).collect();
        return Err(InputError::new(format!(
            "holds {} points and no faces (elements: {}), like a point cloud; a mesh has \
             element \"face\" or \"tristrips\"",
            vertices.len(),
            list.join(", ")
        )));
    }
    let mut raw = RawMesh::default();
    raw.skipped_primitives = faces.iter().filter(|face| face.len() < 3).count();
    let mut triangles = Vec::with_capacity(faces.len());
    faces.iter().for_each(|face| triangulate(face, &vertices, &mut triangles));
    triangles.extend(strips.iter().flat_map(|corners| strip(corners)));
    raw.add_part("PLY", vertices.into_iter(), triangles)?;
    Ok(raw)
}

/// Returns the vertices of a PLY file, in metres.
///
/// # Errors
/// If it is invalid, or a coordinate is not finite.
pub fn points(bytes: &[u8]) -> Result<Vec<Point3<f64>>, InputError> {
    let vertices = vertices(bytes)?;
    let is_lost = |vertex: &Point3<f64>| !vertex.iter().all(|coordinate| coordinate.is_finite());
    match vertices.iter().position(is_lost) {
        Some(lost) => {
            let at = <[f64; 3]>::from(vertices[lost]);
            Err(InputError::new(format!("PLY: vertex {lost} is not finite: {at:?}")))
        }
        None => Ok(vertices),
    }
}

/// Returns the vertices of a PLY file in its unit, also those that are not finite.
///
/// # Errors
/// If it is invalid.
pub fn vertices(bytes: &[u8]) -> Result<Vec<Point3<f64>>, InputError> {
    Ok(elements(bytes)?.vertices)
}

/// Elements of a PLY file.
struct Elements {
    header: Header,
    vertices: Vec<Point3<f64>>,
    /// Vertex indices of each polygon.
    faces: Vec<Vec<u32>>,
    /// Vertex indices of each strip of triangles.
    strips: Vec<Vec<u32>>,
}

fn elements(bytes: &[u8]) -> Result<Elements, InputError> {
    let (header_text, rest) = split_header(without_bom(bytes));
    let mut reader = Reader::new(header_text.as_bytes());
    let header = Parser::<DefaultElement>::new().read_header(&mut reader);
    let header = header.map_err(|error| header_fault(&error, &header_text))?;
    let payload_text;
    let mut data = match header.encoding {
        Encoding::Ascii => {
            payload_text = text(rest);
            Data::text(&payload_text, header_text.lines().count())
        }
        binary => Data::binary(rest, binary),
    };
    let (mut vertices, mut faces, mut strips) = (Vec::new(), Vec::new(), Vec::new());
    for (name, element) in &header.elements {
        // Each element takes at least one byte, unless it has no properties.
        if element.count > bytes.len() {
            let count = element.count;
            return Err(InputError::new(format!(
                "PLY: declares {count} of element \"{name}\", more than the file has bytes"
            )));
        }
        match name.as_str() {
            "vertex" => vertices = positions(element, &mut data)?,
            "face" => faces = lists(element, &mut data, None)?,
            // A negative index ends a strip.
            "tristrips" => strips = lists(element, &mut data, Some(|index| index < 0.0))?,
            _ => data.read(element, "numbers", |_| Some(()))?,
        }
    }
    match data.bytes_left() {
        0 => Ok(Elements { header, vertices, faces, strips }),
        left => {
            Err(InputError::new(format!("PLY: holds {left} bytes more than its header declares")))
        }
    }
}

/// Splits a file after its header, whose lines are returned with line feeds.
fn split_header(bytes: &[u8]) -> (String, &[u8]) {
    let end = match bytes.iter().position(|byte| b"\r\n".contains(byte)) {
        Some(end) if bytes[end] == b'\r' && bytes.get(end + 1) != Some(&b'\n') => b'\r',
        _ => b'\n',
    };
    let (mut header, mut names) = (String::new(), HashSet::new());
    let mut rest = bytes;
    for line in bytes.split_inclusive(|&byte| byte == end) {
        rest = &rest[line.len()..];
        let line = header_line(&String::from_utf8_lossy(line.trim_ascii()), &mut names);
        header.extend([&line, "\n"]);
        if line == "end_header" {
            break;
        }
    }
    (header, rest)
}

/// Returns a line of a header as the parser needs it. The words of a comment, in any encoding, are
/// left out; a blank line becomes a comment. Properties of an element, whose `names` so far are
/// given, get different names: the parser would merge two paddings called `gap`.
fn header_line(line: &str, names: &mut HashSet<String>) -> String {
    let mut words = line.split_whitespace();
    match words.next() {
        None | Some("comment") => "comment".into(),
        Some("obj_info") => "obj_info".into(),
        Some("property") => {
            if names.insert(words.next_back().unwrap_or_default().to_owned()) {
                return line.to_owned();
            }
            let line = format!("{line}--{}", names.len());
            names.insert(line.clone());
            line
        }
        Some(first) => {
            if first == "element" {
                names.clear();
            }
            line.to_owned()
        }
    }
}

/// Returns the error of a header, with its line.
fn header_fault(error: &ParseError, header: &str) -> InputError {
    // Errors count the line of the header that is being read from 1.
    match error.line().and_then(|line| Some((line, header.lines().nth(line.checked_sub(1)?)?))) {
        Some((line, found)) => bad_line(line, "a PLY header", found),
        None => {
            let words = error.to_string();
            InputError::new(format!("PLY: {}", words.lines().next().unwrap_or_default()))
        }
    }
}

fn positions(element: &ElementDef, data: &mut Data) -> Result<Vec<Point3<f64>>, InputError> {
    let [x, y, z] = AXES.map(|axis| place(element, &[axis]));
    let (Some(x), Some(y), Some(z)) = (x, y, z) else { return Err(lacks(element, "x, y and z")) };
    let mut positions = Vec::new();
    data.read(element, "a position", |properties| {
        let [x, y, z] = [x, y, z].map(|axis| properties[axis].first().copied());
        positions.push(Point3::new(x?, y?, z?));
        Some(())
    })?;
    Ok(positions)
}

/// Returns the vertex indices of faces or strips. The list of one element is split where an index
/// `is_end`.
fn lists(
    element: &ElementDef,
    data: &mut Data,
    is_end: Option<fn(f64) -> bool>,
) -> Result<Vec<Vec<u32>>, InputError> {
    let corners = place(element, &CORNERS).ok_or_else(|| lacks(element, CORNERS[0]))?;
    let mut lists = Vec::new();
    data.read(element, "vertex indices from 0", |properties| {
        let parts = properties[corners].split(|&corner| is_end.is_some_and(|it| it(corner)));
        for part in parts {
            lists.push(part.iter().map(|&corner| index(corner)).collect::<Option<_>>()?);
        }
        Some(())
    })?;
    Ok(lists)
}

/// Returns the place of the first property that has one of `names`.
fn place(element: &ElementDef, names: &[&str]) -> Option<usize> {
    element.properties.keys().position(|name| names.contains(&name.as_str()))
}

fn lacks(element: &ElementDef, needed: &str) -> InputError {
    InputError::new(format!("PLY: element \"{}\" must have {needed}", element.name))
}
