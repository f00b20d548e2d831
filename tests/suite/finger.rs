//! Tests of the soft fingertip against closed forms, energy, a reference implementation and edge
//! cases.

use crate::common::shipped::near;
use std::f64::consts::PI;
use std::sync::Arc;

use crate::common::shapes::*;
use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use palpate::backend::Fault;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::math::seed::stream;
use palpate::robot::finger::Finger;
use palpate::robot::finger::TipMotion;
use palpate::robot::finger::profile::Profile;
use palpate::sim::finger::effects::skin::{Skin, SkinEffect};
use palpate::sim::finger::foundation::Column;
use palpate::sim::finger::load::PressError;
use palpate::sim::finger::plate::direction_t;
use palpate::sim::finger::{ContactLoad, Effects, Fingertip, FingertipState};
use proptest::prelude::*;

const CAVITY_PA_M3: f64 = 1e13;

/// Pose with the origin of `T` at `origin_w` and its direction `towards_t` down.
fn over(origin_w: Vector3<f64>, towards_t: &Vector3<f64>) -> Isometry3<f64> {
    let turn = Rotation3::rotation_between(towards_t, &-Vector3::z()).unwrap();
    Isometry3::from_parts(origin_w.into(), UnitQuaternion::from_rotation_matrix(&turn))
}

fn plane() -> MeshBvh {
    MeshBvh::new(square(0.1, 2))
}

fn biotac(samples: usize, cavity_pa_m3: f64) -> Skin {
    let effect = SkinEffect { samples, ..SkinEffect::default() };
    Skin::new(&Profile::biotac(&Finger::default()), &effect, cavity_pa_m3)
}

fn press(skin: &Skin, bvh: &MeshBvh, x_wt: &Isometry3<f64>) -> ContactLoad {
    skin.press(bvh, x_wt, &mut skin.relaxed()).unwrap()
}

/// Stiffness of a dry column until its gap closes.
fn winkler(column: &Column) -> f64 {
    1.0 / (1.0 / column.skin_pa_m + 1.0 / column.flatten_pa_m)
}

/// Springs k along the radii of a sphere R, pressed by δ on a plane at h = R − δ: F = 2 π k R² (R
/// ln(R/h) − δ).
fn sphere_n(k: f64, r: f64, depth: f64) -> f64 {
    2.0 * PI * k * r * r * (r * (r / (r - depth)).ln() - depth)
}

/// The same per length of a cylinder: F = 2 k R (R artanh(sin φ) − h tan φ), cos φ = h/R.
fn cylinder_n_m(k: f64, r: f64, depth: f64) -> f64 {
    let h = r - depth;
    let edge = (h / r).acos();
    2.0 * k * r * (r * edge.sin().atanh() - h * edge.tan())
}

#[test]
fn a_dry_capsule_on_a_plane_obeys_winkler_and_converges() {
    let cases = [
        (Finger { length_m: 0.0, ..Finger::default() }, Vector3::x()),
        (Finger::default(), -Vector3::z()),
    ];
    for (finger, towards_t) in cases {
        let error = |samples| {
            let effect = SkinEffect { samples, ..SkinEffect::default() };
            let skin = Skin::new(&Profile::capsule(&finger), &effect, 0.0);
            let k = winkler(skin.column());
            let depths = [0.1e-3, 0.15e-3, 0.2e-3, 0.25e-3, 0.3e-3];
            let errors = depths.map(|depth| {
                let r = finger.radius_m;
                let expected = if finger.length_m == 0.0 {
                    sphere_n(k, r, depth)
                } else {
                    finger.length_m * cylinder_n_m(k, r, depth) + 0.5 * sphere_n(k, r, depth)
                };
                let pose = over(Vector3::new(0.0, 0.0, r - depth), &towards_t);
                let load = press(&skin, &plane(), &pose);
                let force_w = pose.rotation * load.force_n;
                near(force_w.xy().norm(), 0.0, 1e-9);
                (force_w.z / expected - 1.0).abs()
            });
            errors.iter().sum::<f64>() / errors.len() as f64
        };
        let (coarse, fine) = (error(250), error(64_000));
        let order = (coarse / fine).ln() / 256f64.ln();
        println!("error {coarse:.2e} to {fine:.2e}, order {order:.2} in the samples");
        assert!(fine < 0.01 && order > 0.5, "{coarse} {fine} {order}");
    }
}

#[test]
fn force_grows_with_depth_and_stays_finite_down_to_the_axis() {
    let skin = biotac(500, CAVITY_PA_M3);
    for (pitch, roll) in [(0.0, 0.0), (0.5, 0.3), (1.2, -0.4), (0.0, 1.2)] {
        let towards_t = direction_t(pitch, roll);
        let mut last = ContactLoad::default();
        for step in 0..90 {
            let height = 9e-3 - 1e-4 * f64::from(step);
            let load = press(&skin, &plane(), &over(Vector3::new(0.0, 0.0, height), &towards_t));
            assert!(load.force_n.norm().is_finite() && load.energy_j >= last.energy_j);
            assert!(load.force_n.norm() >= last.force_n.norm(), "{load:?} {last:?}");
            assert!(load.pressure_pa >= last.pressure_pa && load.force_n.dot(&towards_t) <= 0.0);
            last = load;
        }
        assert!(last.force_n.norm() > 100.0 && last.is_core_loaded);
    }
}

#[test]
fn force_and_torque_are_the_gradient_of_the_energy() {
    let bvh = MeshBvh::new(sphere_mesh(point(0.0, 0.0, -0.03), 0.03, 200));
    for cavity in [0.0, CAVITY_PA_M3] {
        let skin = biotac(4000, cavity);
        let pose = over(Vector3::new(0.0, 2e-3, 6.6e-3), &direction_t(0.3, 0.2));
        let load = press(&skin, &bvh, &pose);
        let step = 2e-6;
        for axis in 0..3 {
            let mut shift = Vector3::zeros();
            shift[axis] = step;
            let slope = |make: &dyn Fn(Vector3<f64>) -> Isometry3<f64>| {
                let [up, down] =
                    [shift, -shift].map(|shift| press(&skin, &bvh, &(pose * make(shift))));
                -(up.energy_j - down.energy_j) / (2.0 * step)
            };
            let moved = slope(&|shift| Translation3::from(shift).into());
            near(moved, load.force_n[axis], 0.01 * load.force_n.norm());
            // Rotates by step / 10 mm, so that points move as far as above.
            let turned = slope(&|shift| Isometry3::rotation(shift * 100.0)) / 100.0;
            near(turned, load.torque_nm[axis], 0.01 * load.force_n.norm() * 10e-3);
        }
    }
}

#[test]
fn the_fluid_keeps_its_volume_and_pushes_the_free_skin_out() {
    let skin = biotac(500, CAVITY_PA_M3);
    let mut pressed = skin.relaxed();
    let pose = over(Vector3::new(0.0, 0.0, 7e-3), &direction_t(0.1, 0.0));
    let load = skin.press(&plane(), &pose, &mut pressed).unwrap();
    let wet =
        skin.samples().iter().zip(&pressed.inward_m).filter(|(sample, _)| sample.layers.has_fluid);
    let volume_m3: f64 = wet.clone().map(|(sample, inward_m)| sample.section_m2() * inward_m).sum();
    near(volume_m3, load.pressure_pa / CAVITY_PA_M3, 1e-16);
    assert!(load.pressure_pa > 1e3 && load.displaced_m3 > 1e-8);
    let least = wet.map(|(_, inward_m)| *inward_m).fold(0.0, f64::min);
    assert!(least < -5e-5 && least > -1e-3, "{least}");
    // Beyond ε of the contact there is no force.
    let far = over(Vector3::new(0.0, 0.0, 0.02), &direction_t(0.1, 0.0));
    assert_eq!(skin.press(&plane(), &far, &mut pressed), Ok(ContactLoad::default()));
    assert!(pressed.inward_m.iter().chain(&pressed.indentation_m).all(|&moved| moved == 0.0));
}

/// Wrench by brute force: all triangles for every ray, bisection for the pressure.
fn slow_wrench(
    skin: &Skin,
    mesh: &Mesh,
    x_wt: &Isometry3<f64>,
    cavity: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    let column = skin.column();
    let hits: Vec<_> = (skin.samples().iter())
        .map(|sample| {
            let (o, d) = (x_wt * sample.start, x_wt.rotation * sample.direction.into_inner());
            let reach = sample.layers.outer_m + 0.7e-3;
            mesh.iter_corners()
                .filter_map(|corners| slow_ray(&o, &d, &corners, 0.0).map(|s| (s, corners)))
                .filter(|(s, _)| *s <= reach)
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .map(|(s, [a, b, c])| (s, (b - a).cross(&(c - a)).normalize()))
        })
        .collect();
    let respond = |i: usize, pressure: f64| {
        let layers = &skin.samples()[i].layers;
        let depth = hits[i].map_or(f64::NEG_INFINITY, |(s, _)| layers.outer_m - s);
        let felt = if layers.has_fluid { pressure } else { 0.0 };
        column.respond(depth, layers.gap_m, felt)
    };
    let (mut low, mut high) = (0.0, 1e7);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let volume: f64 = (0..hits.len())
            .filter(|&i| skin.samples()[i].layers.has_fluid)
            .map(|i| skin.samples()[i].section_m2() * respond(i, middle).inward_m)
            .sum();
        if volume > middle / cavity { low = middle } else { high = middle }
    }
    let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
    for (i, sample) in skin.samples().iter().enumerate() {
        let Some((s, normal_w)) = hits[i] else { continue };
        let mut normal = x_wt.rotation.inverse() * normal_w;
        let slope = normal.dot(&sample.direction);
        normal *= -slope.signum();
        let push =
            normal * (respond(i, low).stress_pa * sample.section_m2() / slope.abs().max(0.2));
        force += push;
        torque += (sample.start + sample.direction.scale(s)).coords.cross(&push);
    }
    (force, torque)
}

#[test]
fn the_wrench_is_that_of_a_slow_twin() {
    let mesh = Arc::new(sphere_mesh(point(0.0, 0.0, -0.02), 0.02, 24));
    let bvh = MeshBvh::new(mesh.clone());
    let skin = biotac(300, CAVITY_PA_M3);
    let mut dice = UniformRandom(5);
    for _ in 0..12 {
        let towards_t = direction_t(0.6 + 0.6 * dice.roll(), 0.8 * dice.roll());
        let pose = over(Vector3::new(3e-3 * dice.roll(), 3e-3 * dice.roll(), 6.5e-3), &towards_t);
        let load = press(&skin, &bvh, &pose);
        let (force, torque) = slow_wrench(&skin, &mesh, &pose, CAVITY_PA_M3);
        assert!(load.force_n.norm() > 0.01);
        near((load.force_n - force).norm(), 0.0, 1e-9 * force.norm());
        near((load.torque_nm - torque).norm(), 0.0, 1e-9 * force.norm());
    }
}

/// Work of a motion on the finger and by a load, over a closed path without initial and final
/// contact.
fn work_of_a_cycle(effects: &Effects, slide_m: f64) -> (f64, f64) {
    let tip = Fingertip::new(&Finger::default(), effects);
    let mut feel = FingertipState::new(&tip, &stream(1, 0, "finger"));
    let bvh = plane();
    let towards_t = direction_t(0.4, 0.1);
    let place = |t: f64| {
        let down = (PI * t).sin().powi(2);
        Vector3::new(slide_m * (2.0 * PI * t).sin(), slide_m * t, 9e-3 - 2e-3 * down)
    };
    let (mut work_j, mut peak_j): (f64, f64) = (0.0, 0.0);
    let steps = 4000;
    let mut last = Vector3::zeros();
    for i in 1..=steps {
        let [before, now] = [i - 1, i].map(|i| place(f64::from(i) / f64::from(steps)));
        let motion =
            TipMotion { linear_w: (now - before) / 1e-3, ..TipMotion::at(over(now, &towards_t)) };
        let load = feel.step(&tip, &bvh, &motion, 1e-3).unwrap();
        let force_w = motion.x_wt.rotation * load.force_n;
        work_j += 0.5 * (force_w + last).dot(&(now - before));
        last = force_w;
        peak_j = peak_j.max(load.energy_j);
    }
    (work_j, peak_j)
}

#[test]
fn a_press_and_release_creates_no_energy() {
    let creeping = Effects { friction: None, ..Effects::all() };
    let smooth = Effects { creep: None, ..creeping.clone() };
    let (work, peak) = work_of_a_cycle(&smooth, 0.0);
    near(work / peak, 0.0, 1e-3);
    let (work, peak) = work_of_a_cycle(&smooth, 2e-3);
    near(work / peak, 0.0, 1e-3);
    let (work, peak) = work_of_a_cycle(&creeping, 0.0);
    assert!(work < -0.01 * peak, "creep took {work} of {peak} J");
    let (work, peak) = work_of_a_cycle(&Effects::all(), 2e-3);
    assert!(work < -0.1 * peak, "friction took {work} of {peak} J");
}

#[test]
fn friction_sticks_then_slips_at_coulombs_limit_against_the_motion() {
    let effects = Effects::all();
    let mu = effects.friction.as_ref().unwrap().coefficient;
    let tip = Fingertip::new(&Finger::default(), &effects);
    let mut feel = FingertipState::new(&tip, &stream(1, 0, "finger"));
    let mut last = 0.0;
    for i in 0..200 {
        let x = 1e-5 * f64::from(i);
        let motion = TipMotion {
            linear_w: Vector3::new(0.01, 0.0, 0.0),
            ..TipMotion::at(over(Vector3::new(x, 0.0, 7.2e-3), &-Vector3::z()))
        };
        let load = feel.step(&tip, &plane(), &motion, 1e-3).unwrap();
        let force_w = motion.x_wt.rotation * load.force_n;
        let ratio = -force_w.x / force_w.z;
        assert!(ratio >= last - 1e-9 && ratio <= mu + 1e-9, "{ratio} after {last}");
        last = ratio;
    }
    near(last, mu, 1e-9);
}

#[test]
fn bad_numbers_and_a_finger_inside_are_errors_that_leave_the_state() {
    let tip = Fingertip::new(&Finger::default(), &Effects { creep: None, ..Effects::all() });
    let bvh = MeshBvh::new(box_mesh(point(-0.1, -0.1, -0.1), point(0.1, 0.1, 0.0)));
    let mut feel = FingertipState::new(&tip, &stream(1, 0, "finger"));
    let good = TipMotion::at(over(Vector3::new(0.0, 0.0, 7e-3), &-Vector3::z()));
    let felt = feel.step(&tip, &bvh, &good, 1e-3).unwrap();
    let mut nan = good;
    nan.x_wt.translation.vector.x = f64::NAN;
    let mut wild = good;
    wild.angular_w.z = f64::INFINITY;
    for (motion, dt_s) in [(nan, 1e-3), (wild, 1e-3), (good, f64::NAN), (good, -1.0)] {
        let error = feel.step(&tip, &bvh, &motion, dt_s).unwrap_err();
        assert!(matches!(error, Fault::Diverged { .. }), "{error}");
        assert!(error.to_string().contains("0.001 s"), "{error}");
    }
    let deep = TipMotion::at(over(Vector3::new(0.0, 0.0, -0.03), &-Vector3::z()));
    let error = feel.step(&tip, &bvh, &deep, 1e-3).unwrap_err();
    assert!(matches!(error, Fault::Inside { time_s: 0.001, .. }), "{error}");
    assert_eq!(feel.step(&tip, &bvh, &good, 1e-3).unwrap(), felt);
}

#[test]
fn two_contacts_at_once_squeeze_the_finger_evenly() {
    let skin = biotac(2000, CAVITY_PA_M3);
    let slab = |low: f64| [[-0.1, low, -0.1], [0.1, low + 0.05, 0.1]];
    let slabs = MeshBvh::new(boxes(&[slab(0.0065), slab(-0.0565)]));
    let load = press(&skin, &slabs, &Isometry3::identity());
    assert!(load.pressure_pa > 100.0 && load.area_m2 > 1e-5, "{load:?}");
    assert!(load.force_n.y.abs() < 0.05 * load.energy_j / 0.5e-3, "{load:?}");
}

#[test]
fn a_needle_between_samples_and_a_mesh_with_holes_are_finite() {
    let skin = biotac(500, CAVITY_PA_M3);
    let needle = MeshBvh::new(box_mesh(point(-1e-5, -1e-5, -0.05), point(1e-5, 1e-5, 0.0)));
    let whole = sphere_mesh(point(0.0, 0.0, -0.02), 0.02, 40);
    let holed: Vec<Triangle> = whole.iter_corners().step_by(3).collect();
    let holed = MeshBvh::new(soup(&holed).unwrap());
    for bvh in [needle, holed] {
        let mut dice = UniformRandom(9);
        for _ in 0..200 {
            let pose =
                over(dice.vector() * 4e-3 + Vector3::z() * 6e-3, &direction_t(0.4, dice.roll()));
            match skin.press(&bvh, &pose, &mut skin.relaxed()) {
                Ok(load) => assert!(
                    load.force_n.norm().is_finite() && load.torque_nm.norm().is_finite(),
                    "{load:?}"
                ),
                Err(error) => assert_eq!(error, PressError::Inside),
            }
        }
    }
}

#[test]
fn an_absent_skin_feels_nothing() {
    let tip = Fingertip::new(&Finger::default(), &Effects::default());
    let mut feel = FingertipState::new(&tip, &stream(1, 0, "finger"));
    let motion = TipMotion::at(over(Vector3::new(0.0, 0.0, 7e-3), &-Vector3::z()));
    assert_eq!(feel.step(&tip, &plane(), &motion, 0.1), Ok(ContactLoad::default()));
    assert_eq!(feel.frame(), None);
    assert!(feel.skin_state().is_none());
}

#[test]
fn a_fingertip_is_shared_and_a_trial_moves_between_threads() {
    fn shared<T: Send + Sync>() {}
    fn moved<T: Send>() {}
    shared::<Fingertip>();
    moved::<FingertipState>();
}

#[test]
fn culling_queries_agree_with_the_nearest_point() {
    let bvh = MeshBvh::new(sphere_mesh(Point3::origin(), 1.0, 20));
    let mut dice = UniformRandom(3);
    for _ in 0..2000 {
        let p = Point3::from(dice.vector() * 2.0);
        let radius = dice.roll().abs();
        assert_eq!(bvh.touches(&p, radius), bvh.closest_point(&p).distance_m <= radius);
        if (p.coords.norm() - 1.0).abs() > 0.05 {
            assert_eq!(bvh.is_enclosed(&p), p.coords.norm() < 1.0);
        }
    }
}

proptest! {
    #[test]
    fn any_pose_is_answered(
        place in prop::array::uniform3(-0.03..0.03f64), turn in prop::array::uniform3(-3.2..3.2f64),
    ) {
        let bvh = MeshBvh::new(sphere_mesh(Point3::origin(), 0.015, 12));
        let pose = Isometry3::new(place.into(), turn.into());
        let skin = biotac(100, CAVITY_PA_M3);
        match skin.press(&bvh, &pose, &mut skin.relaxed()) {
            Ok(load) => prop_assert!(load.force_n.norm().is_finite() && load.pressure_pa >= 0.0),
            Err(error) => prop_assert_eq!(error, PressError::Inside),
        }
    }
}
