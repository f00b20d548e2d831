//! Where the finger can touch: grooves whose answer is known.

use palpate::sim::reach;
use palpate::sim::{Environment, Scene};
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
        "body = \"cast\"\n[object]\nmesh = \"profile.obj\"\n[finger]\n{finger}\n[zone]\n\
         x_m = [-0.02, 0.02]\nz_m = [-0.02, 0.02]\n"
    );
    let path = folder.path().join("scene.toml");
    fs::write(&path, scene).unwrap();
    Environment::build(Scene::load(&path, &[]).unwrap()).unwrap()
}

const SPHERE: &str = "radius_m = 0.007\nlength_m = 0";

/// (x, whether it is reachable) along the middle of the zone.
fn across(environment: &Environment) -> Vec<(f64, bool)> {
    let places: Vec<Vec<f64>> = (-190..=190).map(|i| vec![1e-4 * f64::from(i), 0.0]).collect();
    let heights: Vec<_> = places.iter().map(|place| environment.true_height_m(place)).collect();
    let reachable = reach::is_reachable(environment, &places, &heights);
    places.iter().map(|place| place[0]).zip(reachable).collect()
}

/// A sphere of radius r in a groove y = |x|·tan(φ) touches its sides r·sin(φ) from the middle, and
/// stands (x − x₀)²/(2r·cos³φ) off the side at x nearby.
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
            // Targets end with the zone, and contacts a little before.
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
    // A finger that fits reaches the ground, but not into the corners.
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
