//! Tests of the pose in which glTF stores a model: instances, morph targets, skins, quantized
//! positions, hidden nodes and levels of detail; and of extensions that are not supported.

use super::gltf_sample::{CORNERS, floats, glb, tetrahedron};
use super::import::{Outcome, changed, import_bytes, is_tetrahedron, refused};
use palpate_geometry::import::{import, import_in_file_frame};
use serde_json::{Value, json};

/// Component types of accessors.
const BYTE: u32 = 5120;
const UBYTE: u32 = 5121;
const SHORT: u32 = 5122;
const FLOAT: u32 = 5126;

/// Appends an accessor over new bytes; returns its index.
fn add(
    document: &mut Value,
    bytes: &mut Vec<u8>,
    data: &[u8],
    (component, count, kind): (u32, usize, &str),
) -> usize {
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let views = document["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": data.len()}));
    let view = views.len() - 1;
    bytes.extend(data);
    document["buffers"][0]["byteLength"] = json!(bytes.len());
    let accessors = document["accessors"].as_array_mut().unwrap();
    accessors.push(
        json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
    );
    accessors.len() - 1
}

fn add_vectors(document: &mut Value, bytes: &mut Vec<u8>, vectors: &[[f32; 3]]) -> usize {
    add(document, bytes, &floats(vectors), (FLOAT, vectors.len(), "VEC3"))
}

#[track_caller]
fn has_volume(outcome: Outcome, expected_m3: f64) {
    let (mesh, report) = outcome.unwrap();
    assert!(report.is_closed() && report.flipped.count == 0, "{report}");
    assert!((mesh.volume_m3() / expected_m3 - 1.0).abs() < 1e-6, "{report}");
}

/// Gives node 0 instances with the given attributes.
fn instanced(attributes: &dyn Fn(&mut Value, &mut Vec<u8>) -> Value) -> Outcome {
    changed(|document, bytes| {
        let attributes = attributes(document, bytes);
        document["nodes"][0]["extensions"] =
            json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
        document["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    })
}

#[test]
fn instances_are_placed() {
    let moved = |document: &mut Value, bytes: &mut Vec<u8>| {
        let moves = [[0.0; 3], [3.0, 0.0, 0.0], [8.0, 0.0, 0.0]];
        json!({"TRANSLATION": add_vectors(document, bytes, &moves), "_ID": 99})
    };
    let outcome = instanced(&moved);
    assert!((outcome.as_ref().unwrap().1.size_mm().x - 9000.0).abs() < 1e-3);
    is_tetrahedron(outcome, 3);
    let scaled = instanced(&|document, bytes| {
        let scales = [[1.0; 3], [2.0; 3], [-1.0, 1.0, 3.0]];
        let mut attributes = moved(document, bytes);
        attributes["SCALE"] = json!(add_vectors(document, bytes, &scales));
        attributes
    });
    has_volume(scaled, (1.0 + 8.0 + 3.0) / 6.0);
    // Half a turn about z, in floats and in normalized integers.
    for (component, quaternion) in [
        (FLOAT, [0.0f32, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat()),
        (BYTE, vec![0, 0, 127, 0]),
        (SHORT, [0i16, 0, 32767, 0].map(i16::to_le_bytes).concat()),
    ] {
        let (mesh, _) = instanced(&|document, bytes| {
            document["nodes"][0]["translation"] = json!([10, 0, 0]);
            let rotation = add(document, bytes, &quaternion, (component, 1, "VEC4"));
            document["accessors"][rotation]["normalized"] = json!(component != FLOAT);
            json!({"ROTATION": rotation})
        })
        .unwrap();
        // The corner (1, 0, 0) moves to (-1, 0, 0), then to (9, 0, 0); the format's x becomes -x.
        let (low, high) = mesh.bounds();
        assert!((low.x + 10.0).abs() < 1e-6 && (high.x + 9.0).abs() < 1e-6, "{low} {high}");
    }
    is_tetrahedron(instanced(&|_, _| json!({})), 1);
    let counts = instanced(&|document, bytes| {
        let mut attributes = moved(document, bytes);
        attributes["SCALE"] = json!(add_vectors(document, bytes, &[[1.0; 3]]));
        attributes
    });
    refused("counts", counts, "\"EXT_mesh_gpu_instancing\" of node 0 has attributes of different");
    let word = instanced(&|_, _| json!({"SCALE": "two"}));
    refused("a word", word, "has an attribute that is no index of an accessor");
    refused("missing", instanced(&|_, _| json!({"SCALE": 77})), "accessor 77 does not exist");
}

/// Gives the tetrahedron a target that raises corner 3 by 1, and one that does so by 3.
fn morphed(change: &dyn Fn(&mut Value)) -> Outcome {
    changed(|document, bytes| {
        let targets = [1.0, 3.0].map(|height| {
            let moves = [[0.0; 3], [0.0; 3], [0.0; 3], [0.0, 0.0, height]];
            json!({"POSITION": add_vectors(document, bytes, &moves)})
        });
        document["meshes"][0]["primitives"][0]["targets"] = json!(targets);
        change(document);
    })
}

#[test]
fn morph_targets_are_applied_with_the_weights_of_the_file() {
    // The volume is a sixth of the height of corner 3.
    has_volume(morphed(&|_| ()), 1.0 / 6.0);
    has_volume(morphed(&|document| document["meshes"][0]["weights"] = json!([0, 0])), 1.0 / 6.0);
    has_volume(morphed(&|document| document["meshes"][0]["weights"] = json!([1, 0])), 2.0 / 6.0);
    has_volume(morphed(&|document| document["meshes"][0]["weights"] = json!([0.5, 0.5])), 0.5);
    let node = morphed(&|document| {
        document["meshes"][0]["weights"] = json!([1, 1]);
        document["nodes"][0]["weights"] = json!([0, -0.25]);
    });
    has_volume(node, 0.25 / 6.0);
    let shorter = morphed(&|document| {
        document["accessors"][3]["count"] = json!(3);
        document["meshes"][0]["weights"] = json!([0, 1]);
    });
    refused("shorter", shorter, "has 4 vertices and a morph target of 3");
}

#[test]
fn morph_targets_may_be_sparse() {
    let outcome = changed(|document, bytes| {
        let place = add(document, bytes, &[3], (UBYTE, 1, "SCALAR"));
        let step = add_vectors(document, bytes, &[[0.0, 0.0, 1.0]]);
        let view = |accessor: usize| document["accessors"][accessor]["bufferView"].clone();
        let sparse = json!({
            "componentType": FLOAT, "count": 4, "type": "VEC3",
            "sparse": {
                "count": 1,
                "indices": {"bufferView": view(place), "componentType": UBYTE},
                "values": {"bufferView": view(step)}
            }
        });
        document["accessors"].as_array_mut().unwrap().push(sparse);
        document["meshes"][0]["weights"] = json!([1]);
        document["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": step + 1}]);
    });
    has_volume(outcome, 2.0 / 6.0);
}

/// Skins the tetrahedron: corners 0 to 2 on joint 0 at the origin, corner 3 on both with the given
/// weights. Joint 1 is bound at height 1 and stands at height 2.
fn skinned(weights: [u8; 2], change: &dyn Fn(&mut Value)) -> Outcome {
    changed(|document, bytes| {
        let joints = [0, 1, 0, 0].repeat(4);
        let joints = add(document, bytes, &joints, (UBYTE, 4, "VEC4"));
        let mut shares = [255, 0, 0, 0].repeat(4);
        shares[12..14].copy_from_slice(&weights);
        let weights = add(document, bytes, &shares, (UBYTE, 4, "VEC4"));
        document["accessors"][weights]["normalized"] = json!(true);
        let bind =
            |z: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, z, 1.0];
        let binds = [bind(0.0), bind(-1.0)].concat();
        let binds: Vec<u8> = binds.iter().flat_map(|x| x.to_le_bytes()).collect();
        let binds = add(document, bytes, &binds, (FLOAT, 2, "MAT4"));
        let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_0"] = json!(joints);
        attributes["WEIGHTS_0"] = json!(weights);
        document["scenes"][0]["nodes"] = json!([0, 1]);
        document["nodes"] = json!([
            {"mesh": 0, "skin": 0, "translation": [50, 60, 70], "scale": [-3, 3, 3]},
            {"children": [2]},
            {"translation": [0, 0, 2]}
        ]);
        document["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": binds}]);
        change(document);
    })
}

#[test]
fn skins_stand_in_the_pose_of_their_joints() {
    // Corner 3 stands at height 2, or in the middle; the pose of its own node does not count.
    has_volume(skinned([0, 255], &|_| ()), 2.0 / 6.0);
    has_volume(skinned([255, 0], &|_| ()), 1.0 / 6.0);
    has_volume(skinned([51, 204], &|_| ()), 1.8 / 6.0);
    // Weights whose sum is not 1 are normalized.
    has_volume(skinned([50, 50], &|_| ()), 1.5 / 6.0);
    let (mesh, _) = skinned([0, 255], &|_| ()).unwrap();
    // The format's z becomes y.
    assert!((mesh.bounds().1.y - 2.0).abs() < 1e-6 && mesh.bounds().0.z.abs() < 1e-6);
    let above = |document: &mut Value| document["nodes"][1]["scale"] = json!([2, 2, 2]);
    has_volume(skinned([255, 0], &above), 8.0 / 6.0);
    let mirrored = |document: &mut Value| document["nodes"][1]["scale"] = json!([-1, 1, 1]);
    has_volume(skinned([255, 0], &mirrored), 1.0 / 6.0);
    let unbound = |document: &mut Value| {
        document["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
    };
    has_volume(skinned([0, 255], &unbound), 3.0 / 6.0);
    refused("no weight", skinned([0, 0], &|_| ()), "joint weights of its vertex 3 sum to 0");
    type Change = fn(&mut Value);
    let cases: [(&str, Change, &str); 5] = [
        (
            "one joint",
            |document| document["skins"][0]["joints"] = json!([1]),
            "at node 0 refers to joint 1 of 1",
        ),
        (
            "joint elsewhere",
            |document| document["nodes"][1]["children"] = json!([]),
            "skin 0: joint 1 is outside the scene",
        ),
        (
            "no joints of vertices",
            |document| {
                document["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 0});
            },
            "has a skin, but not JOINTS_0 and WEIGHTS_0",
        ),
        (
            "one matrix",
            |document| document["accessors"][4]["count"] = json!(1),
            "skin 0 has 2 joints and 1 inverse bind matrices",
        ),
        (
            "instances",
            |document| {
                document["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {}});
            },
            "has a skin and \"EXT_mesh_gpu_instancing\"",
        ),
    ];
    for (case, change, says) in cases {
        refused(case, skinned([0, 255], &change), says);
    }
}

/// Replaces the positions by integers, with a node that scales them to 1.
fn quantized(component: u32, is_normalized: bool, corner: &[u8], scale: f64) -> Outcome {
    changed(|document, bytes| {
        let width = corner.len();
        let mut data = vec![0; 4 * 4 * width];
        // Corner i lies on axis i - 1; each element takes four components.
        (0..3).for_each(|axis| {
            let start = ((axis + 1) * 4 + axis) * width;
            data[start..start + width].copy_from_slice(corner);
        });
        let positions = add(document, bytes, &data, (component, 4, "VEC3"));
        let view = document["accessors"][positions]["bufferView"].as_u64().unwrap() as usize;
        document["bufferViews"][view]["byteStride"] = json!(4 * width);
        document["accessors"][positions]["normalized"] = json!(is_normalized);
        document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
        document["nodes"][0]["scale"] = json!([scale, scale, scale]);
        document["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        document["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    })
}

#[test]
fn quantized_positions_are_decoded() {
    has_volume(quantized(UBYTE, false, &[200], 1.0 / 200.0), 1.0 / 6.0);
    has_volume(quantized(UBYTE, true, &[255], 1.0), 1.0 / 6.0);
    has_volume(quantized(BYTE, true, &[127], 1.0), 1.0 / 6.0);
    has_volume(quantized(SHORT, false, &500i16.to_le_bytes(), 2e-3), 1.0 / 6.0);
    has_volume(quantized(SHORT, true, &16384i16.to_le_bytes(), 32767.0 / 16384.0), 1.0 / 6.0);
    has_volume(quantized(5123, true, &[255, 255], 1.0), 1.0 / 6.0);
    let words = "must hold VEC3 of floats, bytes or shorts";
    refused("wide", quantized(5125, false, &[1, 0, 0, 0], 1.0), words);
}

#[test]
fn extensions_that_hide_data_are_named() {
    let draco = json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}});
    let with_fallback = changed(|document, _| {
        document["meshes"][0]["primitives"][0]["extensions"] = draco.clone();
        document["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    });
    is_tetrahedron(with_fallback, 1);
    for accessor in [0, 1] {
        let without = changed(|document, _| {
            document["meshes"][0]["primitives"][0]["extensions"] = draco.clone();
            document["accessors"][accessor].as_object_mut().unwrap().remove("bufferView");
        });
        let says = "has no data: the extension \"KHR_draco_mesh_compression\" is not supported";
        refused("draco", without, says);
    }
    let meshopt = changed(|document, _| {
        document["buffers"].as_array_mut().unwrap().push(
            json!({"byteLength": 60, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}),
        );
    });
    let says = "buffer 1: has no data: the extension \"EXT_meshopt_compression\" is not supported";
    refused("meshopt", meshopt, says);
    let required = changed(|document, _| {
        document["extensionsRequired"] =
            json!(["KHR_mesh_quantization", "EXT_meshopt_compression"]);
    });
    refused("required", required, "needs the extension \"EXT_meshopt_compression\"");
}

#[test]
fn hidden_nodes_and_coarser_levels_are_left_out() {
    let hidden = changed(|document, _| {
        document["nodes"] = json!([
            {"mesh": 0, "children": [1]},
            {"children": [2], "extensions": {"KHR_node_visibility": {"visible": false}}},
            {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true}}}
        ]);
    });
    is_tetrahedron(hidden, 1);
    let levels = changed(|document, _| {
        document.as_object_mut().unwrap().remove("scene");
        document["nodes"] = json!([
            {"mesh": 0, "extensions": {"MSFT_lod": {"ids": [1]}}},
            {"mesh": 0, "translation": [5, 0, 0]}
        ]);
    });
    is_tetrahedron(levels, 1);
}

/// Animations, materials and cameras do not matter, nor do scenes without nodes.
#[test]
fn parts_without_geometry_may_lack_properties() {
    let outcome = changed(|document, _| {
        document["animations"] = json!([{
            "channels": [{"sampler": 0, "target": {"path": "pointer"}}],
            "samplers": [{"input": 0, "output": 0}]
        }]);
        document["cameras"] = json!([{}]);
        document["materials"] = json!([{"alphaMode": 7}]);
        document["scenes"].as_array_mut().unwrap().push(json!({"name": "empty"}));
    });
    is_tetrahedron(outcome, 1);
    let broken = changed(|document, _| {
        document["cameras"] = json!([{}]);
        document["accessors"][0]["count"] = json!("four");
    });
    refused("an accessor", broken, "JSON: line 1, column ");
}

#[test]
fn other_versions_are_named() {
    let old = json!({"asset": {"version": "1.0"}, "buffers": {"a": {}}, "meshes": {"b": {}}});
    let says = "is glTF of version 1.0; supported is 2.0";
    refused("text", import_bytes("mesh.gltf", old.to_string().as_bytes()), says);
    let (document, bytes) = tetrahedron();
    let mut container = glb(&document, &bytes);
    container[4] = 1;
    refused("binary", import_bytes("mesh.glb", &container), "is glTF of version 1; supported");
}

#[test]
fn the_frame_is_upright_or_that_of_the_file() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("mesh.glb");
    let (document, mut bytes) = tetrahedron();
    let corners = CORNERS.map(|[x, y, z]| [x, 2.0 * y, 3.0 * z]);
    bytes.splice(..48, floats(&corners));
    std::fs::write(&path, glb(&document, &bytes)).unwrap();
    let (mesh, report) = import_in_file_frame(&path, 1e-3).unwrap();
    let (low, high) = mesh.bounds();
    assert!(low.coords.amax() < 1e-12 && report.flipped.count == 0);
    assert!((high - nalgebra::Point3::new(1e-3, 2e-3, 3e-3)).norm() < 1e-9, "{high}");
    let (low, high) = import(&path, 1e-3).unwrap().0.bounds();
    assert!((low - nalgebra::Point3::new(-1e-3, 0.0, 0.0)).norm() < 1e-9, "{low}");
    assert!((high - nalgebra::Point3::new(0.0, 3e-3, 2e-3)).norm() < 1e-9, "{high}");
}
