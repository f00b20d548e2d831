//! Tests of the fingertip's dimensions, its settings, and steps without allocation.

use crate::common::counting::allocations;
use crate::common::shipped::near;
use std::f64::consts::PI;

use crate::common::shapes::*;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use palpate::geometry::bvh::MeshBvh;
use palpate::math::seed::stream;
use palpate::robot::finger::Finger;
use palpate::robot::finger::TipMotion;
use palpate::robot::finger::electrode_table::{normals_t, positions_t};
use palpate::robot::finger::profile::{CORE_M, Profile};
use palpate::sim::finger::samples::spread;
use palpate::sim::finger::{Effects, Fingertip, FingertipState};

#[test]
fn a_step_does_not_allocate_even_if_nobody_reads_the_frames() {
    let tip = Fingertip::new(&Finger::default(), &Effects::all());
    let mut feel = FingertipState::new(&tip, &stream(1, 0, "finger"));
    let bvh = MeshBvh::new(square(0.05, 100));
    let mut press = |tick| {
        let height_m = 8.5e-3 + 1.5e-3 * (f64::from(tick) * 0.01).cos();
        let place = Translation3::new(0.0, 0.0, height_m);
        let motion = TipMotion::at(Isometry3::from_parts(place, UnitQuaternion::identity()));
        feel.step(&tip, &bvh, &motion, 1e-3).unwrap();
    };
    assert_eq!(allocations(|| (0..3000).for_each(&mut press)), 0);
    let kept = std::iter::from_fn(|| feel.frame()).collect::<Vec<_>>();
    assert!(kept.len() <= 105 && kept.len() >= 100, "{}", kept.len());
    near(kept.last().unwrap().time_s, 3.0, 1e-9);
    assert!(kept.windows(2).all(|pair| pair[1].time_s > pair[0].time_s));
}

#[test]
fn electrodes_lie_on_the_core_with_its_normals() {
    for (i, (p, n)) in positions_t(1.0).iter().zip(normals_t()).enumerate() {
        let axis = nalgebra::Point3::new(p.x.min(0.0), 0.0, 0.0);
        if (6..10).contains(&i) {
            near(p.coords.dot(&n), 4.3994e-3, 1e-6);
        } else {
            near((p - axis).norm(), CORE_M, 1e-6);
            near((p - axis).angle(&n).to_degrees(), 0.0, 0.1);
        }
    }
}

#[test]
fn effects_are_tables_with_ranges_and_unknown_keys_are_refused() {
    let text = toml::to_string(&Effects::all()).unwrap();
    assert_eq!(toml::from_str::<Effects>(&text).unwrap(), Effects::all());
    assert!(text.contains("[fluid.vibration]"), "{text}");
    assert_eq!(toml::from_str::<Effects>("").unwrap(), Effects::default());
    assert!(toml::from_str::<Effects>("[skin]\nmodulus_kpa = 3.0").is_err());
}

#[test]
fn areas_of_the_samples_add_up_to_the_skin() {
    let finger = Finger::default();
    let (r, l) = (finger.radius_m, finger.length_m);
    let area = |profile: &Profile, count| -> f64 {
        spread(profile, count).iter().map(|sample| sample.area_m2).sum()
    };
    near(area(&Profile::capsule(&finger), 500), 2.0 * PI * r * (l + r), 1e-8);
    let profile = Profile::biotac(&finger);
    near(area(&profile, 500) / area(&profile, 200_000), 1.0, 0.005);
    for sample in spread(&profile, 500) {
        assert!(sample.normal.dot(&sample.direction) > 0.5, "{sample:?}");
    }
}

#[test]
fn the_profile_has_the_measures_of_the_sensor() {
    let profile = Profile::biotac(&Finger::default());
    let outer_mm = |x_mm: f64, x: f64, y: f64, z: f64| {
        profile.layers(x_mm * 1e-3, &Vector3::new(x, y, z).normalize()).outer_m * 1e3
    };
    near(outer_mm(-6.0, 0.0, 1.0, 0.0), 7.02, 0.03);
    near(outer_mm(-7.0, 0.0, 0.0, -1.0), 8.31, 0.03);
    near(outer_mm(0.0, 0.0, 0.0, -1.0), 8.02, 0.03);
    near(outer_mm(0.0, 0.5, 0.0, -0.866), 8.30, 0.05);
    near(outer_mm(0.0, 1.0, 0.0, -1.0), 8.72, 0.05);
    near(outer_mm(0.0, 1.0, 0.0, 0.0), 6.65, 0.03);
    let gap_mm = |x_mm: f64, degrees: f64| {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        profile.layers(x_mm * 1e-3, &Vector3::new(0.0, sin, -cos)).gap_m * 1e3
    };
    near(gap_mm(-2.8, 0.0), 1.54, 0.05);
    near(gap_mm(-13.6, 0.0), 1.35, 0.05);
    near(gap_mm(-6.2, 44.0), 1.22, 0.05);
    near(gap_mm(-8.0, 77.3), 0.58, 0.05);
}
