//! Tests of zones that face any side of an object.

use crate::common::shapes::UniformRandom;
use crate::common::shipped::scene;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use palpate::explore::evidence::End;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::Zone;
use proptest::prelude::*;
use std::sync::Arc;

/// Returns the scene with object and zone rotated together about `W`'s origin.
fn turned(scene: &Scene, x_ww: &Isometry3<f64>) -> Scene {
    let pose = |x: Isometry3<f64>| {
        let (roll, pitch, yaw) = x.rotation.euler_angles();
        (x.translation.vector.into(), [roll, pitch, yaw].map(f64::to_degrees))
    };
    let mut scene = scene.clone();
    let object = scene.object.as_mut().unwrap();
    (object.position_m, object.rotation_deg) = pose(x_ww * object.x_wo());
    let zone = scene.zone.as_mut().unwrap();
    (zone.position_m, zone.rotation_deg) = pose(x_ww * zone.x_wz());
    scene
}

/// Contact at each target in the zone's frame: place, height, normal.
fn found(scene: Scene, targets: &[Vec<f64>]) -> Vec<Option<[f64; 6]>> {
    let environment = Arc::new(Environment::build(scene).unwrap());
    let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
    let zone = environment.task().zone().unwrap();
    // Each target has its own body, so that touches are independent.
    let touch = |target: &Vec<f64>| {
        let outcome = (simulator.probe(3).unwrap())
            .touch(&environment.task().approach(&target[..].into()).unwrap())
            .unwrap();
        assert_ne!(outcome.end, End::Overload, "too much force");
        outcome.contact().map(|contact| {
            let place = zone.place(&contact.p_wc);
            let n = zone.x_wz().inverse_transform_vector(&contact.normal_w);
            [place[0], place[1], zone.height_m(&contact.p_wc), n.x, n.y, n.z]
        })
    };
    targets.iter().map(touch).collect()
}

/// Settings of a sensor with smooth counts, so that rounding has no effect.
const STEADY: [&str; 5] = [
    "effects.electrodes.noise=0",
    "effects.electrodes.drift_counts=0",
    "effects.electrodes.quantise=false",
    "effects.fluid.noise_counts=0",
    "effects.fluid.quantise=false",
];

/// The same side of the object, explored from +x and from an oblique direction, gives the same
/// contacts in the zone's frame.
#[test]
fn a_side_is_the_same_from_wherever_it_is_explored() {
    let from_x = Isometry3::rotation(nalgebra::Vector3::z() * -std::f64::consts::FRAC_PI_2);
    let askew = Isometry3::from_parts(
        Translation3::new(0.1, -0.2, 0.05),
        UnitQuaternion::from_euler_angles(0.4, -0.3, 2.1),
    );
    // The rigid hull is exact in any frame. A stage's linear axes are parallel to W's axes, so the
    // soft finger moves equally if the zone's axes are a permutation of W's; in an oblique frame
    // three linear axes brake together.
    for (name, sets, sides) in [
        ("bird.toml", &[][..], &[from_x, askew][..]),
        ("container.toml", &[], &[from_x, askew]),
        ("container_finger.toml", &STEADY, &[from_x]),
    ] {
        let scene = scene(name, sets);
        // Targets avoid round numbers, so that a movement's last tick does not depend on rounding.
        let mut dice = UniformRandom(5);
        let mut share = || 0.5 + 0.45 * dice.roll();
        let targets: Vec<_> =
            (0..12).map(|_| scene.zone.as_ref().unwrap().at(&[share(), share()])).collect();
        let along_y = found(scene.clone(), &targets);
        assert!(along_y.iter().flatten().count() > 8, "{name}: mostly misses");
        for x_ww in sides {
            let other = found(turned(&scene, x_ww), &targets);
            for ((a, b), target) in along_y.iter().zip(&other).zip(&targets) {
                let (Some(a), Some(b)) = (a, b) else {
                    assert_eq!(a.is_some(), b.is_some(), "{name} {target:?}");
                    continue;
                };
                let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-7, "{name} {target:?}: {apart}");
            }
        }
    }
}

#[test]
fn the_truth_and_the_default_depth_turn_with_the_zone() {
    let scene = scene("bird.toml", &[]);
    let x_ww = Isometry3::from_parts(
        Translation3::new(-0.3, 0.4, 0.1),
        UnitQuaternion::from_euler_angles(-0.7, 0.2, 1.3),
    );
    let [along_y, other] = [scene.clone(), turned(&scene, &x_ww)]
        .map(|scene| Arc::new(Environment::build(scene).unwrap()));
    for (a, b) in along_y.task().depth_m().iter().zip(other.task().depth_m()) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    for place in scene.zone.as_ref().unwrap().grid(9) {
        let heights = [&along_y, &other].map(|environment| environment.true_height_m(&place));
        let [Some(a), Some(b)] = heights else { panic!("{heights:?}") };
        assert!((a - b).abs() < 1e-7, "{place:?}: {a} {b}");
    }
}

proptest! {
    /// place and height are the inverse of point, and an approach passes over its place from the
    /// near depth to the far one, for any pose.
    #[test]
    fn a_zones_places_are_where_its_approaches_go(seed in any::<u64>()) {
        let mut dice = UniformRandom(seed);
        let mut zone = Zone::new([-0.2, 0.3], Some([0.1, 0.5]));
        zone.position_m = dice.vector().into();
        zone.rotation_deg = (dice.vector() * 180.0).into();
        zone.datum_y_m = Some(dice.roll());
        zone.depth_m = Some([-0.1, 0.2]);
        let place = zone.at(&[0.5 + 0.5 * dice.roll(), 0.5 + 0.5 * dice.roll()]);
        let height_m = dice.roll();
        let p_w = zone.point(&place, height_m);
        prop_assert!((zone.height_m(&p_w) - height_m).abs() < 1e-12);
        prop_assert!(zone.distance(&zone.place(&p_w), &place) < 1e-11);
        let finger = palpate::robot::Finger::default();
        let task = palpate::task::Task::new(zone.clone(), Default::default(), &finger).unwrap();
        let approach = task.approach(&place.as_slice().into()).unwrap();
        let way = approach.p_far_w - approach.p_near_w;
        prop_assert!((way - approach.direction_w().scale(0.3)).norm() < 1e-12);
        prop_assert!((approach.direction_w().into_inner() - zone.ahead_w().into_inner()).norm() < 1e-15);
        for p_w in [approach.p_near_w, approach.p_far_w] {
            prop_assert!(zone.distance(&zone.place(&p_w), &place) < 1e-11);
        }
        prop_assert!((zone.height_m(&approach.p_near_w) + zone.datum_y_m() - 0.1).abs() < 1e-12);
        let level = approach.project_to_level(&Point3::origin().coords, &approach.p_far_w.coords);
        prop_assert!((level - approach.p_far_w.coords).dot(&approach.direction_w()).abs() < 1e-12);
        prop_assert!(level.cross(&approach.direction_w()).norm() < 1e-12);
    }
}

/// Without a simulator the object's position is unknown, so a zone must give its depth.
#[test]
fn a_zone_without_depth_is_no_task() {
    let finger = palpate::robot::Finger::default();
    let zone = Zone::new([0.0, 1.0], None);
    let error = palpate::task::Task::new(zone, Default::default(), &finger).unwrap_err();
    assert!(error.to_string().contains("zone.depth_m"), "{error}");
}

/// A given depth range must contain the object, and the object must not be in front of it.
#[test]
fn a_depth_range_beside_the_object_is_refused() {
    let build = |set: &str| Environment::build(scene("bird.toml", &[set]));
    let error = build("zone.depth_m=[0.0, 0.1]").err().unwrap().to_string();
    assert!(error.contains("depth"), "{error}");
    // The bird's breast is closer than its middle, the zero of the heights.
    let error = build("zone.depth_m=[0.65, 0.8]").err().unwrap().to_string();
    assert!(error.contains("begins at 0.65 m"), "{error}");
    let own = build("zone.depth_m=[0.4, 0.8]").unwrap();
    assert_eq!(own.task().zone().unwrap().depth_m, Some([0.4, 0.8]));
}
