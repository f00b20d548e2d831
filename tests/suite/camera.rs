//! Tests of depth cameras: exact depths, each error, the rigid error of the pose, and files.

use crate::common::shipped::{environment, scene};
use crate::common::touched::{belief, rmse_m, settings, touches};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use palpate::experiment::{Experiment, Simulation, real_robot};
use palpate::explore::belief::HeightField;
use palpate::explore::evidence::{Contact, End, Evidence};
use palpate::explore::view::{
    CameraAccuracy, PixelNoise, PoseError, RigidError, SeenSurface, View, corrected_pose, thin,
};
use palpate::math::seed;
use palpate::ros::settings::RosSettings;
use palpate::sim::Environment;
use palpate::sim::probe::exact_probe;
use palpate_geometry::bvh::MeshBvh;
use proptest::prelude::*;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::sync::Arc;

/// A camera in front of the container, to its right and above it, of few pixels.
const PLACE: &str =
    "camera={ model = \"d405\", position_m = [0.15, -0.40, 0.6], pixels = [240, 135]";

fn built(errors: &str) -> Arc<Environment> {
    environment("container.toml", &[&format!("{PLACE}{errors} }}")])
}

fn look(environment: &Environment, number: u64) -> View {
    environment.look(0, &mut seed::stream(number, 0, "view")).unwrap()
}

/// Distance of each point of a view from the object, by the stated pose.
fn distances_m(environment: &Environment, view: &View) -> Vec<f64> {
    let mesh = MeshBvh::new(environment.mesh().unwrap().clone());
    let distance_m = |p_c: &Point3<f64>| mesh.closest_point(&(view.x_wc * p_c)).distance_m;
    view.points_c.iter().map(distance_m).collect()
}

#[test]
fn a_camera_without_errors_sees_the_exact_surface() {
    let environment = built("");
    let view = look(&environment, 0);
    assert!(view.points_c.len() > 2000, "{}", view.points_c.len());
    assert!(distances_m(&environment, &view).iter().all(|m| *m < 1e-9));
    // Its seed means nothing.
    assert_eq!(view, look(&environment, 1));
}

#[test]
fn each_error_does_what_it_says() {
    let all = look(&built(""), 0).points_c.len();
    let steep = look(&built(", holes = { grazing_deg = 40 }"), 0);
    assert!(steep.points_c.len() < all * 9 / 10, "{} of {all}", steep.points_c.len());
    let stepped = look(&built(", quantisation = { step_m = 0.001 }"), 0);
    let is_whole = |p_c: &Point3<f64>| ((p_c.z / 1e-3).round() * 1e-3 - p_c.z).abs() < 1e-12;
    assert!(stepped.points_c.iter().all(is_whole));
    let environment = built(", noise = { noise_m = 0.001, noise_ratio = 0, noise_px = 1 }");
    let exact = look(&built(""), 0);
    let noisy = look(&environment, 0);
    let off: Vec<f64> =
        noisy.points_c.iter().zip(&exact.points_c).map(|(a, b)| a.z - b.z).collect();
    let sd_m = (off.iter().map(|m| m * m).sum::<f64>() / off.len() as f64).sqrt();
    assert!((sd_m / 1e-3 - 1.0).abs() < 0.05, "{sd_m}");
    // Flying pixels are between both sides of an edge: beside the object.
    let environment = built(", flying_pixels = { band_px = 2, share = 1.0 }");
    let flying = distances_m(&environment, &look(&environment, 0));
    assert!(flying.iter().filter(|m| **m > 1e-3).count() > 5);
    // The arm at home hides part of the object from a camera behind it.
    let behind = |hidden: bool| {
        let camera = format!(
            "camera={{ model = \"d405\", position_m = [0, -0.3, 0.55], is_hidden_by_arm = {hidden} }}"
        );
        look(&environment_of_arm(&camera), 0).points_c.len()
    };
    assert!(behind(true) < behind(false), "{} of {}", behind(true), behind(false));
}

fn environment_of_arm(camera: &str) -> Arc<Environment> {
    environment("container_pa10.toml", &[camera, "simulator=\"kinematic\""])
}

proptest! {
    /// A point p that a camera with a wrong pose sees is where the formula of its error says.
    #[test]
    fn a_corrected_pose_undoes_its_error(
        p in prop::array::uniform3(-1.0..1.0_f64),
        pivot in prop::array::uniform3(-1.0..1.0_f64),
        shift in prop::array::uniform3(-0.1..0.1_f64),
        turn in prop::array::uniform3(-0.3..0.3_f64),
        pose in prop::array::uniform6(-1.0..1.0_f64),
    ) {
        let [x, y, z, a, b, c] = pose;
        let rotation = UnitQuaternion::from_euler_angles(a, b, c);
        let stated = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
        let (p, pivot) = (Point3::from(p), Point3::from(pivot));
        let (shift, turn) = (Vector3::from(shift), Vector3::from(turn));
        let actual = corrected_pose(&stated, &pivot, &shift, &turn);
        let seen = stated * actual.inverse_transform_point(&p);
        let expected = pivot + UnitQuaternion::from_scaled_axis(turn) * (p - pivot) + shift;
        prop_assert!((seen - expected).norm() < 1e-12);
    }
}

/// Touches the container at `count` places, and returns the belief that has seen `view`.
fn touched(environment: &Arc<Environment>, view: &View, count: usize) -> HeightField {
    let touches = touches(environment, count);
    assert!(touches.iter().all(|(_, outcome)| outcome.contact().is_some()));
    belief(environment, Some(view), &touches)
}

/// The errors of the pose are found within their stated deviations, and the view corrected by them
/// shows the surface; also errors of 10 mm and 3°, of which a few are far off along the container.
#[test]
fn the_rigid_error_is_found_within_its_deviation() {
    for (position_m, turn_deg) in [(0.003, 0.7), (0.010, 3.0)] {
        let errors = format!(
            ", noise = {{}}, pose_error = {{ position_sd_m = [{position_m}, {position_m}, {position_m}], \
             rotation_sd_deg = [{turn_deg}, {turn_deg}, {turn_deg}] }}"
        );
        let environment = built(&errors);
        let (mut squares, mut count, mut worst_mm) = (0.0, 0.0, 0.0_f64);
        for number in 0..12 {
            let mut random = seed::stream(number, 0, "view");
            let drawn: [f64; 6] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
            let field = touched(&environment, &look(&environment, number), 8);
            let RigidError { shift_m, shift_sd_m, turn_deg: turns, turn_sd_deg, .. } =
                field.rigid_errors().remove(0);
            for axis in 0..3 {
                let shift = (shift_m[axis] - position_m * drawn[axis]) / shift_sd_m[axis];
                let turn = (turns[axis] - turn_deg * drawn[axis + 3]) / turn_sd_deg[axis];
                squares += shift * shift + turn * turn;
                count += 2.0;
            }
            worst_mm = worst_mm.max(1e3 * rmse_m(&environment, &field));
        }
        let rms = (squares / count).sqrt();
        println!(
            "{position_m} m, {turn_deg}°: errors {rms:.2} deviations, worst RMSE {worst_mm:.2} mm"
        );
        assert!(rms < if turn_deg > 1.0 { 2.0 } else { 1.5 }, "{rms}");
        assert!(worst_mm < 1.5, "{worst_mm} mm");
    }
}

/// Registration to contacts on the seen part finds the errors of the pose within their stated
/// deviations over 200 draws; contacts elsewhere say nothing. Of errors of 10 mm and 3°, which eight
/// contacts hardly determine along a container, a few are far off.
#[test]
fn a_view_is_registered_to_contacts() {
    for (position_m, turn_deg, least) in [(0.003, 0.7, 0.92), (0.010, 3.0, 0.88)] {
        let errors = format!(
            ", pixels = [240, 135], noise = {{}}, pose_error = {{ position_sd_m = [{position_m}, \
             {position_m}, {position_m}], rotation_sd_deg = [{turn_deg}, {turn_deg}, {turn_deg}] }}"
        );
        let camera =
            format!("camera={{ model = \"d405\", position_m = [0.15, -0.40, 0.6]{errors} }}");
        let environment = environment("container_around.toml", &[&camera]);
        let mesh = MeshBvh::new(environment.mesh().unwrap().clone());
        let (mut squares, mut within, mut count) = (0.0, 0.0, 0.0);
        for number in 0..200 {
            let view = look(&environment, number);
            let mut random = seed::stream(number, 0, "view");
            let drawn: [f64; 6] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
            let mut seen = SeenSurface::new(&view, |_: &Point3<f64>| true, 120, |n| **n);
            let nowhere = |_: usize, _: &Point3<f64>, _: f64| f64::NEG_INFINITY;
            seen.align(&[], 0, 0, nowhere);
            let unknown = seen.rigid_error();
            assert_eq!((unknown.shift_m, unknown.shift_sd_m), ([0.0; 3], [position_m; 3]));
            let contacts: Vec<Contact> = (0..8)
                .filter_map(|_| {
                    let p_c = view.points_c[random.random_range(0..view.points_c.len())];
                    let ahead = view.x_wc.rotation * UnitVector3::new_normalize(p_c.coords);
                    let eye_w = view.x_wc.translation.vector.into();
                    mesh.ray(&eye_w, &ahead, 2.0).map(|hit| Contact::new(hit.point, hit.normal))
                })
                .collect();
            seen.align(&contacts, 0, 0, nowhere);
            let RigidError { shift_m, shift_sd_m, turn_deg: turns, turn_sd_deg, .. } =
                seen.rigid_error();
            for i in 0..6 {
                let off = match i {
                    0..3 => (shift_m[i] - position_m * drawn[i]) / shift_sd_m[i],
                    _ => (turns[i - 3] - turn_deg * drawn[i]) / turn_sd_deg[i - 3],
                };
                squares += off * off;
                within += f64::from(u8::from(off.abs() < 1.96));
                count += 1.0;
            }
        }
        let rms = (squares / count).sqrt();
        println!("{position_m} m, {turn_deg}°: {rms:.2} deviations, {:.3} within", within / count);
        assert!(rms < 2.0 && within / count > least, "{rms} {}", within / count);
    }
}

/// Small and large images of a plane keep most of their points, and its place as exactly as
/// their noise allows.
#[test]
fn images_of_any_size_are_thinned() {
    for side in [16_usize, 30, 45, 64, 90, 128, 200, 400] {
        let mut random = seed::stream(side as u64, 0, "plane");
        let noise = PixelNoise { noise_m: 1e-3, noise_ratio: 0.0, noise_px: 1 };
        let place = |i: usize| (i as f64 - 0.5 * side as f64) / 340.0;
        let point = |i: usize| {
            let noise: f64 = StandardNormal.sample(&mut random);
            Point3::from(
                Vector3::new(place(i % side), place(i / side), 1.0) * (0.33 + 1e-3 * noise),
            )
        };
        let points_c: Vec<Point3<f64>> = (0..side * side).map(point).collect();
        let accuracy = CameraAccuracy { noise, pose_error: PoseError::NONE };
        let (x_wc, pivot_w) = (Isometry3::identity(), Point3::origin());
        let view = View { x_wc, points_c, image: None, pivot_w, accuracy };
        let elements = thin(&view, |_| true, 120);
        let kept: usize = elements.iter().map(|element| element.count).sum();
        assert!(kept * 10 > side * side * 7, "{side}: {kept}");
        assert!(elements.len() <= 168, "{side}: {}", elements.len());
        for element in &elements {
            let off = (element.p_c.z - 0.33) / element.sd_m;
            assert!(off.abs() < 6.0, "{side}: {off}");
        }
    }
}

/// A view of a thin pole, a few pixels wide, has finite surface elements.
#[test]
fn a_pole_a_few_pixels_wide_is_seen() {
    let mut random = seed::stream(4, 0, "pole");
    for width in 1..8_usize {
        let mut points_c = Vec::new();
        for i in 0..width * 200 {
            let noise: f64 = StandardNormal.sample(&mut random);
            let ray = Vector3::new((i % width) as f64 / 340.0, (i / width) as f64 / 340.0, 1.0);
            points_c.push(Point3::from(ray * (0.33 + 1e-3 * noise)));
        }
        let noise = PixelNoise { noise_m: 1e-3, noise_ratio: 0.0, noise_px: 1 };
        let accuracy = CameraAccuracy { noise, pose_error: PoseError::NONE };
        let (x_wc, pivot_w) = (Isometry3::identity(), Point3::origin());
        let view = View { x_wc, points_c, image: None, pivot_w, accuracy };
        for element in thin(&view, |_| true, 120) {
            assert!(element.sd_m > 0.0 && element.sd_m.is_finite(), "{width}: {element:?}");
            assert!(element.p_c.coords.iter().all(|x| x.is_finite()), "{width}: {element:?}");
        }
    }
}

/// Two views of a whole object leave much less error than the finger alone, and the row
/// says where the cameras were.
#[test]
fn views_help_around_a_whole_object() {
    let camera = "camera={ model = \"d405\", position_m = [0.2, -0.40, 0.68], noise = {}, \
                  pose_error = {}, further = { behind = { position_m = [-0.2, -0.9, 0.32] } } }";
    let scene = scene("container_around.toml", &[camera]);
    let names = ["integrated_variance"];
    let errors_mm = [0, 2].map(|views| {
        let mut experiment = Experiment::with_defaults(&scene, &names, 1, 8);
        (experiment.views, experiment.initial_touches) = (views, 2);
        let simulation = Simulation::new(experiment).unwrap();
        let row = simulation.trial(simulation.planner(names[0]).unwrap(), 0);
        assert_eq!((&row.failure, row.views.len()), (&None, views as usize));
        assert!(row.views.iter().all(|view| view.error.as_ref().unwrap().prior_sds < 4.0));
        let shape = row.touches[7].shape.as_ref().unwrap();
        1e3 * shape.chamfer_m.unwrap()
    });
    println!("{errors_mm:?}");
    assert!(errors_mm[1] < 0.7 * errors_mm[0], "{errors_mm:?}");
}

/// Points that are anywhere, a twentieth of all, do not pull the surface.
#[test]
fn outliers_do_not_pull_the_surface() {
    let environment = built(", noise = {}");
    let clean = look(&environment, 0);
    let mut spoilt = clean.clone();
    let mut random = seed::stream(1, 0, "outliers");
    for p_c in &mut spoilt.points_c {
        if random.random_bool(0.05) {
            *p_c *= random.random_range(0.5..1.5);
        }
    }
    let [clean, spoilt] = [clean, spoilt].map(|view| touched(&environment, &view, 2));
    let [clean_m, spoilt_m] = [clean, spoilt].map(|field| rmse_m(&environment, &field));
    println!("{clean_m} {spoilt_m}");
    assert!(spoilt_m < 1.3 * clean_m + 1e-4, "{clean_m} {spoilt_m}");
}

/// A hand before the object, of which the camera sees the back, is left out once the finger went
/// through it; until then the surface is believed to be there.
#[test]
fn a_hand_in_the_view_is_left_out() {
    let camera = "camera={ model = \"d405\", position_m = [0, -0.35, 0.5], noise = {} }";
    // As on a real robot, the zone does not end where the object does.
    let environment = environment("container.toml", &[camera, "zone.depth_m=[0.5, 0.72]"]);
    let clean = look(&environment, 0);
    let mut spoilt = clean.clone();
    let hand_c = clean.x_wc.inverse_transform_point(&Point3::new(0.0, -0.61, 0.5));
    for p_c in &mut spoilt.points_c {
        if (*p_c - hand_c).xy().norm() < 0.025 {
            *p_c *= (hand_c.z - 0.03) / p_c.z;
        }
    }
    let errors = [1, 12].map(|count| {
        [&clean, &spoilt].map(|view| rmse_m(&environment, &touched(&environment, view, count)))
    });
    println!("{errors:?}");
    assert!(errors[0][1] > 5.0 * errors[0][0] && errors[1][1] < 2.0 * errors[1][0], "{errors:?}");
}

/// One touch corrects a whole view: the error of an experiment is that of the view without its
/// rigid error, and the row has what was seen.
#[test]
fn one_touch_corrects_a_view() {
    let errors = ", noise = { noise_m = 0.0015, noise_ratio = 0, noise_px = 1 }, pose_error = { \
                  position_sd_m = [0, 0, 0.003], rotation_sd_deg = [0.7, 0.7, 0] }";
    let camera = format!(
        "camera={{ model = \"d405\", position_m = [0, -0.35, 0.5], pixels = [320, 180]{errors} }}"
    );
    let mut experiment =
        Experiment::with_defaults(&scene("container.toml", &[&camera]), &["active"], 1, 6);
    (experiment.views, experiment.initial_touches, experiment.gp) = (1, 0, settings());
    let simulation = Simulation::new(experiment).unwrap();
    for trial in 0..3 {
        let row = simulation.trial(simulation.planner("active").unwrap(), trial);
        assert_eq!(row.failure, None);
        let rmse_m = |count: usize| row.touches[count - 1].metrics.unwrap().rmse_m;
        println!("{:.2} mm, {:.2} mm", 1e3 * rmse_m(1), 1e3 * rmse_m(6));
        assert!(rmse_m(1) < 2e-3 && rmse_m(6) < 5e-4);
        let error = row.views[0].error.as_ref().unwrap();
        assert!(error.prior_sds < 4.5 && error.shift_sd_m[2] < 0.5e-3, "{error:?}");
        let truth_m = row.views[0].true_error.as_ref().unwrap().shift_m[2];
        assert!((truth_m - error.shift_m[2]).abs() < 5.0 * error.shift_sd_m[2], "{truth_m}");
    }
}

/// A planner takes a further look if it pays: at once if it takes no time, never if it takes an
/// hour.
#[test]
fn a_further_look_is_taken_if_it_pays() {
    let views = |look_s: f64| {
        let camera = format!(
            "camera={{ model = \"d405\", position_m = [0.15, -0.4, 0.6], pixels = [160, 90], \
             noise = {{}}, pose_error = {{}}, look_s = {look_s}, further = {{ beside = {{ \
             position_m = [-0.15, -0.4, 0.6] }} }} }}"
        );
        let scene = scene("container.toml", &[&camera]);
        let mut experiment = Experiment::with_defaults(&scene, &["active"], 1, 2);
        (experiment.views, experiment.initial_touches, experiment.gp) = (1, 0, settings());
        experiment.further_views = 2;
        let simulation = Simulation::new(experiment).unwrap();
        let row = simulation.trial(simulation.planner("active").unwrap(), 0);
        assert_eq!(row.failure, None);
        row.views.iter().map(|view| view.after).collect::<Vec<u32>>()
    };
    // There is one further place.
    assert_eq!(views(0.0), [0, 0]);
    assert_eq!(views(3600.0), [0]);
}

/// A cloud in either frame and an image of depths give the view that they were written from; one in
/// the wrong unit is refused with the depths that it has.
#[test]
fn views_are_read_from_files() {
    let environment = built("");
    let view = look(&environment, 0);
    let folder = tempfile::tempdir().unwrap();
    let cloud = |points: &[Point3<f64>]| {
        let lines: String = points.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
        format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\nend_header\n{lines}",
            points.len()
        )
    };
    let in_world: Vec<Point3<f64>> = view.points_c.iter().map(|p_c| view.x_wc * p_c).collect();
    let in_mm: Vec<Point3<f64>> = view.points_c.iter().map(|p_c| p_c * 1e3).collect();
    for (name, points, keys) in [
        ("camera.ply", &view.points_c, ""),
        ("world.ply", &in_world, ", frame = \"world\""),
        ("mm.ply", &in_mm, ", unit = \"mm\""),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, cloud(points)).unwrap();
        let read = look(&built(&format!(", file = {path:?}{keys}")), 0);
        assert_eq!(read.points_c.len(), view.points_c.len());
        let off = read.points_c.iter().zip(&view.points_c).map(|(a, b)| (a - b).norm());
        assert!(off.fold(0.0, f64::max) < 1e-9, "{name}");
        assert_eq!(read.image, view.image, "{name}");
    }
    // Without its unit nothing of it is in the zone.
    let path = folder.path().join("mm.ply");
    let camera = format!("{PLACE}, file = {path:?} }}");
    let mut experiment =
        Experiment::with_defaults(&scene("container.toml", &[&camera]), &["active"], 1, 2);
    experiment.views = 1;
    let refused = Simulation::new(experiment).err().unwrap().to_string();
    assert!(refused.contains("check camera.position_m, unit and frame"), "{refused}");
    // An image of depths in tenths of a millimetre.
    let path = folder.path().join("depths.png");
    let mut depths = vec![0_u16; 240 * 135];
    let focal = 120.0 / 43.5_f64.to_radians().tan();
    for p_c in &view.points_c {
        let column = (p_c.x / p_c.z * focal + 119.5).round() as usize;
        let row = (p_c.y / p_c.z * focal + 67.0).round() as usize;
        depths[row * 240 + column] = (p_c.z / 1e-3).round() as u16;
    }
    let mut encoder = png::Encoder::new(std::fs::File::create(&path).unwrap(), 240, 135);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let bytes: Vec<u8> = depths.iter().flat_map(|depth| depth.to_be_bytes()).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
    for keys in ["", ", intrinsics_px = [126.454, 126.454, 119.5, 67.0]"] {
        let read = look(&built(&format!(", file = {path:?}{keys}")), 0);
        assert_eq!(read.points_c.len(), view.points_c.len());
        let off = read.points_c.iter().zip(&view.points_c).map(|(a, b)| (a - b).norm());
        assert!(off.fold(0.0, f64::max) < 1.2e-3);
        let ends = [read.image, view.image].map(|image| image.unwrap().concat());
        let off = ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-4);
    }
}

/// A file has noise, also if the scene states none: surface elements of a cloud are found whatever
/// its noise, and are as far off as they state. A view with its stated noise stays as it is.
#[test]
fn a_file_without_stated_noise_has_the_noise_that_it_shows() {
    let exact = look(&built(""), 0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud.ply");
    for noise_m in [0.0, 1e-4, 5e-4, 2e-3, 5e-3] {
        let mut random = seed::stream(7, 0, "noise");
        let lines: String = (exact.points_c.iter())
            .map(|p| {
                let off: f64 = StandardNormal.sample(&mut random);
                let p = p * (1.0 + noise_m * off / p.z);
                format!("{} {} {}\n", p.x, p.y, p.z)
            })
            .collect();
        let count = exact.points_c.len();
        let cloud = format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty double x\nproperty double y\n\
             property double z\nend_header\n{lines}"
        );
        std::fs::write(&path, cloud).unwrap();
        let environment = built(&format!(", file = {path:?}"));
        let view = look(&environment, 0);
        assert_eq!(view.accuracy.noise, PixelNoise::default());
        let elements = thin(&view, |_| true, 350);
        assert!(elements.len() > 30, "{noise_m}: {}", elements.len());
        let mesh = MeshBvh::new(environment.mesh().unwrap().clone());
        let is_held = |p_c: &Point3<f64>, sd_m: f64| {
            mesh.closest_point(&(view.x_wc * p_c)).distance_m < 2.0 * sd_m
        };
        let held = elements.iter().filter(|element| is_held(&element.p_c, element.sd_m)).count();
        let share = held as f64 / elements.len() as f64;
        assert!(share > 0.9, "{noise_m}: {share}");
    }
    let stated = look(&built(", noise = {}"), 0);
    let doubled = CameraAccuracy {
        noise: PixelNoise {
            noise_ratio: 2.0 * stated.accuracy.noise.noise_ratio,
            ..PixelNoise::default()
        },
        ..stated.accuracy.clone()
    };
    let sds =
        |view: &View| thin(view, |_| true, 350).iter().map(|element| element.sd_m).sum::<f64>();
    // A larger stated noise counts, a smaller one is raised only where it explains too little.
    let halved = CameraAccuracy {
        noise: PixelNoise {
            noise_ratio: 0.25 * stated.accuracy.noise.noise_ratio,
            ..PixelNoise::default()
        },
        ..stated.accuracy.clone()
    };
    let with = |accuracy| View { accuracy, ..stated.clone() };
    assert!(sds(&with(doubled)) > 1.5 * sds(&stated));
    assert!(thin(&with(halved), |_| true, 350).len() > 30);
}

/// Places that a camera saw through count as empty, and are in what a row keeps of the view: the
/// belief that is drawn from a row has the silhouette of the trial's.
#[test]
fn places_seen_through_are_kept() {
    let camera =
        "camera={model=\"d405\",position_m=[0.15,-0.4,0.6],pose_error={},noise={},holes={}}";
    let environment = environment("suite/pipe.toml", &[camera]);
    let (zone, finger) = (environment.task().zone().unwrap(), &environment.scene().finger);
    let field = || HeightField::new(zone.clone(), settings()).with_finger(finger.clone());
    let [mut found, mut drawn] = [field(), field()];
    let seen = SeenSurface::of_region(&look(&environment, 0), environment.task().region());
    let seen = Evidence::from(seen);
    found.add(&seen);
    drawn.add(&serde_json::from_str(&serde_json::to_string(&seen).unwrap()).unwrap());
    let mut probe = exact_probe(Arc::clone(&environment));
    let places = zone.grid(9);
    let mut touch = |place: &Vec<f64>| {
        let approach = environment.task().approach(&place.clone().into()).unwrap();
        probe.touch(&approach).unwrap()
    };
    let touches: Vec<_> = places.iter().map(&mut touch).collect();
    let missed = touches.iter().position(|outcome| outcome.end == End::Miss).unwrap();
    for field in [&mut found, &mut drawn] {
        field.observe(&places[missed].clone().into(), &touches[missed]);
    }
    let [found, drawn] = [&found, &drawn].map(|field| {
        let silhouette = field.surface_evidence().silhouette();
        silhouette.probabilities(places.iter().map(Vec::as_slice))
    });
    assert_eq!(found, drawn);
    let mean = |is_miss: bool| {
        let of =
            touches.iter().zip(&found).filter(|(outcome, _)| (outcome.end == End::Miss) == is_miss);
        let shares: Vec<f64> = of.map(|(_, share)| *share).collect();
        shares.iter().sum::<f64>() / shares.len() as f64
    };
    println!(
        "probability of a surface: {:.2} at contacts, {:.2} at misses",
        mean(false),
        mean(true)
    );
    assert!(mean(false) > mean(true) + 0.2);
}

/// A real robot takes no view from the mesh: it needs the file of its camera.
#[test]
fn a_real_robot_needs_a_real_view() {
    let camera = format!("{PLACE} }}");
    let scene = scene("container.toml", &[&camera]);
    let mut experiment = Experiment::with_defaults(&scene, &["active"], 1, 2);
    experiment.backend.ros2 = Some(RosSettings::default());
    let refused =
        |experiment: &Experiment| real_robot::check(experiment, false).unwrap_err().to_string();
    assert!(!refused(&experiment).contains("scene.camera.file"));
    experiment.views = 1;
    assert!(refused(&experiment).contains("scene.camera.file"));
    experiment.scene.camera.as_mut().unwrap().file = Some("view.ply".into());
    assert!(!refused(&experiment).contains("scene.camera.file"));
}
