//! Sample glTF of a tetrahedron, with embedded data and as a binary container.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Corners of a tetrahedron of volume 1/6: the origin and 1 on each axis.
pub const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
pub const FACES: [u8; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];

pub fn floats(values: &[[f32; 3]]) -> Vec<u8> {
    values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect()
}

/// Positions in view 0 and accessor 0, one-byte indices in view 1 and accessor 1.
pub fn tetrahedron() -> (Value, Vec<u8>) {
    let bytes = [floats(&CORNERS), FACES.to_vec()].concat();
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"name": "tetra", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12}
        ],
        "buffers": [{"byteLength": 60}]
    });
    (document, bytes)
}

/// Returns the document as a binary container.
pub fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 12 + 8 + text.len() + 8 + binary.len();
    let word = |value: usize| (value as u32).to_le_bytes();
    [
        &b"glTF"[..],
        &word(2),
        &word(length),
        &word(text.len()),
        b"JSON",
        &text,
        &word(binary.len()),
        b"BIN\0",
        &binary,
    ]
    .concat()
}

/// Returns a document with embedded data.
pub fn with_data_uri(mut document: Value, binary: &[u8]) -> Vec<u8> {
    let data = STANDARD.encode(binary);
    document["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{data}"));
    document.to_string().into_bytes()
}
