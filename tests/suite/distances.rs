//! Tests of distances of convex bodies against brute force, and of the robot's capsules against its
//! model.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use palpate::geometry::distance::{HalfSpace, OrientedBox};
use palpate::geometry::sweep::Capsule;
use palpate::robot::arm::ArmSettings;
use palpate::robot::arm::LinkCapsule;
use palpate::robot::{Finger, Robot};
use proptest::prelude::*;
use std::path::Path;

const STEPS: usize = 200;

fn point() -> impl Strategy<Value = Point3<f64>> {
    // Includes grid corners, so that segments are parallel, intersect or have zero length.
    let free = prop::array::uniform3(-1.0..1.0);
    let grid = prop::array::uniform3(-1i8..=1).prop_map(|p| p.map(f64::from));
    prop_oneof![free, grid].prop_map(Point3::from)
}

fn capsule() -> impl Strategy<Value = Capsule> {
    (point(), point(), 0.0..0.3).prop_map(|(p0_w, p1_w, radius_m)| Capsule { p0_w, p1_w, radius_m })
}

fn along(capsule: &Capsule) -> impl Iterator<Item = Point3<f64>> {
    (0..=STEPS).map(|i| capsule.p0_w + (capsule.p1_w - capsule.p0_w) * (i as f64 / STEPS as f64))
}

/// Half a step of a capsule's axis: the error bound of its nearest sample.
fn coarse_m(capsule: &Capsule) -> f64 {
    (capsule.p1_w - capsule.p0_w).norm() / STEPS as f64
}

proptest! {
    #[test]
    fn capsules_are_as_far_apart_as_their_nearest_points(a in capsule(), b in capsule()) {
        let sampled = along(&a)
            .flat_map(|p| along(&b).map(move |q| (p - q).norm()))
            .fold(f64::INFINITY, f64::min) - a.radius_m - b.radius_m;
        let found = a.to_capsule_m(&b);
        prop_assert!(found <= sampled + 1e-12 && found >= sampled - coarse_m(&a) - coarse_m(&b));
        prop_assert!((found - b.to_capsule_m(&a)).abs() < 1e-12);
    }

    #[test]
    fn a_box_is_as_far_as_its_nearest_point(
        a in capsule(),
        half in prop::array::uniform3(0.0..0.7),
        middle in point(),
        turn in prop::array::uniform3(-3.0..3.0),
    ) {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        let x_wb = Isometry3::from_parts(Translation3::from(middle.coords), turn);
        let half_m = Vector3::from(half);
        let sampled = along(&a)
            .map(|p| {
                let p_b = x_wb.inverse_transform_point(&p).coords;
                p_b.zip_map(&half_m, |p: f64, h: f64| p - p.clamp(-h, h)).norm()
            })
            .fold(f64::INFINITY, f64::min) - a.radius_m;
        let found = a.to_box_m(&OrientedBox { x_wb, half_m });
        prop_assert!(found <= sampled + 1e-12 && found >= sampled - coarse_m(&a));
    }

    #[test]
    fn a_half_space_is_as_far_as_its_nearest_point(a in capsule(), p_w in point()) {
        let outward_w = Vector3::z_axis();
        let sampled =
            along(&a).map(|p| p.z - p_w.z).fold(f64::INFINITY, f64::min) - a.radius_m;
        let found = a.to_half_space_m(&HalfSpace { p_w, outward_w });
        prop_assert!((found - sampled).abs() < 1e-12);
    }
}

pub fn robot(model: &str) -> Robot {
    let chain = ArmSettings { model: model.into(), ..ArmSettings::default() }.chain().unwrap();
    Robot::new(chain, Finger::default(), true)
}

/// Reads `key="a b c"` of a tag.
fn numbers(tag: &str, key: &str) -> Vec<f64> {
    let after = tag.split_once(&format!(" {key}=\"")).unwrap().1;
    after.split('"').next().unwrap().split(' ').map(|text| text.parse().unwrap()).collect()
}

/// Points on the surface of a cylinder or capsule.
fn surface(kind: &str, ends: &[f64], radius_m: f64) -> Vec<Point3<f64>> {
    let [a, b] = [0, 3].map(|i| Point3::new(ends[i], ends[i + 1], ends[i + 2]));
    let axis = (b - a).normalize();
    let beside = if axis.x.abs() < 0.5 { Vector3::x() } else { Vector3::y() };
    let u = axis.cross(&beside).normalize();
    let v = axis.cross(&u);
    let mut points = Vec::new();
    for i in 0..72 {
        let (sin, cos) = (f64::from(i) * 5.0).to_radians().sin_cos();
        let out = u * cos + v * sin;
        for k in 0..=20 {
            points.push(a + (b - a) * (f64::from(k) / 20.0) + out * radius_m);
        }
        for k in 0..=18 {
            let (up, aside) = (f64::from(k) * 5.0).to_radians().sin_cos();
            if kind == "capsule" {
                points.push(a + (out * aside - axis * up) * radius_m);
                points.push(b + (out * aside + axis * up) * radius_m);
            }
        }
    }
    points
}

/// The interlock's capsules contain the model's shapes: it never reports touching links as
/// separate.
#[test]
fn every_shape_of_the_models_lies_within_the_capsules_of_its_link() {
    for (file, model) in [("a.xml", "pa10_a"), ("c.xml", "pa10")] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/pa10").join(file);
        let text = std::fs::read_to_string(path).unwrap();
        let all = robot(model).capsules();
        let (mut link, mut seen) = (0, 0);
        for line in text.lines().map(str::trim) {
            if let Some((_, after)) = line.split_once("<body name=\"") {
                let name = after.split('"').next().unwrap();
                let joints = robot(model).chain.joints;
                link = joints.iter().position(|joint| *joint.name == *name).map_or(0, |i| i + 1);
            }
            let Some((_, tag)) = line.split_once("<geom type=\"") else { continue };
            let (ends, radius_m) = (numbers(tag, "fromto"), numbers(tag, "size")[0]);
            for p in surface(tag.split('"').next().unwrap(), &ends, radius_m) {
                let inside = |one: &&LinkCapsule| {
                    let point = Capsule::sphere(p, 0.0);
                    one.link == link && one.at(&Isometry3::identity()).to_capsule_m(&point) < 1e-9
                };
                assert!(all.iter().any(|one| inside(&one)), "{file}: {line} at {p}");
            }
            seen += 1;
        }
        assert!(seen > 15, "{seen}");
    }
}

proptest! {
    /// No point within a finger's radius of any link moves by more than the bound within which the
    /// interlock skips checks.
    #[test]
    fn no_point_moves_by_more_than_the_joints_reaches_say(
        q in prop::array::uniform8(-1.0f64..1.0),
        by in prop::array::uniform8(-0.5f64..0.5),
    ) {
        let robot = robot("pa10");
        let chain = &robot.chain;
        let start = chain.clamp(&palpate::robot::arm::Joints::from(q.map(|q| 3.0 * q)));
        let end = chain.clamp(&(start + palpate::robot::arm::Joints::from(by)));
        let bound_m = (end - start).abs().dot(&chain.reaches_m(robot.finger.radius_m));
        let (before, after) = (chain.frames(&start), chain.frames(&end));
        for link in robot.capsules() {
            for p in link.ends {
                let moved_m = (after[link.link] * p - before[link.link] * p).norm();
                prop_assert!(moved_m <= bound_m + 1e-12, "{} {moved_m} {bound_m}", link.name);
            }
        }
        prop_assert!((after[7] * chain.flange * chain.tool).translation.vector
            .metric_distance(&chain.forward(&end).translation.vector) < 1e-12);
    }
}
