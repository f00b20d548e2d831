//! Tests of files that are unusual but valid, of every text and binary format, and of the causes
//! that refusals name.

use std::path::Path;

use super::import::{import_bytes, refused};
use palpate_geometry::import::is_mesh_file;

/// Corners and outward faces of a cube of 50 mm, volume 1.25e-4 m³.
const CORNERS: [[f32; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [0.05, 0.0, 0.0],
    [0.05, 0.05, 0.0],
    [0.0, 0.05, 0.0],
    [0.0, 0.0, 0.05],
    [0.05, 0.0, 0.05],
    [0.05, 0.05, 0.05],
    [0.0, 0.05, 0.05],
];
const FACES: [[u8; 4]; 6] =
    [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// Imports a file and checks that it holds the cube, turned outwards.
#[track_caller]
fn is_cube(name: &str, bytes: &[u8]) {
    let (mesh, report) = import_bytes(name, bytes).unwrap();
    assert_eq!((mesh.triangles().len(), report.is_closed()), (12, true), "{report}");
    assert_eq!(report.flipped.count, 0, "{report}");
    assert!((mesh.volume_m3() / 1.25e-4 - 1.0).abs() < 1e-6, "{report}");
    assert!((mesh.area_m2() / 1.5e-2 - 1.0).abs() < 1e-6, "{report}");
}

fn vertex_lines(after: &str) -> String {
    CORNERS.iter().map(|[x, y, z]| format!("v {x} {y} {z}{after}\n")).collect()
}

/// Faces of an OBJ; `between` stands between the second and third corner.
fn face_lines(between: &str, after: &str) -> String {
    let face = |[a, b, c, d]: [u8; 4]| {
        format!("f {} {}{between}{} {}{after}\n", a + 1, b + 1, c + 1, d + 1)
    };
    FACES.map(face).concat()
}

fn obj() -> String {
    vertex_lines("") + &face_lines(" ", "")
}

fn triangles() -> impl Iterator<Item = [[f32; 3]; 3]> {
    let halves = FACES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    halves.map(|corners| corners.map(|corner| CORNERS[usize::from(corner)]))
}

fn stl_text() -> String {
    let facet = |corners: [[f32; 3]; 3]| {
        let lines = corners.map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).concat();
        format!("facet normal 0 0 0\nouter loop\n{lines}endloop\nendfacet\n")
    };
    format!("solid cube\n{}endsolid cube\n", triangles().map(facet).collect::<String>())
}

fn stl_binary(header: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend(12u32.to_le_bytes());
    for corners in triangles() {
        bytes.extend([0; 12]);
        bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ply_header(format: &str, list: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment a cube\nelement vertex 8\nproperty float x\n\
         property float y\nproperty float z\nelement face 6\nproperty list {list}\nend_header\n"
    )
}

fn ply_text(list: &str) -> String {
    let vertices = vertex_lines("").replace("v ", "");
    let faces = FACES.map(|[a, b, c, d]| format!("4 {a} {b} {c} {d}\n")).concat();
    ply_header("ascii", list) + &vertices + &faces
}

fn ply_binary(header: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.extend(CORNERS.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    for face in FACES {
        bytes.push(4);
        bytes.extend(face.iter().flat_map(|&corner| i32::from(corner).to_le_bytes()));
    }
    bytes
}

const LIST: &str = "uchar int vertex_indices";
const LITTLE: &str = "binary_little_endian";

#[test]
fn lines_may_end_as_on_any_system() {
    for end in ["\n", "\r\n", "\r"] {
        is_cube("mesh.obj", obj().replace('\n', end).as_bytes());
        is_cube("mesh.stl", stl_text().replace('\n', end).as_bytes());
        is_cube("mesh.ply", ply_text(LIST).replace('\n', end).as_bytes());
        let header = ply_header(LITTLE, LIST).replace('\n', end);
        is_cube("mesh.ply", &ply_binary(header.as_bytes()));
    }
    let bad = obj().replace("f 5 6 7 8", "f 5 6 7 9").replace('\n', "\r");
    refused("old lines are counted", import_bytes("mesh.obj", bad.as_bytes()), "line 10: vertex 9");
}

#[test]
fn comments_may_be_in_any_encoding() {
    let latin = b"comment Ger\xe4t gr\xf6\xdfe \xfc";
    let with = |header: String| {
        let (before, after) = header.split_once("comment a cube").unwrap();
        [before.as_bytes(), latin, after.as_bytes()].concat()
    };
    is_cube("mesh.ply", &ply_binary(&with(ply_header(LITTLE, LIST))));
    is_cube("mesh.ply", &with(ply_text(LIST)));
    is_cube("mesh.ply", &with(ply_text(LIST).replace("comment a", "obj_info by\ncomment a")));
    is_cube("mesh.obj", &[b"# Ger\xe4t \xff\n", obj().as_bytes()].concat());
    is_cube("mesh.stl", &[b"solid Ger\xe4t", &stl_text().as_bytes()[5..]].concat());
}

#[test]
fn utf16_is_decoded() {
    let text = format!("\u{feff}{}", obj());
    let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    is_cube("mesh.obj", &little);
    let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    is_cube("mesh.obj", &big);
}

#[test]
fn obj_statements_may_continue_carry_comments_and_come_in_any_order() {
    is_cube("mesh.obj", (vertex_lines(" # corner") + &face_lines(" ", " # side")).as_bytes());
    is_cube("mesh.obj", (vertex_lines("") + &face_lines(" \\\n", "#side")).as_bytes());
    is_cube("mesh.obj", (vertex_lines("") + &face_lines(" \\ \r\n", "")).as_bytes());
    is_cube("mesh.obj", (vertex_lines(" 1.0") + &face_lines("//7 ", "/")).as_bytes());
    is_cube("mesh.obj", (vertex_lines(" 1 0.2 0.3 0.4") + &face_lines("/1/1 ", "")).as_bytes());
    is_cube("mesh.obj", (face_lines(" ", "") + &vertex_lines("")).as_bytes());
    let grouped = face_lines(" ", "").replace("f 1 2", "o b # c\\\nf 1 2");
    is_cube("mesh.obj", (grouped.clone() + &vertex_lines("")).as_bytes());
    is_cube("mesh.obj", ("# C:\\meshes\\\n".to_owned() + &vertex_lines("") + &grouped).as_bytes());
    let missing = vertex_lines("") + "f 1 2 \\\n9\n";
    let says = "line 9: vertex 9 of a face is out of range: there are 8";
    refused("continued", import_bytes("mesh.obj", missing.as_bytes()), says);
    let says = "holds no triangles (2 primitives of points or lines were skipped)";
    refused(
        "lines",
        import_bytes("mesh.obj", (vertex_lines("") + "l 1 2 3\np 4\n").as_bytes()),
        says,
    );
}

#[test]
fn stl_content_tells_text_from_binary() {
    let headers: [&[u8]; 4] =
        [b"", b"solid", b"solid exported by CAD", b"SOLID part\nfacet normal"];
    for header in headers {
        let binary = stl_binary(header);
        is_cube("mesh.stl", &binary);
        for padding in [&b"\0"[..], &[0; 16], b"\r\n", b"\xff\xff", b"\x1a", b"  \0\0"] {
            is_cube("mesh.stl", &[&binary, padding].concat());
        }
        let cut = import_bytes("mesh.stl", &binary[..600]);
        refused("cut", cut, "a binary file of 12 triangles has 684 bytes, not 600");
        let longer = import_bytes("mesh.stl", &[&binary[..], b"more"].concat());
        refused("longer", longer, "has 684 bytes, not 688; what follows is no padding");
    }
    let cut = import_bytes("mesh.stl", &stl_binary(b"solid exported by CAD")[..600]);
    refused("first byte that is no text", cut, "not a text, byte 21 is 0x00, and a binary");
}

#[test]
fn stl_texts_may_be_loud_padded_and_in_many_parts() {
    let text = stl_text();
    is_cube("mesh.stl", text.to_uppercase().as_bytes());
    is_cube("mesh.stl", format!("\n\n  {text}\n\n").as_bytes());
    for padding in ["\0\0\0", "\x1a", "\r\n\0"] {
        is_cube("mesh.stl", format!("{text}{padding}").as_bytes());
    }
    is_cube("mesh.stl", text.replace("cube", "a cube of 50 mm, facet by facet").as_bytes());
    is_cube("mesh.stl", text.replace("0.05", "+5.0E-02").as_bytes());
    is_cube(
        "mesh.stl",
        text.replace("facet normal 0 0 0", "\tfacet  normal nan -nan inf").as_bytes(),
    );
    let place = text.match_indices("facet normal").nth(5).unwrap().0;
    let (one, two) = text.split_at(place);
    is_cube("mesh.stl", format!("{one}endsolid cube\n\nsolid rest\n{two}").as_bytes());
    let cases = [
        ("no endsolid", text.replace("endsolid cube", ""), "line 86: expected solid, then"),
        ("no end at all", text.replace("endsolid cube\n", "\0"), "found \"the end of the file\""),
        ("two corners", text.replacen("vertex 0 0 0\n", "", 1), "found \"endloop\""),
        ("solid in a solid", format!("{one}solid rest\n{two}"), "line 37: expected solid, then"),
        ("comma", text.replacen("0.05", "0,05", 1), "found \"vertex 0 0,05 0\""),
    ];
    for (case, text, says) in cases {
        refused(case, import_bytes("mesh.stl", text.as_bytes()), says);
    }
}

#[test]
fn ply_lists_may_have_any_integer_type_and_either_name() {
    for count in ["char", "uchar", "short", "uint8", "ushort", "int", "uint", "uint32"] {
        for index in ["char", "uchar", "short", "ushort", "int", "uint", "int32"] {
            for name in ["vertex_index", "vertex_indices"] {
                is_cube("mesh.ply", ply_text(&format!("{count} {index} {name}")).as_bytes());
            }
        }
    }
    for list in ["uchar int vertex_index", LIST] {
        is_cube("mesh.ply", &ply_binary(ply_header(LITTLE, list).as_bytes()));
    }
}

#[test]
fn ply_texts_may_have_blank_lines_and_other_elements() {
    let text = ply_text(LIST);
    is_cube("mesh.ply", text.replace("4 0 1 5 4\n", "\n 4\t0 1 5 4 \n\n").as_bytes());
    is_cube(
        "mesh.ply",
        text.replace("4 4 5 6 7\n", "3 4 5 6\n3 4 6 7\n").replace("face 6", "face 7").as_bytes(),
    );
    is_cube(
        "mesh.ply",
        text.replace(" 0.05", " .05").replace("0 ", "0. ").replace("face 6.", "face 6").as_bytes(),
    );
    // Faces stand before their vertices.
    let (header, data) = text.split_once("element vertex").unwrap();
    let (vertex, face) = data.split_once("element face").unwrap();
    let (face, rows) = face.split_once("end_header\n").unwrap();
    let (vertices, faces): (Vec<&str>, Vec<&str>) =
        rows.lines().partition(|it| !it.starts_with('4'));
    let rows = [faces, vertices].concat().join("\n");
    let turned = format!("{header}element face{face}element vertex{vertex}end_header\n{rows}\n");
    is_cube("mesh.ply", turned.as_bytes());
    let cases = [
        ("short row", text.replace("0.05 0.05 0\n", "0.05 0.05\n"), "line 13: expected data"),
        ("negative", text.replace("4 3 2 1 0", "4 3 2 1 -1"), "line 19: expected vertex indices"),
        ("fraction", text.replace("4 3 2 1 0", "4 3 2 1 0.5"), "line 19: expected vertex indices"),
        (
            "header",
            text.replace("property float y", "property real y"),
            "line 6: expected a PLY header",
        ),
        ("cut", text.replace("4 3 0 4 7\n", ""), "found \"the end of the file\""),
        ("nan", text.replace("0.05 0.05 0.05", "nan 0.05 0.05"), "vertex 6 of PLY is not finite"),
        ("index", text.replace("4 3 2 1 0", "4 3 2 1 8"), "refers to vertex 8, but there are 8"),
    ];
    for (case, text, says) in cases {
        refused(case, import_bytes("mesh.ply", text.as_bytes()), says);
    }
    let mut binary = ply_binary(ply_header(LITTLE, LIST).as_bytes());
    let last = binary.len() - 4;
    binary[last..].fill(0xff);
    let says = "element 'face' 5 does not hold vertex indices from 0";
    refused("binary -1", import_bytes("mesh.ply", &binary), says);
    binary.truncate(last);
    let says = "the file ends within element 'face', after 5 of 6";
    refused("binary cut", import_bytes("mesh.ply", &binary), says);
}

#[test]
fn ply_headers_may_have_blanks_and_repeated_names() {
    let header = ply_header("ascii", LIST);
    let spaced = header.replace("\nelement", " \t\n\n \t element").replace("float", " float\t");
    is_cube("mesh.ply", ply_text(LIST).replace(&header, &spaced).as_bytes());
    let padded = ply_header(LITTLE, LIST)
        .replace("property float", "property uchar gap\nproperty uchar gap\nproperty float")
        .replace("property list", "property uchar gap\nproperty list");
    let mut bytes = padded.into_bytes();
    for x in CORNERS.as_flattened() {
        bytes.extend([7, 8]);
        bytes.extend(x.to_le_bytes());
    }
    for face in FACES {
        bytes.extend([9, 4]);
        bytes.extend(face.iter().flat_map(|&corner| i32::from(corner).to_le_bytes()));
    }
    is_cube("mesh.ply", &bytes);
}

/// Strips of triangles, separated by -1, as in scans of the Stanford repository.
#[test]
fn ply_strips_are_read() {
    // Four sides as one strip, bottom and top as one strip each.
    let strips = [0, 4, 1, 5, 2, 6, 3, 7, 0, 4, -1, 0, 1, 3, 2, -1, 4, 7, 5, 6, -1];
    let header = ply_header("ascii", LIST).replace("face 6", "tristrips 1");
    let header = header.replace("list uchar", "list int");
    let list: Vec<String> = strips.iter().map(i32::to_string).collect();
    let rows =
        vertex_lines("").replace("v ", "") + &format!("{} {}\n", strips.len(), list.join(" "));
    let (mesh, report) = import_bytes("mesh.ply", (header.clone() + &rows).as_bytes()).unwrap();
    assert_eq!((mesh.triangles().len(), report.is_closed()), (12, true), "{report}");
    assert!((mesh.volume_m3() / 1.25e-4 - 1.0).abs() < 1e-6, "{report}");
    let mut binary = header.replace("ascii", LITTLE).into_bytes();
    binary.extend(CORNERS.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    let numbers = [strips.len() as i32].into_iter().chain(strips);
    binary.extend(numbers.flat_map(i32::to_le_bytes));
    let (mesh, _) = import_bytes("mesh.ply", &binary).unwrap();
    assert!((mesh.area_m2() / 1.5e-2 - 1.0).abs() < 1e-6);
    // Every other triangle of a strip is named backwards.
    let one = header.replace("vertex 8", "vertex 4") + "0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n";
    let (mesh, report) = import_bytes("mesh.ply", one.as_bytes()).unwrap();
    assert_eq!((mesh.area_m2(), report.flipped.count), (1.0, 0), "{report}");
    assert!(mesh.iter_corners().all(|[a, b, c]| (b - a).cross(&(c - a)).z > 0.0));
}

#[test]
fn point_clouds_are_named_with_their_elements() {
    let text = ply_text(LIST);
    let (points, _) = text.split_once("4 3 2 1 0").unwrap();
    let none = points.replace("face 6", "face 0");
    let says = "holds 8 points and no faces (elements: vertex 8, face 0)";
    refused("no faces", import_bytes("mesh.ply", none.as_bytes()), says);
    let polygons = text.replace("element face", "element polygon");
    let says = "elements: vertex 8, polygon 6), like a point cloud; a mesh has element \"face\"";
    refused("other name", import_bytes("mesh.ply", polygons.as_bytes()), says);
}

#[test]
fn pointers_to_stored_files_are_named() {
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    for name in ["mesh.obj", "mesh.stl", "mesh.ply", "mesh.gltf", "mesh.glb"] {
        refused(name, import_bytes(name, pointer), "a pointer of Git LFS, not the file");
    }
}

#[test]
fn hidden_files_are_no_mesh_files() {
    for name in ["part.stl", "a/part.OBJ", "../part.glb", ".hidden/part.ply"] {
        assert!(is_mesh_file(Path::new(name)), "{name}");
    }
    for name in ["._part.stl", "a/._part.OBJ", ".part.glb", ".ply", "part.step", "part"] {
        assert!(!is_mesh_file(Path::new(name)), "{name}");
    }
}
