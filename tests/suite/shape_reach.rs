//! Tests of the reachable surface of a whole object with straight approaches.

use crate::common::shapes::{box_mesh, boxes, point, sphere_mesh};
use nalgebra::{UnitVector3, Vector3};
use palpate::experiment::metrics::shape::{FingerReach, TrueShape};
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::import::import;
use palpate::geometry::low_discrepancy::{SurfacePoint, over_surface};
use palpate::geometry::mesh::Mesh;
use palpate::robot::finger::Finger;
use std::path::Path;

/// Axis of a finger that approaches tip first, its cylinder straight behind its hemisphere.
fn tip_first(finger: &Finger) -> impl Fn(&UnitVector3<f64>) -> Vector3<f64> + Sync + use<> {
    let length_m = finger.length_m;
    move |ahead| ahead.scale(-length_m)
}

/// Reachability with tip-first approaches from any direction.
fn touched(mesh: &MeshBvh, spots: &[SurfacePoint], radius_m: f64) -> Vec<bool> {
    let axis_w = tip_first(&Finger::default());
    FingerReach { radius_m, axis_w: &axis_w, lowest_m: None }.reachable(mesh, spots)
}

fn spread(mesh: Mesh, count: usize) -> (MeshBvh, Vec<SurfacePoint>) {
    let spots = over_surface(&mesh, count);
    (MeshBvh::new(mesh), spots)
}

#[test]
fn all_of_a_convex_object_is_reached() {
    let ball = sphere_mesh(point(0.3, 0.2, 0.1), 0.03, 24);
    let cuboid = box_mesh(point(0.0, 0.0, 0.0), point(0.02, 0.1, 0.3));
    for mesh in [ball, cuboid] {
        let (mesh, spots) = spread(mesh, 500);
        for radius_m in [0.001, 0.007, 0.1] {
            assert!(touched(&mesh, &spots, radius_m).into_iter().all(|is| is), "{radius_m}");
        }
    }
}

/// Tests two plates with a gap: a finger thin enough for an oblique approach reaches both inner
/// faces, a thicker one reaches neither.
#[test]
fn a_gap_is_reached_into_by_a_finger_that_fits() {
    for (gap_m, fits) in [(0.013, false), (0.05, true)] {
        let far_m = 0.01 + gap_m;
        let plates = boxes(&[
            [[0.0, 0.0, 0.0], [0.01, 0.03, 0.03]],
            [[far_m, 0.0, 0.0], [far_m + 0.01, 0.03, 0.03]],
        ]);
        let (mesh, spots) = spread(plates, 1000);
        for (spot, is_touched) in spots.iter().zip(touched(&mesh, &spots, 0.007)) {
            let x = spot.point.x;
            let is_within = (x - 0.01).abs() < 1e-9 || (x - far_m).abs() < 1e-9;
            assert_eq!(is_touched, fits || !is_within, "{spot:?}");
        }
    }
}

/// The wall of a cavity is part of the surface, but unreachable.
#[test]
fn nothing_reaches_into_a_closed_cavity() {
    let (out, within) = ([[0.0; 3], [0.1; 3]], [[0.02; 3], [0.08; 3]]);
    let (mesh, _) = spread(boxes(&[out, within]), 1);
    let axis_w = tip_first(&Finger::default());
    let reach = FingerReach { radius_m: 0.007, axis_w: &axis_w, lowest_m: None };
    let truth = TrueShape::new(mesh, true).with_reach(&reach);
    let share = truth.reachable_share().unwrap();
    let law = 0.1_f64.powi(2) / (0.1_f64.powi(2) + 0.06_f64.powi(2));
    assert!((share - law).abs() < 2e-3, "{share} {law}");
    // A belief without the cavity is correct on the reachable surface.
    let metrics = truth.compare(&boxes(&[out]));
    assert!(metrics.reachable_chamfer_m.unwrap() < 1e-12);
    assert!(metrics.chamfer_m.unwrap() > 1e-3, "{metrics:?}");
}

/// A thinner finger reaches at least what a thicker one does.
#[test]
fn a_thinner_finger_reaches_more() {
    for name in ["gear", "vase", "mug"] {
        let path = format!("{}/models/suite/{name}.glb", env!("CARGO_MANIFEST_DIR"));
        let (mesh, spots) = spread(import(Path::new(&path), 1.0).unwrap().0, 400);
        let [thin, thick] = [0.0035, 0.007].map(|radius_m| touched(&mesh, &spots, radius_m));
        let count = |is_touched: &[bool]| is_touched.iter().filter(|&&is| is).count();
        assert!(count(&thin) > count(&thick) && count(&thin) < 400, "{name}");
        let lost = thick.iter().zip(&thin).filter(|(thick, thin)| **thick && !**thin).count();
        assert_eq!(lost, 0, "{name}");
    }
}

/// A ball of radius R on a table: a finger of radius r that touches it where the normal is n has
/// its lowest point at (R + r) n_z - r above the ball's centre, and the table is at -R.
#[test]
fn what_the_object_stands_on_is_in_the_way() {
    let (ball_m, radius_m) = (0.05, 0.007);
    let (mesh, spots) = spread(sphere_mesh(point(0.0, 0.0, 0.2), ball_m, 40), 2000);
    let axis_w = tip_first(&Finger::default());
    let reach = FingerReach { radius_m, axis_w: &axis_w, lowest_m: Some(0.2 - ball_m) };
    let limit = (radius_m - ball_m) / (radius_m + ball_m);
    for (spot, is_touched) in spots.iter().zip(reach.reachable(&mesh, &spots)) {
        let up = (spot.point.z - 0.2) / ball_m;
        // A face tilts by up to half of one of its 40 rings.
        if (up - limit).abs() > 0.05 {
            assert_eq!(is_touched, up > limit, "{up}");
        }
    }
}

/// The bottom of a well 30 mm wide and 60 mm deep is reachable tip first, but not with a finger
/// across the approach.
#[test]
fn the_finger_behind_the_tip_must_fit_too() {
    let well = boxes(&[
        [[0.0, 0.0, 0.0], [0.05, 0.05, 0.01]],
        [[0.0, 0.0, 0.01], [0.01, 0.05, 0.07]],
        [[0.04, 0.0, 0.01], [0.05, 0.05, 0.07]],
        [[0.01, 0.0, 0.01], [0.04, 0.01, 0.07]],
        [[0.01, 0.04, 0.01], [0.04, 0.05, 0.07]],
    ]);
    let mesh = MeshBvh::new(well);
    let corners = |i| mesh.mesh().corners(i);
    let ground = (0..mesh.mesh().triangles().len())
        .find(|&i| corners(i).iter().all(|corner| corner.z == 0.01))
        .unwrap();
    let spot = [SurfacePoint { point: point(0.025, 0.025, 0.01), triangle: ground as u32 }];
    let first = tip_first(&Finger::default());
    let across = |ahead: &UnitVector3<f64>| {
        ahead.cross(&Vector3::new(0.3, 0.5, 0.8)).normalize() * Finger::default().length_m
    };
    let reach = FingerReach { radius_m: 0.007, axis_w: &first, lowest_m: None };
    assert_eq!(reach.reachable(&mesh, &spot), [true]);
    assert_eq!(FingerReach { axis_w: &across, ..reach }.reachable(&mesh, &spot), [false]);
}
