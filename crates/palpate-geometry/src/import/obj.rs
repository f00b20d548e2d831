//! Wavefront OBJ import. All objects and groups become one mesh; materials, normals, texture
//! coordinates, colours, points and lines are ignored.

use std::borrow::Cow;
use std::fmt::Write;

use nalgebra::Point3;

use super::source::{Source, bad_line, text};
use crate::polygon::triangulate;
use crate::raw::RawMesh;
use palpate_input::error::InputError;

/// Reads an OBJ file.
pub(super) fn read(source: &Source) -> Result<RawMesh, InputError> {
    let (text, skipped_primitives) = geometry_only(&text(source.bytes))?;
    let options = tobj::LoadOptions {
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default()))
            .map_err(|error| InputError::new(format!("OBJ: {error}")))?;
    let mut raw = RawMesh::default();
    raw.skipped_primitives = skipped_primitives;
    for tobj::Model { mesh, name } in &models {
        let (positions, _) = mesh.positions.as_chunks();
        let positions: Vec<_> = positions.iter().map(|&[x, y, z]| Point3::new(x, y, z)).collect();
        let mut triangles = Vec::new();
        for face in faces(mesh) {
            triangulate(face, &positions, &mut triangles);
        }
        raw.add_part(format!("object \"{name}\""), positions.into_iter(), triangles)?;
    }
    Ok(raw)
}

/// Returns the vertices of each face.
fn faces(mesh: &tobj::Mesh) -> impl Iterator<Item = &[u32]> {
    let mut rest = mesh.indices.as_slice();
    let mut arities = mesh.face_arities.iter();
    std::iter::from_fn(move || {
        // Without arities all faces are triangles.
        let arity = if mesh.face_arities.is_empty() { 3 } else { *arities.next()? };
        rest.split_off(..arity as usize)
    })
}

/// Keeps objects, positions and the position indices of faces, and checks them while their line
/// numbers are known: tobj would overflow on the other indices of a face if they are out of range,
/// and its errors contain no line number. Positions come first, and indices count from the first,
/// so that a face may stand before its vertices. Also returns the number of points and lines.
fn geometry_only(text: &str) -> Result<(String, usize), InputError> {
    let is_vertex = |line: &&str| line.split_whitespace().next() == Some("v");
    let vertices = text.lines().filter(is_vertex).count();
    let (mut positions, mut faces) = (String::with_capacity(text.len()), String::new());
    let (mut seen, mut skipped) = (0, 0);
    for (number, line) in statements(text) {
        let line = line.as_ref();
        let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
        match words.next() {
            Some("v") => {
                seen += 1;
                positions.push('v');
                let mut count = 0;
                for word in words.take(3).take_while(|word| word.parse::<f64>().is_ok()) {
                    positions.extend([" ", word]);
                    count += 1;
                }
                if count < 3 {
                    return Err(bad_line(number, "v and three numbers", line));
                }
                positions.push('\n');
            }
            Some("f") => {
                faces.push('f');
                let corners = words.clone().count();
                if corners == 0 {
                    return Err(bad_line(number, "f and vertex indices", line));
                }
                skipped += usize::from(corners < 3);
                for word in words {
                    let index = word.split('/').next().unwrap_or_default();
                    let vertex = vertex(number, line, index, seen, vertices)?;
                    // Writing to a string cannot fail.
                    let _ = write!(faces, " {vertex}");
                }
                faces.push('\n');
            }
            Some("o" | "g") => faces.extend([line.trim_start(), "\n"]),
            Some("p" | "l") => skipped += 1,
            _ => {}
        }
    }
    Ok((positions + &faces, skipped))
}

/// Returns the statements of a text with the numbers of their first lines. A vertex or face whose
/// line ends with a backslash continues on the next one.
fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = (1..).zip(text.lines());
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut statement = Cow::Borrowed(first);
        let is_joined = matches!(first.split_whitespace().next(), Some("v" | "f"));
        let continued = |line: &str| line.trim_end().strip_suffix('\\').map(str::len);
        while let Some(end) = continued(&statement).filter(|_| is_joined) {
            let statement = statement.to_mut();
            statement.truncate(end);
            statement.extend([" ", lines.next().map_or("", |(_, line)| line)]);
        }
        Some((number, statement))
    })
}

/// Returns the vertex of a face on line `number`, from 1: `index` is at most `vertices`, or from −1
/// back to −`seen`.
fn vertex(
    number: usize,
    line: &str,
    index: &str,
    seen: usize,
    vertices: usize,
) -> Result<usize, InputError> {
    let index: i64 = index.parse().map_err(|_| bad_line(number, "f and vertex indices", line))?;
    let limit = if index < 0 { seen } else { vertices };
    let distance = index.unsigned_abs() as usize;
    if index == 0 || distance > limit {
        return Err(InputError::new(format!(
            "line {number}: vertex {index} of a face is out of range: there are {limit} vertices"
        )));
    }
    Ok(if index < 0 { seen + 1 - distance } else { distance })
}
