//! Tests of STL and PLY, binary and text: the same mesh as from OBJ, files that the program writes,
//! and malformed files.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use palpate::geometry::import::import;
use palpate::geometry::mesh::Mesh;
use tempfile::TempDir;

use crate::common::program::{fails, folder, succeeds};

#[path = "../../crates/palpate-geometry/tests/suite/gltf_sample.rs"]
mod gltf_sample;

/// A pyramid over a square: five corners, a quadrilateral and four triangles.
const CORNERS: [[f32; 3]; 5] =
    [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 1.0, 3.0]];
const FACES: [&[u8]; 5] = [&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];

fn triangles() -> Vec<[[f32; 3]; 3]> {
    let fan = |face: &&[u8]| -> Vec<[u8; 3]> {
        face[1..].windows(2).map(|pair| [face[0], pair[0], pair[1]]).collect()
    };
    FACES.iter().flat_map(fan).map(|face| face.map(|corner| CORNERS[corner as usize])).collect()
}

fn obj() -> Vec<u8> {
    let mut text = String::new();
    CORNERS.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
    for face in FACES {
        let corners: Vec<_> = face.iter().map(|corner| (corner + 1).to_string()).collect();
        writeln!(text, "f {}", corners.join(" ")).unwrap();
    }
    text.into()
}

fn stl_text(name: &str) -> String {
    let mut text = format!("solid{name}\n");
    for corners in triangles() {
        text += "  facet normal nan nan nan\n    outer loop\n";
        corners.iter().for_each(|[x, y, z]| writeln!(text, "      vertex {x:e} {y} {z}").unwrap());
        text += "    endloop\n  endfacet\n";
    }
    text + &format!("endsolid{name}\n")
}

fn stl_binary(header: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles().len() as u32).to_le_bytes());
    for corners in triangles() {
        bytes.extend([0; 12]);
        bytes.extend(corners.iter().flatten().flat_map(|number| number.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// PLY header with colours and an extra list, which are skipped.
fn ply_header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment of a test\nobj_info none\nelement vertex 5\n\
         property uchar red\nproperty float x\nproperty float y\nproperty float z\n\
         element edge 1\nproperty list uchar short ends\n\
         element face 5\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n"
    )
}

fn ply_text() -> String {
    let mut text = ply_header("ascii");
    CORNERS.iter().for_each(|[x, y, z]| writeln!(text, "255 {x} {y} {z}").unwrap());
    text += "2 0 1\n";
    for face in FACES {
        let corners: Vec<_> = face.iter().map(u8::to_string).collect();
        writeln!(text, "{} {} 0.5", face.len(), corners.join(" ")).unwrap();
    }
    text
}

fn ply_binary(is_little: bool) -> Vec<u8> {
    let turned = |mut bytes: Vec<u8>| {
        if !is_little {
            bytes.reverse();
        }
        bytes
    };
    let float = |number: f32| turned(number.to_le_bytes().into());
    let format = if is_little { "binary_little_endian" } else { "binary_big_endian" };
    let mut bytes = ply_header(format).into_bytes();
    for corner in CORNERS {
        bytes.push(255);
        corner.iter().for_each(|&number| bytes.extend(float(number)));
    }
    bytes.push(2);
    (0..2i16).for_each(|end| bytes.extend(turned(end.to_le_bytes().into())));
    for face in FACES {
        bytes.push(face.len() as u8);
        face.iter()
            .for_each(|&corner| bytes.extend(turned(i32::from(corner).to_le_bytes().into())));
        bytes.extend(float(0.5));
    }
    bytes
}

/// A file of every format and encoding, for alteration.
pub fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let (document, bytes) = gltf_sample::tetrahedron();
    vec![
        ("mesh.obj", obj()),
        ("mesh.gltf", gltf_sample::with_data_uri(document.clone(), &bytes)),
        ("mesh.glb", gltf_sample::glb(&document, &bytes)),
        ("text.stl", stl_text(" a pyramid").into()),
        ("binary.stl", stl_binary(b"exported")),
        ("text.ply", ply_text().into()),
        ("little.ply", ply_binary(true)),
        ("big.ply", ply_binary(false)),
    ]
}

fn written(folder: &Path, name: &str, bytes: &[u8]) -> Result<Mesh, String> {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    import(&path, 1.0).map(|(mesh, _)| mesh).map_err(|error| error.to_string())
}

#[test]
fn every_format_and_encoding_holds_the_same_mesh() {
    let folder = TempDir::new().unwrap();
    let [text, marked] = ["\n", "\r\n"].map(|end| stl_text(" a pyramid").replace('\n', end));
    let two = stl_text("") + &stl_text(" again").replace("vertex ", "vertex 1");
    let cases = [
        ("mesh.obj", obj()),
        ("text.stl", text.clone().into()),
        ("TEXT.STL", [b"\xef\xbb\xbf", marked.as_bytes()].concat()),
        ("nameless.stl", stl_text("").into()),
        ("loud.stl", stl_text("").to_uppercase().into()),
        ("latin.stl", [b"solid \xe9\n", text.split_once('\n').unwrap().1.as_bytes()].concat()),
        ("binary.stl", stl_binary(b"exported")),
        ("lying.stl", stl_binary(b"solid but binary")),
        ("text.ply", ply_text().into()),
        ("windows.ply", ply_text().replace('\n', "\r\n").into()),
        ("index.ply", ply_text().replace("vertex_indices", "vertex_index").into()),
        ("double.ply", ply_text().replace("float x", "double x").into()),
        ("little.ply", ply_binary(true)),
        ("big.ply", ply_binary(false)),
    ];
    for (name, bytes) in cases {
        let mesh = written(folder.path(), name, &bytes).unwrap_or_else(|error| panic!("{error}"));
        let found = (mesh.vertices().len(), mesh.triangles().len());
        assert_eq!(found, (5, 6), "{name}");
        // Volume: a third of base times height; normals point outwards.
        assert!((mesh.volume_m3() - 4.0).abs() < 1e-6, "{name}: {}", mesh.volume_m3());
    }
    let mesh = written(folder.path(), "two.stl", two.as_bytes()).unwrap();
    assert_eq!(mesh.triangles().len(), 12, "all solids of a text are read");
}

#[test]
fn broken_and_hostile_files_are_refused_at_their_place() {
    let folder = TempDir::new().unwrap();
    let text = stl_text(" a");
    let binary = stl_binary(b"");
    let ply = ply_text();
    let declaring =
        |count: &str| ply.replace("element vertex 5", &format!("element vertex {count}"));
    let longer = |bytes: &[u8]| [bytes, b"\0more"].concat();
    let mut counting = binary.clone();
    counting[80..84].fill(0xff);
    let mut long_list = ply_binary(true);
    let place = long_list.len() - 5 * 4 - 4 * 12 - 16 - 5;
    long_list[place] = 255;
    let points = ply.split("element edge").next().unwrap().to_owned()
        + "end_header\n1 2 3 4\n1 2 3 4\n1 2 3 4\n1 2 3 4\n1 2 3 4\n";
    let bare = "ply\nformat binary_little_endian 1.0\nelement a 99999999999999999\nend_header\n";
    let cases: [(&str, Vec<u8>, &str); 27] = [
        ("empty.stl", vec![], "has 84 bytes, not 0"),
        ("short.stl", b"short".into(), "84 bytes, not 5"),
        ("cut.stl", binary[..200].into(), "384 bytes, not 200"),
        ("longer.stl", longer(&binary), "of 6 triangles has 384"),
        ("count.stl", counting, "of 4294967295 triangles has 214748364834"),
        ("nothing.stl", b"solid\nendsolid\n".into(), "no triangles"),
        ("word.stl", text.replace("vertex 2e0", "vertex two").into(), "line 6: expected solid"),
        ("infinite.stl", text.replace("vertex 2e0", "vertex inf").into(), "line 6"),
        ("loop.stl", text.replacen("outer loop", "outer", 1).into(), "line 3"),
        ("endless.stl", text.replace("endsolid a", "").into(), "line 44"),
        ("empty.ply", vec![], "end of file"),
        ("no.ply", b"plywood\n".into(), "line 1"),
        ("format.ply", ply.replace("ascii", "morse").into(), "line 2"),
        ("fewer.ply", declaring("4").into(), "line"),
        ("more.ply", declaring("6").into(), "line"),
        ("count.ply", declaring("99999999999").into(), "\"vertex\""),
        ("overflow.ply", declaring("99999999999999999999999").into(), "line 5"),
        ("bare.ply", bare.into(), "99999999999999999 of element \"a\""),
        ("flat.ply", ply.replace("property float z\n", "").into(), "must have x, y and z"),
        ("list.ply", ply.replace("vertex_indices", "corners").into(), "must have vertex_indices"),
        ("word.ply", ply.replace("255 2 0 0", "255 two 0 0").into(), "line 17"),
        ("negative.ply", ply.replace("3 0 1 4", "3 -1 1 4").into(), "line 23"),
        ("index.ply", ply.replace("3 0 1 4", "3 0 1 5").into(), "refers to vertex 5"),
        ("points.ply", points.into(), "holds 5 points and no faces"),
        ("longer.ply", longer(&ply_binary(false)), "5 bytes more"),
        (
            "cut.ply",
            {
                let b = ply_binary(true);
                b[..b.len() - 1].into()
            },
            "element 'face'",
        ),
        ("lists.ply", long_list, "element 'face'"),
    ];
    for (name, bytes, says) in cases {
        let error = written(folder.path(), name, &bytes).err().unwrap_or_else(|| panic!("{name}"));
        assert!(error.contains(says) && error.contains(name), "{name}: no \"{says}\" in {error}");
        assert!(!error.contains('\n'), "{error}");
    }
}

#[test]
fn what_scan_and_export_write_is_read_back() {
    let folder = folder();
    succeeds(folder.path(), &["export", "scene.toml", "--grid", "4x5", "--out", "scan"]);
    fails(folder.path(), &["show", "scan/cloud.ply"], &["20 points and no faces", "mesh"]);
    succeeds(folder.path(), &["run", "small.toml", "--no-report"]);
    for name in ["belief.ply", "belief.obj"] {
        let export = ["export", "runs/small", "--planner", "random", "--grid", "6", "--out", name];
        let said = succeeds(folder.path(), &export);
        assert!(said.contains("36 vertices, 50 triangles"), "{said}");
        let shown = succeeds(folder.path(), &["show", name]);
        assert!(shown.contains("triangles           50 of 50"), "{shown}");
        // The exported mesh can be touched.
        let scene = format!("scene.object.mesh={name}");
        succeeds(
            folder.path(),
            &["run", "small.toml", "--set", &scene, "--out", name.replace('.', "-").as_str()],
        );
    }
}

#[test]
fn numbers_without_a_unit_are_given_one() {
    let folder = folder();
    for (name, bytes) in [("a.stl", stl_binary(b"")), ("a.ply", ply_binary(true))] {
        fs::write(folder.path().join(name), bytes).unwrap();
        let shown = succeeds(folder.path(), &["show", name, "--unit", "mm"]);
        assert!(shown.contains("2.000 x 2.000 x 3.000 mm"), "{shown}");
    }
}
