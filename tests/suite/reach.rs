//! Tests of the reachable surface in grooves with a known solution.

use nalgebra::Point3;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::sim::environment::ObjectShape;
use palpate::sim::probe::resting_pose;
use palpate::sim::reach;
use palpate::sim::{Environment, Scene};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::fs;

/// A fingertip of radius 7 mm before the profile y(x), straight along z.
fn environment(profile: &[(f64, f64)], finger: &str) -> Environment {
    let folder = tempfile::tempdir().unwrap();
    let mut mesh = String::new();
    for (x, y) in profile {
        writeln!(mesh, "v {x} {y} -0.05\nv {x} {y} 0.05").unwrap();
    }
    for i in 0..profile.len() - 1 {
        let [a, b, c, d] = [1, 2, 3, 4].map(|corner| 2 * i + corner);
        writeln!(mesh, "f {a} {b} {d}\nf {a} {d} {c}").unwrap();
    }
    fs::write(folder.path().join("profile.obj"), mesh).unwrap();
    let scene = format!(
        "simulator = \"swept\"\n[object]\nmesh = \"profile.obj\"\n[finger]\n{finger}\n[zone]\n\
         x_m = [-0.02, 0.02]\nz_m = [-0.02, 0.02]\n"
    );
    let path = folder.path().join("scene.toml");
    fs::write(&path, scene).unwrap();
    Environment::build(Scene::load(&path, &[]).unwrap()).unwrap()
}

const SPHERE: &str = "radius_m = 0.007\nlength_m = 0";

/// Pairs (x, reachable) along the middle of the zone.
fn across(environment: &Environment) -> Vec<(f64, bool)> {
    let places: Vec<Vec<f64>> = (-190..=190).map(|i| vec![1e-4 * f64::from(i), 0.0]).collect();
    let heights: Vec<_> = places.iter().map(|place| environment.true_height_m(place)).collect();
    let reachable = reach::reachable(environment, &places, &heights, &|_| ());
    places.iter().map(|place| place[0]).zip(reachable).collect()
}

/// A sphere of radius r in a groove y = |x|·tan(φ) touches its sides at r·sin(φ) from the middle;
/// its distance from the side at a nearby x is (x − x₀)²/(2r·cos³φ).
#[test]
fn the_ground_of_a_v_groove_is_out_of_reach() {
    for slope_deg in [20.0f64, 35.0, 50.0] {
        let angle = slope_deg.to_radians();
        let side = 0.06 * angle.tan();
        let environment = environment(&[(-0.06, side), (0.0, 0.0), (0.06, side)], SPHERE);
        let touched = 0.007 * angle.sin();
        let width = |gap_m: f64| (2.0 * gap_m * 0.007 * angle.cos().powi(3)).sqrt();
        for (x, is_reachable) in across(&environment) {
            let inside = touched - x.abs();
            if inside > width(2.5e-4) {
                assert!(!is_reachable, "{slope_deg}: {x} of {touched}");
            }
            // Targets end with the zone, and contacts slightly before.
            if inside < width(0.5e-4) && x.abs() < 0.012 {
                assert!(is_reachable, "{slope_deg}: {x} of {touched}");
            }
        }
    }
}

#[test]
fn a_slot_narrower_than_the_finger_hides_its_ground() {
    let profile =
        [(-0.06, 0.0), (-0.004, 0.0), (-0.0039, -0.01), (0.0039, -0.01), (0.004, 0.0), (0.06, 0.0)];
    for finger in [SPHERE, "radius_m = 0.007\nlength_m = 0.021\npitch_deg = 45"] {
        for (x, is_reachable) in across(&environment(&profile, finger)) {
            assert_eq!(is_reachable, x.abs() > 0.00395, "{finger}: {x}");
        }
    }
    // A finger that fits reaches the bottom, but not the corners.
    for (x, is_reachable) in across(&environment(&profile, "radius_m = 0.001\nlength_m = 0")) {
        if x.abs() < 0.0028 {
            assert!(is_reachable, "{x}");
        }
    }
}

#[test]
fn a_plane_is_all_in_reach_and_nothing_is_beside_the_object() {
    for slope in [0.0, 0.5] {
        let environment = environment(&[(-0.06, -0.06 * slope), (0.06, 0.06 * slope)], SPHERE);
        let inner = across(&environment).into_iter().filter(|(x, _)| x.abs() < 0.015);
        assert!(inner.into_iter().all(|(_, is_reachable)| is_reachable), "{slope}");
    }
    let short = environment(&[(-0.06, 0.0), (0.01, 0.0)], SPHERE);
    assert!(across(&short).iter().all(|(x, is_reachable)| *is_reachable == (*x < 0.01 + 1e-9)));
}

/// The reference implementation lowers every finger and tests all of them.
fn by_brute_force(environment: &Environment, places: &[Vec<f64>]) -> Vec<bool> {
    let (zone, finger) = (environment.task().zone().unwrap(), &environment.scene().finger);
    let steps: Vec<f64> = (zone.extents_m().iter())
        .map(|side_m| (side_m * 8.0 / finger.radius_m).clamp(1.0, 128.0).ceil())
        .collect();
    let missed_m = |side_m: f64, steps: f64| (side_m / steps).powi(2) / (8.0 * finger.radius_m);
    let missed_m: f64 = zone.extents_m().iter().zip(&steps).map(|(&m, &n)| missed_m(m, n)).sum();
    let x_zw = zone.x_wz().inverse();
    let mut fingers = Vec::new();
    for j in 0..=steps[1] as usize {
        for i in 0..=steps[0] as usize {
            let target = zone.at(&[i as f64 / steps[0], j as f64 / steps[1]]);
            let rest = resting_pose(
                environment,
                &environment.task().approach(&target.as_slice().into()).unwrap(),
            );
            fingers.extend(rest.map(|rest| (target, (x_zw * rest.p_wt).y)));
        }
    }
    let is_reachable = |place: &Vec<f64>| {
        let height_m = environment.true_height_m(place)?;
        let envelope_y_m = fingers.iter().filter_map(|(target, tip_y_m)| {
            let front_m = finger.front_m(place[0] - target[0], place[1] - target[1])?;
            Some(tip_y_m + front_m)
        });
        let lowest_y_m = envelope_y_m.fold(f64::INFINITY, f64::min);
        Some(lowest_y_m - zone.datum_y_m() - height_m <= 1e-4 + missed_m)
    };
    places.iter().map(|place| is_reachable(place).unwrap_or(false)).collect()
}

/// Bumps and dents of any height on a rotated grid with gaps: slopes, overhangs, holes.
fn random_relief(rng: &mut ChaCha8Rng, rough_m: f64) -> Mesh {
    const SIDE: usize = 14;
    let mut number = || rng.random::<f64>() - 0.5;
    let vertices: Vec<Point3<f64>> = (0..SIDE * SIDE)
        .map(|k| {
            let at = |i: usize| (i as f64 / (SIDE - 1) as f64 - 0.5) * 0.05;
            let (x, z) = (at(k % SIDE) + number() * 0.004, at(k / SIDE) + number() * 0.004);
            Point3::new(x, rough_m * number(), z)
        })
        .collect();
    let triangles: Vec<[u32; 3]> = (0..(SIDE - 1) * (SIDE - 1))
        .flat_map(|k| {
            let corner = (k / (SIDE - 1) * SIDE + k % (SIDE - 1)) as u32;
            let [right, up] = [corner + 1, corner + SIDE as u32];
            [[corner, right, up], [right, up + 1, up]]
        })
        .filter(|_| rng.random::<f64>() > 0.1)
        .collect();
    Mesh::new(&vertices, &triangles).unwrap().0
}

#[test]
fn reach_is_what_letting_every_finger_down_finds() {
    let rng = &mut ChaCha8Rng::seed_from_u64(16);
    let mut counts = [0; 2];
    for finger in [SPHERE, "radius_m = 0.003\nlength_m = 0.01\npitch_deg = 60", "pitch_deg = -30"] {
        for rough_m in [0.001, 0.006, 0.03] {
            let profile = environment(&[(-0.06, 0.0), (0.06, 0.0)], finger);
            let mut scene = profile.scene().clone();
            scene.zone.as_mut().unwrap().depth_m = None;
            scene.zone.as_mut().unwrap().rotation_deg = [0.0, 0.0, 20.0 * rng.random::<f64>()];
            let bvh = MeshBvh::new(random_relief(rng, rough_m));
            let ObjectShape::Mesh { report, .. } = profile.shape() else { unreachable!() };
            let shape = ObjectShape::Mesh { bvh, report: report.clone() };
            let environment = Environment::with_shape(scene, shape).unwrap();
            let places = environment.task().zone().unwrap().grid(15);
            let heights: Vec<_> =
                places.iter().map(|place| environment.true_height_m(place)).collect();
            let fast = reach::reachable(&environment, &places, &heights, &|_| ());
            assert_eq!(fast, by_brute_force(&environment, &places), "{finger} {rough_m}");
            fast.iter().for_each(|&is_reachable| counts[usize::from(is_reachable)] += 1);
        }
    }
    assert!(counts.iter().all(|&count| count > 300), "{counts:?}");
}
