//! Tests of the gel with a camera: its depth images and forces against exact and published ones,
//! and the patches that the sensor locates.

use crate::common::shapes::{box_mesh, point, sphere_mesh};
use crate::common::shipped::{environment, scene};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use palpate::robot::Finger;
use palpate::robot::sensor::{
    DepthImage, DepthPatch, Doubt, GelPad, Sample, SensedContact, Sensor,
};
use palpate::sim::finger::ContactLoad;
use palpate::sim::finger::effects::gel::GelEffect;
use palpate::sim::finger::gel::{Gel, GelState};
use palpate::sim::simulator::Simulator;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::mesh::Mesh;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

fn finger() -> Finger {
    Finger { radius_m: 12e-3, ..Finger::default() }
}

/// A pad without noise.
fn exact() -> GelEffect {
    GelEffect { noise_m: 0.0, scale_sd: 0.0, ..GelEffect::default() }
}

/// Pose of `T` at which the middle of the pad, which faces −y, is `depth_m` below y = 0, turned by
/// `tilt` about the middle.
fn at_depth(depth_m: f64, tilt: UnitQuaternion<f64>) -> Isometry3<f64> {
    let finger = finger();
    let x_wp = Isometry3::from_parts(
        Translation3::new(0.0, -depth_m, 0.0),
        tilt * finger.r_at() * GelPad::x_tp(&finger).rotation,
    );
    x_wp * GelPad::x_tp(&finger).inverse()
}

/// Returns load and depth image of a trial's first frame.
fn press(
    effect: &GelEffect,
    object: &MeshBvh,
    x_wt: &Isometry3<f64>,
    seed: u64,
) -> (ContactLoad, DepthImage) {
    let mut state = GelState::new(effect, ChaCha8Rng::seed_from_u64(seed));
    let load = Gel::new(&finger(), effect).step(object, x_wt, effect.frame_s, &mut state);
    (load.unwrap(), state.image().unwrap())
}

/// A ball of `radius_m` whose top is at y = 0.
fn ball(radius_m: f64) -> MeshBvh {
    MeshBvh::new(sphere_mesh(point(0.0, -radius_m, 0.0), radius_m, 160))
}

/// A box whose upper face, at y = 0, begins at x = `from_m`.
fn plate(from_m: f64) -> Mesh {
    box_mesh(point(from_m, -0.05, -0.05), point(0.05, 0.0, 0.05))
}

/// Without spread, every pixel shows how deep the object is in the unloaded pad, by rays.
#[test]
fn without_spread_the_image_is_the_exact_penetration() {
    let environment = environment("bird.toml", &[]);
    let bvh = MeshBvh::new(environment.mesh().unwrap().clone());
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut indented, mut worst_m) = (0, 0.0_f64);
    for dome_m in [0.0, 0.06] {
        let effect = GelEffect { spread: false, dome_m, pixels: [48, 36], ..exact() };
        let pad = effect.pad();
        for _ in 0..20 {
            let turn = UnitQuaternion::from_euler_angles(
                rng.random_range(-0.3..0.3),
                0.0,
                rng.random_range(-0.3..0.3),
            );
            let from =
                Point3::new(rng.random_range(-0.02..0.02), 0.0, rng.random_range(0.46..0.52));
            let down = -Vector3::y_axis();
            let Some(top) = bvh.ray(&from, &down, 2.0) else { continue };
            let lifted = Translation3::from(top.point.coords);
            let x_wt = lifted * at_depth(rng.random_range(0.2e-3..1e-3), turn);
            let (load, image) = press(&effect, &bvh, &x_wt, 1);
            if load.indentation_max_m > 4e-3 || load.is_core_loaded {
                continue;
            }
            let x_wp = x_wt * GelPad::x_tp(&finger());
            let outwards = x_wp * Vector3::z_axis();
            for (i, depth_m) in image.depths_m.iter().enumerate() {
                let [x, y] = pad.pixel_m(image.pixels, i);
                let surface_m = pad.surface_m([x, y]);
                let back_m = 6e-3;
                let behind = x_wp * Point3::new(x, y, surface_m - back_m);
                let hit = bvh.ray(&behind, &outwards, back_m);
                let inside_m = hit.map_or(0.0, |hit| back_m - hit.distance_m);
                indented += i32::from(inside_m > 0.0);
                let off_m = (inside_m - f64::from(*depth_m)).abs();
                worst_m = worst_m.max(off_m);
            }
        }
    }
    println!("{indented} pixels indented, worst {worst_m:e} m");
    assert!(indented > 2000 && worst_m < 1e-6, "{indented} {worst_m}");
}

/// The force of a ball is that of Hertz 1881, 4/3 E* √R d^1.5, and the derivative of its energy.
#[test]
fn a_ball_presses_as_hertz_says() {
    let effect = exact();
    let modulus_pa = effect.modulus_pa;
    for radius_m in [3e-3, 6e-3, 12e-3] {
        let ball = ball(radius_m);
        for depth_m in [0.1e-3, 0.3e-3, 1e-3] {
            let at = |depth_m: f64| {
                press(&effect, &ball, &at_depth(depth_m, UnitQuaternion::identity()), 1)
            };
            let (load, image) = at(depth_m);
            let hertz_n = 4.0 / 3.0 * modulus_pa * radius_m.sqrt() * depth_m.powf(1.5);
            let ratio = load.force_n.norm() / hertz_n;
            let deepest_m = image.depths_m.iter().copied().fold(0.0, f32::max);
            let step_m = 0.02 * depth_m;
            let [low_j, high_j] = [-step_m, step_m].map(|step_m| at(depth_m + step_m).0.energy_j);
            let slope_n = (high_j - low_j) / (2.0 * step_m);
            println!(
                "R {radius_m} d {depth_m}: {ratio:.4} of Hertz, {:.4} of the energy's slope, deepest \
                 {deepest_m:e}",
                load.force_n.norm() / slope_n
            );
            assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
            assert!((load.force_n.norm() / slope_n - 1.0).abs() < 0.05);
            // The nearest pixel is 0.17 mm beside the ball's top.
            let beside_m = 0.17e-3_f64.powi(2) / (2.0 * radius_m);
            assert!(
                (f64::from(deepest_m) - depth_m).abs() < beside_m + 4e-4 * radius_m,
                "{deepest_m}"
            );
            // Around the contact the surface is below that of the object, and falls as a²/r² says.
            assert!(load.area_m2 > 0.0 && load.normal_t.dot(&finger().direction_t()) < -0.999);
        }
    }
}

/// Reads as many images at rest and pressed as a touch does.
fn locate(effect: &GelEffect, object: &MeshBvh, x_wt: &Isometry3<f64>, seed: u64) -> Located {
    let far = Translation3::new(0.0, 0.1, 0.0) * x_wt;
    let gel = Gel::new(&finger(), effect);
    let mut state = GelState::new(effect, ChaCha8Rng::seed_from_u64(seed));
    let mut sensor = DepthPatch::new(effect.pad(), &finger());
    let mut time_s = 0.0;
    for pose in [far, *x_wt] {
        sensor.clear_samples();
        for _ in 0..5 {
            time_s += effect.frame_s;
            gel.step(object, &pose, time_s, &mut state).unwrap();
            sensor.push(time_s, &[Sample::Depth(state.image().unwrap())], None);
        }
        if pose == far {
            assert_eq!(sensor.is_touching(), None);
            sensor.tare();
        }
    }
    let is_touching = sensor.is_touching() == Some(true);
    Located { found: sensor.locate(&finger(), 0.0), is_touching }
}

struct Located {
    found: Result<SensedContact, Doubt>,
    is_touching: bool,
}

/// All points of a patch.
fn points(found: &SensedContact) -> impl Iterator<Item = &SensedContact> {
    std::iter::once(found).chain(&found.patch)
}

/// Without noise every point of a patch is on the object.
#[test]
fn a_patch_is_on_the_object() {
    let effect = exact();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for object in [ball(8e-3), ball(40e-3), MeshBvh::new(plate(-0.05))] {
        let (mut worst_m, mut worst_rad) = (0.0_f64, 0.0_f64);
        for _ in 0..30 {
            let turn =
                Vector3::new(rng.random_range(-0.03..0.03), 0.0, rng.random_range(-0.03..0.03));
            let x_wt = at_depth(rng.random_range(0.3e-3..0.8e-3), UnitQuaternion::new(turn));
            let located = locate(&effect, &object, &x_wt, 1);
            assert!(located.is_touching);
            let found = located.found.unwrap();
            let p_w = x_wt * found.p_tc;
            let on = object.closest_point(&p_w);
            worst_m = worst_m.max(on.distance_m);
            let normal =
                palpate_geometry::primitives::normal(&object.mesh().corners(on.triangle as usize));
            worst_rad = worst_rad.max((x_wt.rotation * found.normal_t).angle(&normal));
            for point in points(&found) {
                let off_m = object.closest_point(&(x_wt * point.p_tc)).distance_m;
                assert!(off_m < 5e-6, "{off_m}");
            }
        }
        println!("worst {worst_m:e} m, {worst_rad:e} rad");
        assert!(worst_m < 5e-6 && worst_rad < 0.02, "{worst_m} {worst_rad}");
    }
}

const TOUCHES: u64 = 100;

/// The stated deviation holds 95 % of the contacts at any depth.
#[test]
fn the_stated_deviation_holds_95_percent() {
    let mut wrong = Vec::new();
    for (name, object) in
        [("ball", ball(8e-3)), ("large ball", ball(40e-3)), ("plate", MeshBvh::new(plate(-0.05)))]
    {
        for depth_m in [0.2e-3, 0.5e-3] {
            let effect = GelEffect { pixels: [48, 36], ..GelEffect::default() };
            let mut rng = ChaCha8Rng::seed_from_u64(9);
            let (mut held, mut all) = ([0, 0], [0, 0]);
            for seed in 0..TOUCHES {
                let turn =
                    Vector3::new(rng.random_range(-0.02..0.02), 0.0, rng.random_range(-0.02..0.02));
                let x_wt = at_depth(depth_m, UnitQuaternion::new(turn));
                let Ok(found) = locate(&effect, &object, &x_wt, seed).found else { continue };
                for (i, point) in points(&found).enumerate() {
                    let off_m = object.closest_point(&(x_wt * point.p_tc)).distance_m;
                    all[i.min(1)] += 1;
                    held[i.min(1)] += i32::from(off_m < 1.96 * point.sd_m().unwrap());
                }
            }
            let share = [0, 1].map(|i| f64::from(held[i]) / f64::from(all[i]));
            println!("{name} {depth_m}: {all:?} points, {share:.3?} held");
            // Of 100 touches one standard deviation is 2.2 %.
            let is_honest = (0.89..=0.995).contains(&share[0]);
            if !is_honest || 3 * all[0] < 2 * TOUCHES as i32 || (all[1] > 50 && share[1] < 0.89) {
                wrong.push(format!("{name} {depth_m}: {share:.3?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn what_a_pad_cannot_locate_is_named() {
    let effect = GelEffect::default();
    let straight = UnitQuaternion::identity();
    // The object ends under the pad's edge.
    let rim = locate(&effect, &MeshBvh::new(plate(8e-3)), &at_depth(0.5e-3, straight), 1);
    assert_eq!(rim.found.unwrap().doubt, Some(Doubt::OnRim));
    let inner = locate(&effect, &ball(8e-3), &at_depth(0.5e-3, straight), 1);
    assert_eq!(inner.found.unwrap().doubt, None);
    // Nothing on the pad, but the arm feels a load.
    let mut sensor = DepthPatch::new(effect.pad(), &finger());
    let flat = DepthImage { time_s: 0.1, pixels: [8, 8], depths_m: vec![0.0; 64] };
    assert_eq!(sensor.locate(&finger(), 0.0).err(), Some(Doubt::NoSignal));
    sensor.push(0.1, &[Sample::Depth(flat.clone()), Sample::Flag(true)], None);
    assert_eq!(sensor.is_touching(), Some(true));
    assert_eq!(sensor.locate(&finger(), 0.0).err(), Some(Doubt::BesideTip));
    // An image of a wrong size, or of holes alone, changes nothing.
    let torn = DepthImage { pixels: [9, 8], ..flat.clone() };
    let blind = DepthImage { depths_m: vec![f32::NAN; 64], ..flat.clone() };
    sensor.push(0.2, &[Sample::Depth(torn), Sample::Depth(blind), Sample::Flag(false)], None);
    assert_eq!(sensor.is_touching(), None);
    assert!(!sensor.is_overloaded());
    // Metres that are millimetres are far too deep.
    let large = DepthImage { depths_m: vec![0.4; 64], ..flat };
    sensor.push(0.3, &[Sample::Depth(large)], None);
    assert!(sensor.is_overloaded());
}

/// A kinematic finger with a pad touches the container where it is, and says so with a patch.
#[test]
fn a_pad_touches_the_container() {
    let sets = ["simulator=\"kinematic\"", "sensor.depth_patch={}", "touch.press_m=0.0005"];
    let environment = environment("container.toml", &sets);
    let mut probe = Simulator::new(Arc::clone(&environment)).unwrap().probe(0).unwrap();
    let target = environment.task().zone().unwrap().at(&[0.6, 0.5]);
    let approach = environment.task().approach(&target.into()).unwrap();
    let outcome = probe.touch(&approach).unwrap();
    println!("{outcome:?}");
    assert!(outcome.points().len() > 1);
    for point in outcome.points() {
        // The container is an elliptic cylinder of half axes 60 and 40 mm about y = −0.65 m.
        let height_m = 0.04 * (1.0 - (point.p_wc.x / 0.06).powi(2)).sqrt();
        let (off_m, sd_m) = (point.p_wc.y + 0.65 - height_m, point.sd_m().unwrap());
        assert!(off_m.abs() < 3.0 * sd_m + 2e-5, "{off_m} {sd_m}");
    }
}

/// The tests' scene files accept a pad, and refuse one beside a skin.
#[test]
fn a_pad_replaces_the_skin() {
    let digit = scene(
        "container_finger.toml",
        &["sensor.depth_patch={}", "effects={sensor=\"digit\", gel={}}"],
    );
    assert_eq!(digit.effects.gel.unwrap().dome_m, 0.06);
}
