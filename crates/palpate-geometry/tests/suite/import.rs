//! Tests of mesh import: every accepted variant, and a table of invalid files that must be refused.

use std::fs;
use std::path::{Path, PathBuf};

use super::gltf_sample::{CORNERS, FACES, floats, glb, tetrahedron, with_data_uri};
use palpate_geometry::mesh::Mesh;
use palpate_geometry::report::MeshReport;
use palpate_input::error::InputError;
use serde_json::{Value, json};
use tempfile::TempDir;

pub type Outcome = Result<(Mesh, MeshReport), InputError>;

/// Imports a file; checks that an error names the file.
fn import(path: &Path, metres_per_unit: f64) -> Outcome {
    let outcome = palpate_geometry::import::import(path, metres_per_unit);
    if let Err(error) = &outcome {
        let text = error.to_string();
        assert!(text.starts_with(path.to_str().unwrap()), "no path in \"{text}\"");
    }
    outcome
}

fn write(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    (folder, path)
}

pub fn import_bytes(name: &str, bytes: &[u8]) -> Outcome {
    let (_folder, path) = write(name, bytes);
    import(&path, 1.0)
}

#[track_caller]
pub fn refused(case: &str, outcome: Outcome, says: &str) {
    let text = outcome.expect_err(case).to_string();
    assert!(text.contains(says), "{case}: \"{text}\" does not say \"{says}\"");
}

#[track_caller]
pub fn is_tetrahedron(outcome: Outcome, count: usize) -> MeshReport {
    let (mesh, report) = outcome.unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (4 * count, 4 * count), "{report}");
    assert!(report.is_closed(), "{report}");
    assert!((mesh.volume_m3() - count as f64 / 6.0).abs() < 1e-6, "{report}");
    report
}

/// Imports the tetrahedron after a change of its document and its bytes.
pub fn changed(change: impl Fn(&mut Value, &mut Vec<u8>)) -> Outcome {
    let (mut document, mut bytes) = tetrahedron();
    change(&mut document, &mut bytes);
    import_bytes("mesh.glb", &glb(&document, &bytes))
}

#[test]
fn gltf_buffers_come_from_chunk_data_uri_or_file() {
    let (mut document, bytes) = tetrahedron();
    is_tetrahedron(import_bytes("mesh.glb", &glb(&document, &bytes)), 1);
    is_tetrahedron(import_bytes("mesh.GLTF", &with_data_uri(document.clone(), &bytes)), 1);
    document["buffers"][0]["uri"] = json!("the%20data.bin");
    let (folder, path) = write("mesh.gltf", document.to_string().as_bytes());
    fs::write(folder.path().join("the data.bin"), &bytes).unwrap();
    is_tetrahedron(import(&path, 1.0), 1);
}

#[test]
fn gltf_scale_multiplies() {
    let (document, bytes) = tetrahedron();
    let (_folder, path) = write("mesh.glb", &glb(&document, &bytes));
    let (mesh, report) = import(&path, 1e-3).unwrap();
    assert!((mesh.volume_m3() - 1e-9 / 6.0).abs() < 1e-15);
    assert!((report.size_mm().x - 1.0).abs() < 1e-12);
}

#[test]
fn gltf_indices_of_every_width_or_none() {
    for (component, width) in [(5121, 1), (5123, 2), (5125, 4)] {
        let outcome = changed(|document, bytes| {
            bytes.truncate(48);
            bytes.extend(FACES.iter().flat_map(|&i| u32::from(i).to_le_bytes()[..width].to_vec()));
            document["accessors"][1]["componentType"] = json!(component);
            document["bufferViews"][1]["byteLength"] = json!(12 * width);
            document["buffers"][0]["byteLength"] = json!(bytes.len());
        });
        is_tetrahedron(outcome, 1);
    }
    let outcome = changed(|document, bytes| {
        *bytes = floats(&FACES.map(|i| CORNERS[usize::from(i)]));
        document["buffers"][0]["byteLength"] = json!(bytes.len());
        document["bufferViews"] = json!([{"buffer": 0, "byteLength": bytes.len()}]);
        document["accessors"][0]["count"] = json!(12);
        document["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    });
    assert_eq!(is_tetrahedron(outcome, 1).welded, 8);
}

#[test]
fn gltf_strips_and_fans() {
    for (mode, indices) in [(5, vec![0, 2, 1, 3, 0, 2]), (6, vec![0, 2, 1, 3, 2])] {
        let outcome = changed(|document, bytes| {
            bytes.truncate(48);
            bytes.extend(&indices);
            document["accessors"][1]["count"] = json!(indices.len());
            document["meshes"][0]["primitives"][0]["mode"] = json!(mode);
            document["bufferViews"][1]["byteLength"] = json!(indices.len());
            document["buffers"][0]["byteLength"] = json!(bytes.len());
        });
        let (mesh, report) = outcome.unwrap();
        assert_eq!(report.flipped.count, 0, "{report}");
        assert_eq!(mesh.triangles().len(), indices.len() - 2);
    }
}

#[test]
fn gltf_interleaved_positions() {
    let outcome = changed(|document, bytes| {
        *bytes = [7u8; 4].to_vec();
        for corner in CORNERS {
            bytes.extend(floats(&[corner, [9.0; 3]]));
        }
        bytes.truncate(4 + 3 * 24 + 12);
        bytes.extend(FACES);
        document["bufferViews"] = json!([
            {"buffer": 0, "byteLength": 88, "byteStride": 24},
            {"buffer": 0, "byteOffset": 88, "byteLength": 12}
        ]);
        document["accessors"][0]["byteOffset"] = json!(4);
        document["buffers"][0]["byteLength"] = json!(100);
    });
    is_tetrahedron(outcome, 1);
}

#[test]
fn gltf_sparse_positions() {
    for base in [true, false] {
        let outcome = changed(|document, bytes| {
            // Corner 3 moves to height 2; without a base, the zeros are replaced by corners 1 to 3.
            let places: &[u8] = if base { &[3] } else { &[1, 2, 3] };
            let news = [CORNERS[1], CORNERS[2], [0.0, 0.0, 2.0]];
            let start = bytes.len();
            bytes.extend(places);
            bytes.resize(start + 4, 0);
            bytes.extend(floats(&news[3 - places.len()..]));
            document["buffers"][0]["byteLength"] = json!(bytes.len());
            let views = document["bufferViews"].as_array_mut().unwrap();
            views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": 4}));
            views.push(json!({"buffer": 0, "byteOffset": start + 4, "byteLength": bytes.len() - start - 4}));
            document["accessors"][0]["sparse"] = json!({
                "count": places.len(),
                "indices": {"bufferView": 2, "componentType": 5121},
                "values": {"bufferView": 3}
            });
            if !base {
                document["accessors"][0].as_object_mut().unwrap().remove("bufferView");
            }
        });
        let (mesh, report) = outcome.unwrap();
        assert!((mesh.volume_m3() - 1.0 / 3.0).abs() < 1e-6, "{report}");
    }
}

#[test]
fn gltf_nodes_nest_and_share_meshes() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let outcome = changed(|document, _| {
        document["scenes"][0]["nodes"] = json!([0, 2]);
        document["nodes"] = json!([
            {"translation": [10, 0, 0], "children": [1], "mesh": 0},
            {"rotation": [0, 0, half, half], "translation": [0, 5, 0], "scale": [2, 1, 1], "mesh": 0},
            {"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, -7,0,0,1], "mesh": 0},
            {"mesh": 0, "name": "outside the scene"}
        ]);
    });
    let (mesh, report) = outcome.unwrap();
    assert_eq!(report.components, 3);
    // Scaled by 2 along x, rotated so that x points along y, moved by 5 and then by 10.
    assert!((mesh.volume_m3() - 4.0 / 6.0).abs() < 1e-6);
    // The format's x becomes -x, its y (up) z, its z (front) y.
    let (low, high) = mesh.bounds();
    assert!((high.x - 7.0).abs() < 1e-6 && (low.x + 11.0).abs() < 1e-6);
    assert!((high.z - 7.0).abs() < 1e-6, "{high}");
    assert!(low.y.abs() < 1e-6 && (high.y - 1.0).abs() < 1e-6);
}

#[test]
fn gltf_without_a_default_scene_shows_all_roots() {
    let outcome = changed(|document, _| {
        document.as_object_mut().unwrap().remove("scene");
        document["nodes"] =
            json!([{"children": [1]}, {"mesh": 0}, {"mesh": 0, "translation": [3, 0, 0]}]);
    });
    is_tetrahedron(outcome, 2);
    let cycle = changed(|document, _| {
        document.as_object_mut().unwrap().remove("scene");
        document["nodes"] = json!([{"children": [1], "mesh": 0}, {"children": [0]}]);
    });
    refused("a cycle and no root", cycle, "nodes must form a tree");
}

#[test]
fn gltf_mirror_keeps_the_outside_outside() {
    let outcome = changed(|document, _| document["nodes"][0]["scale"] = json!([-1, 1, 1]));
    assert_eq!(is_tetrahedron(outcome, 1).flipped.count, 0);
}

#[test]
fn gltf_primitives_merge_and_points_are_skipped() {
    let outcome = changed(|document, _| {
        let primitives = document["meshes"][0]["primitives"].as_array_mut().unwrap();
        let mut points = primitives[0].clone();
        points["mode"] = json!(0);
        primitives.push(points);
        primitives.push(json!({"attributes": {"POSITION": 0}, "indices": 1, "mode": 1}));
    });
    assert_eq!(is_tetrahedron(outcome, 1).skipped_primitives, 2);
}

const TETRA_OBJ: &str = "# comment\nmtllib missing.mtl\no thing\nv 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0\n\
    v 0 0 1\nvt 0 0\nvn 0 0 1\nusemtl none\ng a\nf 1/1/1 3/1/1 2/1/1\nf 1//1 2//1 4//1\ng b\n\
    f -4 -1 -2\nf 2 3 4\nl 1 2\n";

#[test]
fn obj_objects_merge_and_close() {
    let report = is_tetrahedron(import_bytes("mesh.obj", TETRA_OBJ.as_bytes()), 1);
    assert_eq!(report.flipped.count, 0);
    is_tetrahedron(import_bytes("mesh.OBJ", TETRA_OBJ.replace('\n', "\r\n").as_bytes()), 1);
}

#[test]
fn obj_polygons_become_triangles() {
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
        f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    let (mesh, report) = import_bytes("cube.obj", cube.as_bytes()).unwrap();
    assert_eq!((report.triangles, report.components, report.is_closed()), (12, 1, true));
    assert!((mesh.volume_m3() - 1.0).abs() < 1e-12 && (mesh.area_m2() - 6.0).abs() < 1e-12);
}

#[test]
fn repair_counts_and_names_what_it_does() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv -0.0 0 0\nv 9 9 9\nv 0.5 0 0\no hull\n\
        f 1 3 2\nf 5 2 4\nf 1 3 4\nf 2 3 4\nf 2 4 3\nf 1 2 2\nf 1 7 2\n";
    let report = is_tetrahedron(import_bytes("mesh.obj", text.as_bytes()), 1);
    assert_eq!((report.triangles_before, report.welded), (7, 1));
    assert_eq!((report.degenerate_removed.count, report.duplicates_removed.count), (2, 1));
    assert_eq!((report.flipped.count, report.border_edges.count), (1, 0));
    let first = report.flipped.first.clone().unwrap();
    assert_eq!((first.part.as_str(), first.index), ("object \"hull\"", 2));
    let shown = report.to_string();
    assert!(
        shown.contains("flipped             1  (first: triangle 2 of object \"hull\")"),
        "{shown}"
    );
    assert!(
        shown.contains("1000.000 x 1000.000 x 1000.000 mm") && !shown.contains("hint"),
        "{shown}"
    );
}

#[test]
fn repair_knows_open_inverted_and_one_sided() {
    let open = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 2 0\nf 1 2 3\nf 2 3 4\nf 3 4 5\n";
    let (_, report) = import_bytes("open.obj", open.as_bytes()).unwrap();
    assert_eq!(
        (report.border_edges.count, report.flipped.count, report.is_closed()),
        (5, 1, false)
    );
    let inverted = TETRA_OBJ.replace("2 3 4", "2 4 3");
    let report = is_tetrahedron(import_bytes("inverted.obj", inverted.as_bytes()), 1);
    assert_eq!(report.flipped.count, 1);
    // Five triangles around a band with a half twist.
    let band = "v 0 0 0\nv 1 0 1\nv 2 0 0\nv 2 1 1\nv 0 1 1\nf 1 2 3\nf 2 3 4\nf 3 4 5\nf 4 5 1\nf 5 1 2\n";
    let (_, report) = import_bytes("band.obj", band.as_bytes()).unwrap();
    assert_eq!((report.unorientable, report.is_closed(), report.volume_m3), (1, false, None));
    // Two tetrahedra that share one edge are both closed.
    let touching = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nv 0 0 -1\n\
        f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 1 5 2\nf 1 2 6\nf 1 6 5\nf 2 5 6\n";
    let (mesh, report) = import_bytes("touching.obj", touching.as_bytes()).unwrap();
    assert_eq!((report.non_manifold_edges.count, report.components), (1, 2));
    assert!(report.is_closed() && (mesh.volume_m3() - 2.0 / 6.0).abs() < 1e-12, "{report}");
}

/// A face and its reverse on an edge of a closed surface are a fin, as in many scans: the surface
/// stays closed, with the same volume. Alone they are a sheet with one face.
#[test]
fn a_fin_does_not_open_a_closed_surface() {
    let fin = TETRA_OBJ.to_owned() + "v 3 3 3\nf 1 2 5\nf 2 1 5\n";
    let (plain, _) = import_bytes("plain.obj", TETRA_OBJ.as_bytes()).unwrap();
    let (mesh, report) = import_bytes("fin.obj", fin.as_bytes()).unwrap();
    assert!(report.is_closed(), "{report}");
    assert_eq!((report.border_edges.count, report.duplicates_removed.count), (0, 0));
    assert_eq!((report.non_manifold_edges.count, report.triangles), (1, 6));
    assert!((mesh.volume_m3() - plain.volume_m3()).abs() < 1e-15);
    // The same face twice is a duplicate.
    let (_, report) =
        import_bytes("twice.obj", fin.replace("f 2 1 5", "f 2 5 1").as_bytes()).unwrap();
    assert_eq!((report.duplicates_removed.count, report.is_closed()), (1, false));
    // The reverse of a face of the surface is one too.
    let doubled = TETRA_OBJ.to_owned() + "f 4 3 2\n";
    let (_, report) = import_bytes("doubled.obj", doubled.as_bytes()).unwrap();
    assert_eq!((report.duplicates_removed.count, report.is_closed()), (1, true), "{report}");
    let sheet = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 3 2 4\nf 2 1 3\nf 2 3 4\n";
    let (_, report) = import_bytes("sheet.obj", sheet.as_bytes()).unwrap();
    assert_eq!((report.triangles, report.duplicates_removed.count), (2, 2));
    assert_eq!((report.border_edges.count, report.is_closed()), (4, false));
}

#[test]
fn size_hints_at_the_unit() {
    let (_folder, path) = write("mesh.obj", TETRA_OBJ.as_bytes());
    let shown = |scale| import(&path, scale).unwrap().1.to_string();
    assert!(shown(80.0).contains("for a file in millimetres, set unit = \"mm\""));
    assert!(shown(1e-4).contains("smaller than 1 mm"));
    let error = import(&path, 1e5).unwrap_err();
    assert!(error.to_string().contains("set unit = \"mm\""), "{error}");
}

#[test]
fn broken_obj_files_are_refused() {
    let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let huge = format!("{v}f 1 2 99999999999999999999\n");
    let cases: &[(&str, &str, &str)] = &[
        ("empty file", "", "holds no triangles"),
        ("only comments", "# nothing\n\n", "holds no triangles"),
        ("vertices only", v, "holds no triangles"),
        ("points and lines only", &format!("{v}f 1\nf 1 2\nl 1 2 3\n"), "holds no triangles"),
        ("face without indices", &format!("{v}f\n"), "line 4: expected f and vertex indices"),
        ("face before any vertex", "f 1 2 3\n", "line 1: vertex 1 of a face is out of range"),
        (
            "index too large",
            &format!("{v}f 1 2 4\n"),
            "line 4: vertex 4 of a face is out of range: there are 3",
        ),
        ("index zero", &format!("{v}f 0 1 2\n"), "line 4: vertex 0"),
        ("relative index too low", &format!("{v}f -4 -2 -1\n"), "line 4: vertex -4"),
        ("relative index before its vertex", "v 0 0 0\nf -2 -1 -1\nv 1 0 0\n", "line 2: vertex -2"),
        ("least integer", &format!("{v}f -9223372036854775808 1 2\n"), "line 4: vertex -92233"),
        ("index beyond an integer", &huge, "line 4: expected f and vertex indices"),
        ("index is a word", &format!("{v}f a b c\n"), "line 4: expected f"),
        ("index is a fraction", &format!("{v}f 1.5 2 3\n"), "line 4: expected f"),
        ("index is empty", &format!("{v}f /1/1 2 3\n"), "line 4: expected f"),
        ("two coordinates", "v 0 0\n", "line 1: expected v and three numbers"),
        ("no coordinates", "v\n", "line 1: expected v"),
        ("coordinate is a word", "v 0 0 zero\n", "line 1: expected v"),
        ("comma for a point", "v 0,5 0,5 0,5\n", "line 1: expected v"),
        ("not a number", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "is not finite"),
        ("infinite", "v 0 0 inf\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "is not finite"),
        ("beyond f64", "v 0 0 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "is not finite"),
        ("ten kilometres off", "v 0 0 10001\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "set unit = \"mm\""),
        ("beyond any unit", "v 0 0 1e30\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "more than 10000 m"),
        ("one vertex thrice", &format!("{v}f 1 1 1\n"), "all 1 triangles are degenerate"),
        ("one vertex twice", &format!("{v}f 1 2 2\n"), "all 1 triangles"),
        ("all in a line", "v 0 0 0\nv 1 1 1\nv 3 3 3\nf 1 2 3\n", "all 1 triangles"),
        ("all in one place", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "all 1 triangles"),
        (
            "a line within rounding",
            "v 0.1 0.1 0.1\nv 0.2 0.2 0.2\nv 0.3 0.3 0.3\nf 1 2 3\n",
            "all 1 triangles",
        ),
        ("a face continued nowhere", &format!("{v}f 1 2 x\\"), "line 4: expected f"),
    ];
    for (case, text, says) in cases {
        refused(case, import_bytes("mesh.obj", text.as_bytes()), says);
    }
    // tobj overflows on these if it receives them.
    for word in ["1/-9/-9", "1/9/9", "1/0/0", "1/2/3/4", "1/x"] {
        let _ = import_bytes("mesh.obj", format!("{v}vt 0 0\nvn 0 0 1\nf {word} 2 3\n").as_bytes());
    }
}

#[test]
fn broken_gltf_documents_are_refused() {
    let far = 4_000_000_000u64;
    let cases: &[(&str, &str, Value, &str)] = &[
        ("no asset", "/asset", Value::Null, "JSON"),
        ("accessors are a number", "/accessors", json!(3), "JSON"),
        ("negative count", "/accessors/0/count", json!(-1), "JSON"),
        ("count is text", "/accessors/0/count", json!("4"), "JSON"),
        ("fractional index", "/nodes/0/mesh", json!(0.5), "JSON"),
        ("too many positions", "/accessors/0/count", json!(5), "accessor 0 needs 60 bytes"),
        ("billions of positions", "/accessors/0/count", json!(far), "accessor 0 needs"),
        ("count overflows", "/accessors/0/count", json!(u64::MAX), "accessor 0 needs"),
        ("no positions", "/accessors/0/count", json!(0), "but there are 0"),
        ("offset too far", "/accessors/0/byteOffset", json!(1), "accessor 0 needs 49 bytes"),
        ("offset overflows", "/accessors/0/byteOffset", json!(u64::MAX), "accessor 0 needs"),
        ("positions are bytes", "/accessors/0/componentType", json!(5121), "must hold float VEC3"),
        (
            "positions of unknown type",
            "/accessors/0/componentType",
            json!(1),
            "known component type",
        ),
        ("positions are scalars", "/accessors/0/type", json!("SCALAR"), "must hold float VEC3"),
        ("positions are matrices", "/accessors/0/type", json!("MAT4"), "must hold float VEC3"),
        ("positions of unknown shape", "/accessors/0/type", json!("VEC9"), "must hold float VEC3"),
        (
            "position view missing",
            "/accessors/0/bufferView",
            json!(7),
            "buffer view 7 does not exist",
        ),
        (
            "indices are floats",
            "/accessors/1/componentType",
            json!(5126),
            "must hold unsigned SCALAR",
        ),
        (
            "indices are signed",
            "/accessors/1/componentType",
            json!(5120),
            "must hold unsigned SCALAR",
        ),
        (
            "indices are wider",
            "/accessors/1/componentType",
            json!(5125),
            "accessor 1 needs 48 bytes",
        ),
        ("too many indices", "/accessors/1/count", json!(13), "accessor 1 needs 13 bytes"),
        (
            "fewer positions than indices",
            "/accessors/0/count",
            json!(3),
            "refers to vertex 3, but there are 3",
        ),
        (
            "indices without data",
            "/accessors/1",
            json!({"componentType": 5125, "count": far, "type": "SCALAR"}),
            "has no data: its accessors refer to none",
        ),
        (
            "view too long",
            "/bufferViews/0/byteLength",
            json!(61),
            "buffer view 0 reaches byte 61 of a buffer of 60",
        ),
        ("view too far", "/bufferViews/0/byteOffset", json!(100), "buffer view 0 reaches byte 148"),
        ("view overflows", "/bufferViews/0/byteOffset", json!(u64::MAX), "buffer view 0 reaches"),
        (
            "view length overflows",
            "/bufferViews/0/byteLength",
            json!(u64::MAX),
            "buffer view 0 reaches",
        ),
        ("view of no buffer", "/bufferViews/0/buffer", json!(2), "buffer 2 does not exist"),
        ("stride too wide", "/bufferViews/0/byteStride", json!(13), "accessor 0 needs 51 bytes"),
        ("stride overflows", "/bufferViews/0/byteStride", json!(u64::MAX), "accessor 0 needs"),
        (
            "buffer declares too much",
            "/buffers/0/byteLength",
            json!(64),
            "64 bytes declared, 60 present",
        ),
        (
            "buffer declares billions",
            "/buffers/0/byteLength",
            json!(far),
            "bytes declared, 60 present",
        ),
        (
            "two buffers, one chunk",
            "/buffers",
            json!([{"byteLength": 60}, {"byteLength": 1}]),
            "no binary chunk",
        ),
        ("no buffers", "/buffers", json!([]), "buffer 0 does not exist"),
        (
            "buffer file missing",
            "/buffers/0/uri",
            json!("nowhere.bin"),
            "nowhere.bin cannot be read",
        ),
        ("buffer file is the folder", "/buffers/0/uri", json!("."), "cannot be read"),
        (
            "buffer on the net",
            "/buffers/0/uri",
            json!("https://example.org/a.bin"),
            "neither base64 data nor",
        ),
        ("buffer is a device", "/buffers/0/uri", json!("/dev/zero"), "lies outside"),
        (
            "buffer is a device in disguise",
            "/buffers/0/uri",
            json!("../../../../../../dev/zero"),
            "lies outside",
        ),
        ("buffer with a bad escape", "/buffers/0/uri", json!("a%zz"), "neither base64 data nor"),
        ("buffer with a cut escape", "/buffers/0/uri", json!("a%"), "neither base64 data nor"),
        ("escape cuts a character", "/buffers/0/uri", json!("a%2é"), "neither base64 data nor"),
        ("data without base64", "/buffers/0/uri", json!("data:,hello"), "neither base64 data nor"),
        ("bad base64", "/buffers/0/uri", json!("data:;base64,!!!"), "base64"),
        (
            "short data",
            "/buffers/0/uri",
            json!("data:;base64,AAAA"),
            "60 bytes declared, 3 present",
        ),
        ("scene missing", "/scene", json!(3), "scene 3 does not exist"),
        ("scene node missing", "/scenes/0/nodes/0", json!(3), "node 3 does not exist"),
        ("empty scene", "/scenes/0/nodes", json!([]), "holds no triangles"),
        ("node mesh missing", "/nodes/0/mesh", json!(3), "mesh 3 does not exist"),
        ("child missing", "/nodes/0/children", json!([9]), "node 9 does not exist"),
        ("own child", "/nodes/0/children", json!([0]), "node 0 is reached twice"),
        (
            "cycle of two",
            "/nodes",
            json!([{"children": [1]}, {"children": [0]}]),
            "node 0 is reached twice",
        ),
        (
            "two parents",
            "/nodes",
            json!([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {}]),
            "node 3 is reached twice",
        ),
        ("root listed twice", "/scenes/0/nodes", json!([0, 0]), "node 0 is reached twice"),
        (
            "perspective matrix",
            "/nodes/0/matrix",
            json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1, 0, 0, 0, 1]),
            "not affine",
        ),
        ("short matrix", "/nodes/0/matrix", json!([1, 0, 0]), "JSON"),
        (
            "matrix of zeros",
            "/nodes/0/matrix",
            json!([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]),
            "all 4 triangles are degenerate",
        ),
        ("scaled to a line", "/nodes/0/scale", json!([0, 0, 1]), "all 4 triangles are degenerate"),
        ("scaled beyond f32", "/nodes/0/scale", json!([1e300, 1, 1]), "number out of range"),
        ("no rotation at all", "/nodes/0/rotation", json!([0, 0, 0, 0]), "is not finite"),
        ("moved far away", "/nodes/0/translation", json!([1e9, 0, 0]), "more than 10000 m"),
        ("no meshes", "/meshes", json!([]), "mesh 0 does not exist"),
        ("no primitives", "/meshes/0/primitives", json!([]), "holds no triangles"),
        (
            "points only",
            "/meshes/0/primitives/0/mode",
            json!(0),
            "holds no triangles (1 primitives",
        ),
        ("unknown mode", "/meshes/0/primitives/0/mode", json!(9), "has no known mode"),
        ("no attributes", "/meshes/0/primitives/0/attributes", json!({}), "has no positions"),
        (
            "position accessor missing",
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(8),
            "accessor 8 does not exist",
        ),
        (
            "index accessor missing",
            "/meshes/0/primitives/0/indices",
            json!(8),
            "accessor 8 does not exist",
        ),
        (
            "draco",
            "/extensionsRequired",
            json!(["KHR_draco_mesh_compression"]),
            "KHR_draco_mesh_compression",
        ),
        (
            "sparse out of range",
            "/accessors/0/sparse",
            sparse(1, 5121, 14),
            "replaces element 128 of 4",
        ),
        (
            "sparse indices are floats",
            "/accessors/0/sparse",
            sparse(1, 5126, 0),
            "unsigned sparse indices",
        ),
        (
            "sparse indices of unknown type",
            "/accessors/0/sparse",
            sparse(1, 7, 0),
            "unsigned sparse indices",
        ),
        ("sparse billions", "/accessors/0/sparse", sparse(far, 5121, 0), "accessor 0 needs"),
    ];
    for (case, pointer, value, says) in cases {
        let outcome = changed(|document, _| {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            let parent = document.pointer_mut(parent).unwrap();
            match key.parse::<usize>() {
                Ok(number) if parent.is_array() => parent[number] = value.clone(),
                _ => parent[key] = value.clone(),
            }
        });
        refused(case, outcome, says);
    }
}

/// Returns a sparse table that reads its indices from byte `offset` of the positions: byte 14 is
/// 128.
fn sparse(count: u64, component: u32, offset: u32) -> Value {
    json!({
        "count": count,
        "indices": {"bufferView": 0, "byteOffset": offset, "componentType": component},
        "values": {"bufferView": 0}
    })
}

#[test]
fn broken_values_in_gltf_buffers_are_refused() {
    let with_float =
        |value: f32| changed(move |_, bytes| bytes[12..16].copy_from_slice(&value.to_le_bytes()));
    let named = "vertex 1 of primitive 0 of mesh 0 \"tetra\" at node 0 is not finite";
    refused("NaN", with_float(f32::NAN), named);
    refused("infinity", with_float(f32::INFINITY), "is not finite");
    refused("largest float", with_float(f32::MAX), "more than 10000 m");
    refused("index", changed(|_, bytes| bytes[51] = 200), "triangle 1 of primitive 0");
}

#[test]
fn files_cut_or_altered_anywhere_never_panic() {
    let (document, bytes) = tetrahedron();
    let whole = glb(&document, &bytes);
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("mesh.glb");
    for length in (0..whole.len()).step_by(3) {
        fs::write(&path, &whole[..length]).unwrap();
        refused("cut", import(&path, 1.0), "");
    }
    for place in (0..whole.len()).step_by(2) {
        for change in [0x30, 0xff] {
            let mut altered = whole.clone();
            altered[place] = change;
            fs::write(&path, &altered).unwrap();
            let _ = import(&path, 1.0);
        }
    }
    let text = with_data_uri(document, &bytes);
    let path = folder.path().join("mesh.gltf");
    for length in (0..text.len()).step_by(11) {
        fs::write(&path, &text[..length]).unwrap();
        refused("cut", import(&path, 1.0), "");
    }
    let path = folder.path().join("mesh.obj");
    for length in 0..TETRA_OBJ.len() {
        fs::write(&path, &TETRA_OBJ.as_bytes()[..length]).unwrap();
        let _ = import(&path, 1.0);
    }
}

#[test]
fn files_that_are_no_mesh_files_are_refused() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    let read = |path: &Path| import(path, 1.0);
    refused("missing", read(&at("nothing.obj")), "cannot be read");
    fs::create_dir(at("folder.obj")).unwrap();
    refused("folder", read(&at("folder.obj")), "directory");
    refused("plain folder", read(folder.path()), "directory");
    for name in ["mesh.off", "mesh", "mesh.", ".obj"] {
        fs::write(at(name), TETRA_OBJ).unwrap();
        refused(name, read(&at(name)), "supported: obj, gltf, glb, stl, ply");
    }
    let junk: Vec<u8> = (0..5000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for name in ["junk.obj", "junk.gltf", "junk.glb", "junk.stl", "junk.ply"] {
        refused(name, import_bytes(name, &junk), "");
        refused(name, import_bytes(name, b""), "");
    }
    let (_folder, path) = write("mesh.obj", TETRA_OBJ.as_bytes());
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        refused("scale", import(&path, scale), "metres per unit");
    }
    refused("deep JSON", import_bytes("deep.gltf", "[".repeat(1_000_000).as_bytes()), "JSON");
    let mut header = b"glTF\x02\0\0\0".to_vec();
    header.extend(3u32.to_le_bytes());
    refused("length 3", import_bytes("short.glb", &header), "shorter than its header");
    header.truncate(8);
    header.extend(u32::MAX.to_le_bytes());
    refused("length 4 GiB", import_bytes("long.glb", &header), "binary container");
}

#[test]
fn deep_node_trees_do_not_overflow_the_stack() {
    let outcome = changed(|document, _| {
        let depth = 100_000;
        let mut nodes: Vec<Value> = (1..depth).map(|child| json!({"children": [child]})).collect();
        nodes.push(json!({"mesh": 0}));
        document["nodes"] = json!(nodes);
    });
    is_tetrahedron(outcome, 1);
}
