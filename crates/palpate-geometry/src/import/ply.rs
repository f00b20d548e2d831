//! PLY import, text or binary of either byte order. Polygons become triangle fans, as for OBJ;
//! everything except positions and faces is ignored.

use nalgebra::Point3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::PropertyAccessResult::{Ignored, Set, UnsupportedType};
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult};

use super::source::{Source, bad_line};
use crate::raw::RawMesh;
use palpate_input::error::InputError;
use palpate_input::files::without_bom;

/// Properties of a position.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Usual names of the list of a face's vertices.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads a PLY file.
pub(super) fn read(source: &Source) -> Result<RawMesh, InputError> {
    let (vertices, faces) = elements(source.bytes)?;
    if faces.is_empty() && !vertices.is_empty() {
        return Err(InputError::new(format!(
            "holds {} points and no faces (a point cloud); a mesh with faces is required",
            vertices.len()
        )));
    }
    let mut raw = RawMesh::default();
    raw.skipped_primitives = faces.iter().filter(|face| face.0.len() < 3).count();
    let fans = faces.iter().filter_map(|Face(corners)| corners.split_first());
    let triangles =
        fans.flat_map(|(&hub, rim)| rim.array_windows().map(move |&[b, c]| [hub, b, c]));
    raw.add_part("PLY", vertices.iter().map(|vertex| Point3::from(vertex.0)), triangles)?;
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
    Ok(elements(bytes)?.0.into_iter().map(|vertex| Point3::from(vertex.0)).collect())
}

fn elements(bytes: &[u8]) -> Result<(Vec<Vertex>, Vec<Face>), InputError> {
    let bytes = without_bom(bytes);
    let mut reader = Reader::new(bytes);
    let header = Parser::<Other>::new().read_header(&mut reader);
    let header = header.map_err(|error| fault(&error, bytes, &Encoding::Ascii))?;
    let (mut vertices, mut faces) = (Vec::<Vertex>::new(), Vec::<Face>::new());
    for (name, element) in &header.elements {
        // Each element takes at least one byte, unless it has no properties.
        if element.count > bytes.len() {
            let count = element.count;
            return Err(InputError::new(format!(
                "PLY: declares {count} of element \"{name}\", more than the file has bytes"
            )));
        }
        let has = |property: &str| element.properties.contains_key(property);
        let place = |error: ParseError| fault(&error, bytes, &header.encoding);
        match name.as_str() {
            "vertex" => {
                require(element, AXES.iter().all(|axis| has(axis)), "x, y and z")?;
                let read = Parser::new().read_payload_for_element(&mut reader, element, &header);
                vertices = read.map_err(place)?;
            }
            "face" => {
                require(element, CORNERS.iter().any(|list| has(list)), CORNERS[0])?;
                let read = Parser::new().read_payload_for_element(&mut reader, element, &header);
                faces = read.map_err(place)?;
            }
            _ => {
                let others = Parser::<Other>::new();
                others.read_payload_for_element(&mut reader, element, &header).map_err(place)?;
            }
        }
    }
    let left = reader.into_inner().trim_ascii().len();
    if left > 0 {
        return Err(InputError::new(format!(
            "PLY: holds {left} bytes more than its header declares"
        )));
    }
    Ok((vertices, faces))
}

/// Checks that an element has the required properties.
fn require(element: &ElementDef, has: bool, needed: &str) -> Result<(), InputError> {
    match has {
        true => Ok(()),
        false => {
            let name = &element.name;
            Err(InputError::new(format!("PLY: element \"{name}\" must have {needed}")))
        }
    }
}

/// Returns the error with its line number, if it is in text.
fn fault(error: &ParseError, bytes: &[u8], encoding: &Encoding) -> InputError {
    match error.line().filter(|_| *encoding == Encoding::Ascii) {
        Some(line) => {
            let found = bytes.split(|&byte| byte == b'\n').nth(line.saturating_sub(1));
            let found = String::from_utf8_lossy(found.unwrap_or_default());
            bad_line(line, "data as declared in the PLY header", &found)
        }
        None => {
            // Removes the prefix "Line 7: ": binary data has no lines.
            let words = error.to_string();
            let message = words.split_once(": ").filter(|_| error.line().is_some());
            let message = message.map_or(words.as_str(), |(_, message)| message);
            InputError::new(format!("PLY: {}", message.lines().next().unwrap_or_default()))
        }
    }
}

/// A position.
struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(axis) = AXES.iter().position(|axis| *axis == name) else { return Ignored };
        self.0[axis] = match property {
            Property::Char(number) => number.into(),
            Property::UChar(number) => number.into(),
            Property::Short(number) => number.into(),
            Property::UShort(number) => number.into(),
            Property::Int(number) => number.into(),
            Property::UInt(number) => number.into(),
            Property::Float(number) => number.into(),
            Property::Double(number) => number,
            _ => return UnsupportedType,
        };
        Set
    }
}

/// Vertex indices of a polygon.
struct Face(Vec<u32>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return Ignored;
        }
        let Some(corners) = property.to_u32_list() else { return UnsupportedType };
        self.0 = corners;
        Set
    }
}

/// An element that is skipped.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }

    fn set_property(&mut self, _: &str, _: Property) -> PropertyAccessResult {
        Ignored
    }
}
