//! Wavefront OBJ import. Polygons become triangle fans, which is exact if they are flat and convex;
//! all objects and groups become one mesh; materials, normals, texture coordinates, colours, points
//! and lines are ignored.

use nalgebra::Point3;

use super::source::{Source, bad_line};
use crate::raw::RawMesh;
use palpate_input::error::InputError;
use palpate_input::files::without_bom;

/// Reads an OBJ file.
pub(super) fn read(source: &Source) -> Result<RawMesh, InputError> {
    let text = geometry_only(&String::from_utf8_lossy(without_bom(source.bytes)))?;
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default()))
            .map_err(|error| InputError::new(format!("OBJ: {error}")))?;
    let mut raw = RawMesh::default();
    for tobj::Model { mesh, name } in &models {
        let (positions, _) = mesh.positions.as_chunks();
        let (triangles, _) = mesh.indices.as_chunks();
        let positions = positions.iter().map(|&[x, y, z]| Point3::new(x, y, z));
        raw.add_part(format!("object \"{name}\""), positions, triangles.iter().copied())?;
    }
    Ok(raw)
}

/// Keeps objects, positions and the position indices of faces, and checks them while their line
/// numbers are known. tobj would overflow on the other indices of a face if they are out of range,
/// and its errors contain no line number.
fn geometry_only(text: &str) -> Result<String, InputError> {
    let is_vertex = |line: &&str| line.split_whitespace().next() == Some("v");
    let vertices = text.lines().filter(is_vertex).count();
    let mut kept = String::with_capacity(text.len());
    let mut seen = 0;
    for (number, line) in text.lines().enumerate() {
        let number = number + 1;
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                seen += 1;
                kept.push('v');
                let mut count = 0;
                for word in words.take(3).take_while(|word| word.parse::<f64>().is_ok()) {
                    kept.extend([" ", word]);
                    count += 1;
                }
                if count < 3 {
                    return Err(bad_line(number, "v and three numbers", line));
                }
            }
            Some("f") => {
                kept.push('f');
                if words.clone().next().is_none() {
                    return Err(bad_line(number, "f and vertex indices", line));
                }
                for word in words {
                    let index = word.split('/').next().unwrap_or_default();
                    check_index(number, line, index, seen, vertices)?;
                    kept.extend([" ", index]);
                }
            }
            Some("o" | "g") => kept.push_str(line.trim_start()),
            _ => continue,
        }
        kept.push('\n');
    }
    Ok(kept)
}

/// Checks the index of a face on line `number`: from 1 to `vertices`, or from −1 back to −`seen`.
fn check_index(
    number: usize,
    line: &str,
    index: &str,
    seen: usize,
    vertices: usize,
) -> Result<(), InputError> {
    let index: i64 = index.parse().map_err(|_| bad_line(number, "f and vertex indices", line))?;
    let limit = if index < 0 { seen } else { vertices };
    if index == 0 || index.unsigned_abs() > limit as u64 {
        return Err(InputError::new(format!(
            "line {number}: vertex {index} of a face is out of range: there are {limit} vertices"
        )));
    }
    Ok(())
}
