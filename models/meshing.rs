//! Closed triangle meshes of analytic surfaces, and their files.

use anyhow::{Context, Result};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use nalgebra::{Point3, Vector3};
use ndshape::{RuntimeShape, Shape};
use palpate::geometry::implicit::ImplicitSolid;
use serde_json::json;
use std::collections::HashMap;

/// Closed triangle mesh, metres, wound counterclockwise as seen from outside.
pub struct Mesh {
    pub vertices: Vec<Point3<f64>>,
    pub triangles: Vec<[usize; 3]>,
}

/// Returns the surface as triangles: surface nets on a grid of cells, projected onto the surface.
pub fn nets(surface: &dyn ImplicitSolid, cell_m: f64) -> Result<Mesh> {
    // A cell of air on every side, so that the mesh closes.
    let [low, high] = surface.bounds();
    let low = low.map(|x| x - cell_m);
    let size = (high - low).map(|x| (x / cell_m).ceil() as u32 + 2);
    let shape = RuntimeShape::<u32, 3>::new(size.into());
    let values: Vec<f32> = (0..shape.size())
        .map(|index| {
            let [x, y, z] = shape.delinearize(index).map(f64::from);
            surface.value(low + Vector3::new(x, y, z) * cell_m) as f32
        })
        .collect();
    let mut buffer = SurfaceNetsBuffer::default();
    surface_nets(&values, &shape, [0; 3], size.map(|n| n - 1).into(), &mut buffer);

    let vertices = buffer
        .positions
        .iter()
        .map(|p| project(surface, low + Vector3::from(p.map(f64::from)) * cell_m))
        .collect::<Result<Vec<_>>>()?;
    let triangles = buffer.indices.as_chunks().0.iter().map(|t: &[u32; 3]| t.map(|i| i as usize));
    Ok(welded(vertices, triangles.collect()))
}

/// Joins vertices that coincide in single precision, and leaves out the triangles that vanish.
fn welded(vertices: Vec<Point3<f64>>, mut triangles: Vec<[usize; 3]>) -> Mesh {
    let bits = |p: &Point3<f64>| [p.x, p.y, p.z].map(|x| (x as f32 + 0.0).to_bits());
    let mut first = HashMap::new();
    let joined: Vec<usize> =
        vertices.iter().enumerate().map(|(i, p)| *first.entry(bits(p)).or_insert(i)).collect();
    triangles.iter_mut().for_each(|corners| *corners = corners.map(|i| joined[i]));
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    Mesh { vertices, triangles }
}

pub fn project(surface: &dyn ImplicitSolid, p: Point3<f64>) -> Result<Point3<f64>> {
    surface.project(p).with_context(|| format!("{p} does not project onto the surface"))
}

/// Formats binary glTF 2.0 (Khronos Group 2021, glTF 2.0 specification, section 4.4). The vertices
/// are in the object's own frame, z up, front +y; the node's matrix turns them to glTF's +y up, +z
/// front.
pub fn glb(mesh: &Mesh, name: &str, (material, colour): (&str, [f64; 3])) -> Result<Vec<u8>> {
    let vertices: Vec<[f32; 3]> =
        mesh.vertices.iter().map(|v| [v.x as f32, v.y as f32, v.z as f32]).collect();
    let mut binary: Vec<u8> =
        vertices.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let indices_start = binary.len();
    for &index in mesh.triangles.as_flattened() {
        binary.extend(u32::try_from(index)?.to_le_bytes());
    }
    let extreme = |pick: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|axis| vertices.iter().map(|v| v[axis]).reduce(pick))
    };
    // Component types 5126 and 5125 are f32 and u32; targets 34962 and 34963 vertices and indices.
    let document = json!({
        "asset": { "version": "2.0", "generator": "models/make_models.rs of Palpate" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{
            "name": name,
            "mesh": 0,
            // By columns: (x, y, z) of the object is (-x, z, y) of glTF.
            "matrix": [-1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1],
        }],
        "meshes": [{
            "name": name,
            "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }],
        }],
        "materials": [{
            "name": material,
            "pbrMetallicRoughness": {
                "baseColorFactor": [colour[0], colour[1], colour[2], 1.0], "metallicFactor": 0, "roughnessFactor": 0.3,
            },
        }],
        "accessors": [
            {
                "bufferView": 0, "componentType": 5126, "type": "VEC3",
                "count": vertices.len(), "min": extreme(f32::min), "max": extreme(f32::max),
            },
            {
                "bufferView": 1, "componentType": 5125, "type": "SCALAR",
                "count": 3 * mesh.triangles.len(),
            },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": indices_start, "target": 34962 },
            {
                "buffer": 0, "byteOffset": indices_start,
                "byteLength": binary.len() - indices_start, "target": 34963,
            },
        ],
        "buffers": [{ "byteLength": binary.len() }],
    });
    let mut text = serde_json::to_vec(&document)?;
    // Chunks are padded to four bytes; the binary one already is.
    text.resize(text.len().next_multiple_of(4), b' ');

    let total = 12 + 8 + text.len() + 8 + binary.len();
    let mut file = b"glTF".to_vec();
    file.extend(2_u32.to_le_bytes());
    file.extend(u32::try_from(total)?.to_le_bytes());
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", binary)] {
        file.extend(u32::try_from(chunk.len())?.to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    Ok(file)
}
