//! Tests of laws that the measures of closed surfaces obey.

use crate::common::shapes::{box_mesh, point, sphere_mesh, square};
use nalgebra::{Isometry3, Vector3};
use palpate::experiment::metrics::shape::{ShapeMetrics, TrueShape};
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::import::import;
use palpate::geometry::mesh::Mesh;
use proptest::prelude::*;
use std::f64::consts::PI;
use std::path::Path;

fn truth(mesh: &Mesh) -> TrueShape {
    TrueShape::new(MeshBvh::new(mesh.clone()), true)
}

fn compare(truly: &Mesh, believed: &Mesh) -> ShapeMetrics {
    truth(truly).compare(believed)
}

fn ball(radius_m: f64) -> Mesh {
    sphere_mesh(point(0.2, -0.1, 0.4), radius_m, 48)
}

/// An object of the suite in its own frame.
fn object(name: &str) -> Mesh {
    let path = format!("{}/models/suite/{name}.glb", env!("CARGO_MANIFEST_DIR"));
    import(Path::new(&path), 1.0).unwrap().0
}

/// Returns the surface with each triangle cut into four.
fn refined(mesh: &Mesh) -> Mesh {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for [a, b, c] in mesh.iter_corners() {
        let middle = |p, q| nalgebra::center(p, q);
        let base = vertices.len() as u32;
        vertices.extend([a, b, c, middle(&a, &b), middle(&b, &c), middle(&c, &a)]);
        let cut = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];
        triangles.extend(cut.map(|corners: [u32; 3]| corners.map(|corner| base + corner)));
    }
    Mesh::new(&vertices, &triangles).unwrap().0
}

#[test]
fn the_truth_is_itself() {
    for name in ["mug", "pair", "fork", "bowl"] {
        let mesh = object(name);
        for believed in [&mesh, &refined(&mesh)] {
            let metrics = compare(&mesh, believed);
            assert!(metrics.chamfer_m.unwrap() < 1e-9, "{name}: {metrics:?}");
            assert_eq!((metrics.f_1, metrics.f_3), (1.0, 1.0), "{name}");
            assert!(metrics.volume_error.unwrap().abs() < 1e-6, "{name}: {metrics:?}");
            assert!(metrics.area_error.abs() < 1e-6, "{name}: {metrics:?}");
            assert!((metrics.iou.unwrap() - 1.0).abs() < 1e-6, "{name}: {metrics:?}");
        }
    }
}

/// Concentric spheres are the difference of their radii apart in both directions; their vertices
/// lie on them and their faces up to 1 - cos(π/48) of the radius below.
#[test]
fn concentric_spheres_are_the_difference_of_their_radii_apart() {
    let (small_m, large_m): (f64, f64) = (0.05, 0.054);
    for (truly_m, believed_m) in [(small_m, large_m), (large_m, small_m)] {
        let metrics = compare(&ball(truly_m), &ball(believed_m));
        let chord = 1.0 - (PI / 48.0).cos();
        let off_m = metrics.chamfer_m.unwrap() - (large_m - small_m);
        assert!(off_m.abs() < chord * large_m, "{off_m}");
        let ratio = believed_m / truly_m;
        assert!((metrics.volume_error.unwrap() - (ratio.powi(3) - 1.0)).abs() < 1e-6);
        assert!((metrics.area_error - (ratio.powi(2) - 1.0)).abs() < 1e-6);
        let iou = (small_m / large_m).powi(3);
        assert!((metrics.iou.unwrap() - iou).abs() < 2e-3, "{metrics:?} {iou}");
        // The diagonal is 2·√3 radii, so 1 % of it is 1.7 or 1.9 mm and 3 % 5.2 or 5.6 mm.
        assert_eq!((metrics.f_1, metrics.f_3), (0.0, 1.0));
    }
}

/// Tests a cube of side a, moved along one side by d. The exposed face is at distance d from the
/// other cube. The overlap is a - d of a + d.
#[test]
fn a_box_moved_sideways_is_as_far_off_as_geometry_says() {
    let (a, d): (f64, f64) = (0.1, 0.01);
    let cube = box_mesh(point(0.0, 0.0, 0.0), point(a, a, a));
    let metrics = compare(&cube, &cube.transformed(&Isometry3::translation(d, 0.0, 0.0)));
    let rim_m = (a.powi(3) - (a - 2.0 * d).powi(3)) / (6.0 * a * a);
    let chamfer_m = (d + rim_m + 4.0 * d * d / (2.0 * a)) / 6.0;
    let ratio = metrics.chamfer_m.unwrap() / chamfer_m;
    assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
    assert!((metrics.iou.unwrap() - (a - d) / (a + d)).abs() < 1e-3, "{metrics:?}");
    assert!(metrics.volume_error.unwrap().abs() < 1e-6 && metrics.area_error.abs() < 1e-6);
}

#[test]
fn no_belief_scores_nothing() {
    let nothing = truth(&ball(0.05)).compare_nothing();
    assert_eq!((nothing.chamfer_m, nothing.f_1, nothing.iou), (None, 0.0, Some(0.0)));
    assert_eq!((nothing.volume_error, nothing.area_error), (Some(-1.0), -1.0));
}

/// Half of the values lie within two standard deviations; NaN does not.
#[test]
fn coverage_is_the_share_within_two_standard_deviations() {
    let nothing = truth(&ball(0.05)).compare_nothing();
    let ratios = [0.0, -1.9, 2.0, -2.1, f64::INFINITY, f64::NAN];
    assert_eq!(nothing.with_coverage(ratios).coverage, Some(0.5));
    assert_eq!(nothing.with_coverage([]).coverage, None);
}

/// An open surface has no volume, but distances and an area.
#[test]
fn an_open_truth_has_no_inside() {
    let open = TrueShape::new(MeshBvh::new(square(0.05, 4)), false).compare(&ball(0.05));
    assert_eq!((open.volume_error, open.iou), (None, None));
    assert!(open.chamfer_m.unwrap() > 0.0 && open.area_error > 0.0);
}

/// Omitted `None` values are read back as `None`.
#[test]
fn a_row_reads_what_it_wrote() {
    let reference = truth(&ball(0.05));
    for metrics in [reference.compare(&ball(0.04)), reference.compare_nothing()] {
        let text = serde_json::to_string(&metrics).unwrap();
        assert_eq!(serde_json::from_str::<ShapeMetrics>(&text).unwrap(), metrics);
        assert_eq!(text.contains("chamfer"), metrics.chamfer_m.is_some());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Distance and overlap are symmetric.
    #[test]
    fn truth_and_belief_may_change_places(by in prop::array::uniform3(-0.02f64..0.02)) {
        let (one, other) = (object("knob"), object("cone"));
        let other = other.transformed(&Isometry3::from(Vector3::from(by)));
        let (there, back) = (compare(&one, &other), compare(&other, &one));
        prop_assert!((there.chamfer_m.unwrap() - back.chamfer_m.unwrap()).abs() < 1e-15);
        prop_assert!((there.iou.unwrap() - back.iou.unwrap()).abs() < 2e-6);
        let volumes = (1.0 + there.volume_error.unwrap()) * (1.0 + back.volume_error.unwrap());
        prop_assert!((volumes - 1.0).abs() < 1e-5);
    }

    /// Lengths scale with both surfaces, shares stay.
    #[test]
    fn shares_know_no_scale(factor in 0.01f64..100.0, by in prop::array::uniform3(-0.02f64..0.02)) {
        let (truly, believed) = (ball(0.05), object("knob"));
        let moved = Isometry3::from(Vector3::from(by));
        let believed = believed.transformed(&(Isometry3::translation(0.2, -0.1, 0.4) * moved));
        let one = compare(&truly, &believed);
        let other = compare(&truly.scaled(factor), &believed.scaled(factor));
        let ratio = other.chamfer_m.unwrap() / one.chamfer_m.unwrap();
        prop_assert!((ratio / factor - 1.0).abs() < 1e-9);
        let shares = |m: &ShapeMetrics| {
            [m.chamfer_share.unwrap(), m.f_1, m.f_3, m.volume_error.unwrap(), m.area_error, m.iou.unwrap()]
        };
        for (one, other) in shares(&one).into_iter().zip(shares(&other)) {
            prop_assert!((one - other).abs() < 2e-6, "{one} {other}");
        }
    }
}
