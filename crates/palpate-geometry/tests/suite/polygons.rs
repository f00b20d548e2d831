//! Tests of polygons in OBJ and PLY: their area against the shoelace formula, and closed prisms.

use std::f64::consts::TAU;
use std::fmt::Write;

use super::import::import_bytes;
use nalgebra::{Point3, Rotation3, Vector3};
use palpate_geometry::mesh::Mesh;

type Outline = Vec<[f64; 2]>;

/// Three teeth on a bar, 60 mm by 60 mm; the shoelace formula gives 4e-3 m².
fn comb() -> Outline {
    let mm =
        [[0, 0], [60, 0], [60, 10], [20, 10], [20, 25], [60, 25], [60, 35], [20, 35], [20, 50]];
    let mm = mm.iter().chain(&[[60, 50], [60, 60], [0, 60]]);
    mm.map(|corner| corner.map(|x| 1e-3 * f64::from(x))).collect()
}

/// A star with `count` corners at distances between 5 mm and 50 mm that a fixed sequence gives.
fn star(count: u32) -> Outline {
    let mut state = u64::from(count);
    let corner = |i: u32| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let radius_m = 0.005 + 0.045 * (state >> 33) as f64 / f64::from(1u32 << 31);
        let (sin, cos) = (TAU * f64::from(i) / f64::from(count)).sin_cos();
        [radius_m * cos, radius_m * sin]
    };
    (0..count).map(corner).collect()
}

/// A band of 2 mm around a point, three turns.
fn spiral() -> Outline {
    let edge = |i: u32, start_m: f64| {
        let turns = f64::from(i) / 40.0;
        let (sin, cos) = (TAU * turns).sin_cos();
        [(start_m + 0.004 * turns) * cos, (start_m + 0.004 * turns) * sin]
    };
    let outer = (0..=120).map(|i| edge(i, 0.012));
    outer.chain((0..=120).rev().map(|i| edge(i, 0.010))).collect()
}

/// Adds corners that divide each side in three.
fn divided(outline: &Outline) -> Outline {
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    let thirds = |(a, b): (&[f64; 2], &[f64; 2])| {
        [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|t| [0, 1].map(|i| a[i] + t * (b[i] - a[i])))
    };
    sides.flat_map(thirds).collect()
}

/// Shoelace formula.
fn area_m2(outline: &Outline) -> f64 {
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    0.5 * sides.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs()
}

fn perimeter_m(outline: &Outline) -> f64 {
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    sides.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum()
}

/// Pose of an outline in space.
struct Place {
    turn: Rotation3<f64>,
    offset_m: Vector3<f64>,
    scale: f64,
}

impl Place {
    fn of(&self, [x, y]: [f64; 2], z: f64) -> Point3<f64> {
        self.turn * Point3::new(x, y, z) * self.scale + self.offset_m
    }
}

fn places() -> [Place; 4] {
    let turn = Rotation3::from_euler_angles(0.3, -1.1, 2.0);
    let place = |turn, offset_m: [f64; 3], scale| Place { turn, offset_m: offset_m.into(), scale };
    [
        place(Rotation3::identity(), [0.0; 3], 1.0),
        place(turn, [0.1, -0.2, 0.3], 1.0),
        // Far from the origin, a coordinate is rounded to 1e-13 m.
        place(turn, [900.0, -700.0, 300.0], 1.0),
        place(turn, [0.0; 3], 1e-3),
    ]
}

/// Returns a mesh as OBJ and as PLY.
fn files(vertices: &[Point3<f64>], faces: &[Vec<usize>]) -> [(&'static str, String); 2] {
    let (mut obj, mut rows) = (String::new(), String::new());
    for p in vertices {
        writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap();
        writeln!(rows, "{} {} {}", p.x, p.y, p.z).unwrap();
    }
    for face in faces {
        let list = |first: usize| {
            face.iter().map(|i| (i + first).to_string()).collect::<Vec<_>>().join(" ")
        };
        writeln!(obj, "f {}", list(1)).unwrap();
        writeln!(rows, "{} {}", face.len(), list(0)).unwrap();
    }
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uint uint vertex_indices\n\
         end_header\n{rows}",
        vertices.len(),
        faces.len()
    );
    [("mesh.obj", obj), ("mesh.ply", ply)]
}

/// Returns the vector of the area of a mesh.
fn area_vector_m2(mesh: &Mesh) -> Vector3<f64> {
    mesh.iter_corners().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a))).sum()
}

/// Imports a face in every place and winding, and checks its area and its normal.
#[track_caller]
fn check_face(outline: &Outline, bound: f64) {
    for place in places() {
        for is_reversed in [false, true] {
            let vertices: Vec<_> = outline.iter().map(|&corner| place.of(corner, 0.0)).collect();
            let mut face: Vec<usize> = (0..outline.len()).collect();
            if is_reversed {
                face.reverse();
            }
            let expected_m2 = area_m2(outline) * place.scale * place.scale;
            let sign = if is_reversed { -expected_m2 } else { expected_m2 };
            let vector_m2 = place.turn * Vector3::z() * sign;
            for (name, text) in files(&vertices, &[face.clone()]) {
                let (mesh, report) = import_bytes(name, text.as_bytes()).unwrap();
                let error = mesh.area_m2() / expected_m2 - 1.0;
                assert!(error.abs() < bound, "{name}: {error:e}\n{report}");
                let error = (area_vector_m2(&mesh) - vector_m2).norm() / expected_m2;
                assert!(error < bound, "{name}: normal, {error:e}\n{report}");
                assert_eq!(report.flipped.count, 0, "{name}\n{report}");
            }
        }
    }
}

/// Imports a prism over an outline, 20 mm high, and checks that it is closed, its area and volume.
#[track_caller]
fn check_prism(outline: &Outline, bound: f64) {
    let count = outline.len();
    let mut faces: Vec<Vec<usize>> = vec![(0..count).rev().collect(), (count..2 * count).collect()];
    faces.extend((0..count).map(|i| {
        let next = (i + 1) % count;
        vec![i, next, count + next, count + i]
    }));
    for place in places() {
        let level = |z| outline.iter().map(move |&corner| (corner, z));
        let corners = level(0.0).chain(level(0.02));
        let vertices: Vec<_> = corners.map(|(corner, z)| place.of(corner, z)).collect();
        let expected_m2 = 2.0 * area_m2(outline) + 0.02 * perimeter_m(outline);
        let expected_m2 = expected_m2 * place.scale.powi(2);
        let expected_m3 = 0.02 * area_m2(outline) * place.scale.powi(3);
        for (name, text) in files(&vertices, &faces) {
            let (mesh, report) = import_bytes(name, text.as_bytes()).unwrap();
            assert_eq!((report.border_edges.count, report.is_closed()), (0, true), "{report}");
            assert_eq!(mesh.triangles().len(), 4 * count - 4, "{name}\n{report}");
            let errors = [mesh.area_m2() / expected_m2 - 1.0, mesh.volume_m3() / expected_m3 - 1.0];
            assert!(errors.iter().all(|it| it.abs() < bound), "{name}: {errors:?}\n{report}");
        }
    }
}

/// Bounds: 1000 m from the origin, where the doubles are 1e-13 m apart, an area of 1e-3 m² with a
/// border of 1 m is uncertain by 1e-10 of it, and a star has a border of up to 30 m.
#[test]
fn concave_polygons_have_the_area_of_the_shoelace_formula() {
    for (outline, bound) in
        [(comb(), 1e-10), (spiral(), 1e-9), (star(9), 1e-9), (star(60), 1e-9), (star(600), 1e-8)]
    {
        check_face(&outline, bound);
        check_prism(&outline, bound);
        let mut turned = outline.clone();
        turned.rotate_left(outline.len() / 3);
        check_face(&turned, bound);
    }
}

/// Corners on a straight side belong to the triangles of both faces at the side, also where
/// rounding moves them off it.
#[test]
fn corners_on_straight_sides_leave_no_gap() {
    let square = vec![[0.0, 0.0], [0.06, 0.0], [0.06, 0.06], [0.0, 0.06]];
    for outline in [comb(), square, star(9), star(40)] {
        check_prism(&divided(&outline), 1e-9);
        check_prism(&divided(&divided(&outline)), 1e-9);
    }
}

/// A face with a hole is a polygon whose border runs along a bridge to the hole and back.
#[test]
fn polygons_that_touch_themselves_keep_their_holes() {
    let square = [[0.0, 0.0], [0.06, 0.0], [0.06, 0.06], [0.0, 0.06], [0.0, 0.0]];
    let hole = [[0.02, 0.02], [0.02, 0.04], [0.04, 0.04], [0.04, 0.02], [0.02, 0.02]];
    let outline: Outline = square.into_iter().chain(hole).collect();
    assert!((area_m2(&outline) - 3.2e-3).abs() < 1e-15);
    check_face(&outline, 1e-9);
}

/// A corner that is named twice in a row, and two squares that share a corner.
#[test]
fn repeated_corners_change_nothing() {
    let mut outline = comb();
    outline.insert(4, outline[4]);
    outline.push(outline[0]);
    check_face(&outline, 1e-10);
    let bow = vec![[0.0, 0.0], [0.01, 0.0], [0.01, 0.01], [0.02, 0.01], [0.02, 0.02], [0.01, 0.02]];
    let bow: Outline = bow.into_iter().chain([[0.01, 0.01], [0.0, 0.01]]).collect();
    assert!((area_m2(&bow) - 2e-4).abs() < 1e-15);
    check_face(&bow, 1e-9);
}

/// A convex polygon stays a fan around its first corner.
#[test]
fn convex_polygons_stay_fans() {
    let outline: Outline = (0..7).map(|i| (TAU * f64::from(i) / 7.0).sin_cos().into()).collect();
    let vertices: Vec<_> = outline.iter().map(|&[x, y]| Point3::new(x, y, 0.0)).collect();
    for (name, text) in files(&vertices, &[(0..7).collect()]) {
        let (mesh, _) = import_bytes(name, text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles(), &[1, 2, 3, 4, 5].map(|i| [0, i, i + 1]));
    }
}

/// A concave quadrilateral is cut along the diagonal inside it; one that is bent at a diagonal is
/// seen along its normal.
#[test]
fn quadrilaterals_are_cut_inside() {
    let dart = vec![[0.0, 0.0], [0.03, 0.02], [0.0, 0.01], [-0.03, 0.02]];
    for first in 0..4 {
        let mut outline = dart.clone();
        outline.rotate_left(first);
        // Half of the diagonals' product: 10 mm times 60 mm.
        assert!((area_m2(&outline) - 3e-4).abs() < 1e-15);
        check_face(&outline, 1e-9);
    }
    let bent = "v 0 0 0.005\nv 0.03 0.02 0\nv 0 0.01 0.005\nv -0.03 0.02 0\nf 2 3 4 1\n";
    let (mesh, _) = import_bytes("mesh.obj", bent.as_bytes()).unwrap();
    // Twice half of 10 mm times the distance of a tip from the diagonal, √(30² + 5²) mm.
    let expected_m2 = 0.01 * 0.03_f64.hypot(0.005);
    assert!((mesh.area_m2() / expected_m2 - 1.0).abs() < 1e-12, "{}", mesh.area_m2());
}

/// Polygons without area add nothing, and are no fault in a mesh with others.
#[test]
fn polygons_without_area_are_removed() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv 3 0 0\nf 1 2 3\nf 1 2 4 5\nf 1 2 1 2\n\
                f 1 1 1 1 1\nf 1 4 2 5 1 2\n";
    let (mesh, report) = import_bytes("mesh.obj", text.as_bytes()).unwrap();
    assert_eq!(report.triangles, 1, "{report}");
    assert_eq!(mesh.area_m2(), 0.5);
}

/// Numbers at the limits of f64 are refused as such, not by a panic.
#[test]
fn polygons_with_impossible_numbers_are_refused() {
    for word in ["nan", "inf", "1e999", "1e308", "1e200", "-1e160"] {
        let text =
            format!("v 0 0 0\nv {word} 0 0\nv 1 1 {word}\nv 0 {word} 0\nv 0 0.2 0\nf 1 2 3 4 5\n");
        assert!(import_bytes("mesh.obj", text.as_bytes()).is_err(), "{word}");
    }
}

/// A comb with 20 000 corners: a bar of 1 m by 0.1 m, and teeth over half of it, 0.9 m long.
#[test]
fn many_corners_are_no_limit() {
    let teeth = 5_000;
    let mut outline: Outline = vec![[0.0, 0.0], [1.0, 0.0]];
    for i in (0..teeth).rev() {
        let [left, middle] = [0.0, 0.5].map(|part| (f64::from(i) + part) / f64::from(teeth));
        outline.extend([[middle, 0.1], [middle, 1.0], [left, 1.0], [left, 0.1]]);
    }
    let vertices: Vec<_> = outline.iter().map(|&[x, y]| Point3::new(x, y, 0.0)).collect();
    let (_, text) = files(&vertices, &[(0..outline.len()).collect()])[0].clone();
    let (mesh, report) = import_bytes("mesh.obj", text.as_bytes()).unwrap();
    assert!((mesh.area_m2() / area_m2(&outline) - 1.0).abs() < 1e-9, "{report}");
    // The bar ends half a tooth early at its top.
    assert!((area_m2(&outline) - 0.55).abs() < 0.1 / f64::from(teeth));
}
