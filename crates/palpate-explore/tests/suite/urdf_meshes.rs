//! Tests of the meshes that a URDF names.

use std::fs;
use std::path::Path;

use palpate_explore::robot::arm::{ArmSettings, LinkCapsule};

/// Corners of a bar along x, m, and its triangles, over which the corners appear in this order.
const CORNERS: [[f32; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [0.5, 0.0, 0.0],
    [0.5, 0.0625, 0.0],
    [0.0, 0.0625, 0.0],
    [0.0, 0.0, 0.125],
    [0.5, 0.0, 0.125],
    [0.5, 0.0625, 0.125],
    [0.0, 0.0625, 0.125],
];
#[rustfmt::skip]
const TRIANGLES: [[u8; 3]; 12] = [
    [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
    [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7],
];

fn obj() -> String {
    let vertex = |[x, y, z]: [f32; 3]| format!("v {x} {y} {z}\n");
    let face = |[a, b, c]: [u8; 3]| format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    CORNERS.map(vertex).concat() + &TRIANGLES.map(face).concat()
}

/// Returns a glTF document and its buffer.
fn gltf() -> (&'static str, Vec<u8>) {
    let document = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 36, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 36}],
        "buffers": [{"byteLength": 132, "uri": "bar.bin"}]}"#;
    let mut bytes: Vec<u8> = CORNERS.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(TRIANGLES.as_flattened());
    (document, bytes)
}

/// Returns the capsules of an arm of one link, whose shape is a mesh file.
fn capsules(folder: &Path, mesh: &str) -> Vec<LinkCapsule> {
    let text = format!(
        r#"<robot name="bar"><link name="root"/><link name="link">
        <collision><geometry><mesh filename="{mesh}" scale="1 2 0.5"/></geometry></collision></link>
        <joint name="joint" type="revolute"><parent link="root"/><child link="link"/>
        <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="10" velocity="1"/></joint></robot>"#
    );
    let file = folder.join("bar.urdf");
    fs::write(&file, text).unwrap();
    let model = file.to_str().unwrap().to_owned();
    let settings = ArmSettings { model, home_deg: Some(vec![0.0]), ..ArmSettings::default() };
    settings.model().unwrap().0.capsules()
}

/// A glTF mesh keeps the frame of its file, in which the URDF places and scales it: its capsule is
/// that of the same mesh as OBJ.
#[test]
fn gltf_meshes_keep_the_frame_of_their_file() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("urdf_meshes");
    fs::create_dir_all(&folder).unwrap();
    let (document, bytes) = gltf();
    fs::write(folder.join("bar.obj"), obj()).unwrap();
    fs::write(folder.join("bar.gltf"), document).unwrap();
    fs::write(folder.join("bar.bin"), bytes).unwrap();
    let [expected, found] = ["bar.obj", "bar.gltf"].map(|mesh| capsules(&folder, mesh));
    assert!(expected.len() == 1 && found.len() == 1, "{found:?}");
    for (expected, found) in expected.iter().zip(&found) {
        assert!((expected.radius_m - found.radius_m).abs() < 1e-9, "{found:?} {expected:?}");
        for (a, b) in expected.ends.iter().zip(&found.ends) {
            assert!((a - b).norm() < 1e-9, "{found:?} {expected:?}");
        }
        // The bar points along +x.
        let middle = nalgebra::center(&found.ends[0], &found.ends[1]);
        assert!((middle.x - 0.25).abs() < 0.02, "{found:?}");
    }
}
