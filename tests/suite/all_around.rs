//! Tests of bodies that touch a whole object from all sides: contacts, roll of the finger,
//! unreachable directions, and reached targets.

use crate::common::shapes::sphere_mesh;
use crate::common::shipped::{contact, environment, scene};
use nalgebra::{Point3, Vector3};
use palpate::backend::{Backend, Fault};
use palpate::error::InputError;
use palpate::explore::evidence::End;
use palpate::explore::probe::Probe;
use palpate::explore::probe::servo::ArmReach;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::low_discrepancy::direction;
use palpate::geometry::report::MeshReport;
use palpate::sim::environment::ObjectShape;
use palpate::sim::kinematic::KinematicBackend;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::{Aim, Zone};
use std::sync::Arc;

const MIDDLE_W: [f64; 3] = [0.0, -0.65, 0.5];
const RADIUS_M: f64 = 0.05;

/// Builds the environment of `scene` with a sphere as the object.
fn with_sphere(scene: Scene) -> Result<Arc<Environment>, InputError> {
    let bvh = MeshBvh::new(sphere_mesh(MIDDLE_W.into(), RADIUS_M, 60));
    let report = Box::<MeshReport>::default();
    Environment::with_shape(scene, ObjectShape::Mesh { bvh, report }).map(Arc::new)
}

fn around(name: &str, sets: &[&str]) -> Arc<Environment> {
    with_sphere(scene(name, sets)).unwrap()
}

/// Directions to the faces, edges and corners of a cube.
fn outwards() -> impl Iterator<Item = Vector3<f64>> {
    let steps = || [-1.0, 0.0, 1.0].into_iter();
    let all = steps().flat_map(move |x| steps().flat_map(move |y| steps().map(move |z| [x, y, z])));
    all.map(Vector3::from).filter(|outward| outward.norm() > 0.5)
}

/// The finger's error on any side is at most its error on the one side of a zone, here the zone in
/// front, where the sphere slopes in all directions.
#[test]
fn a_soft_finger_feels_a_sphere_from_all_sides_as_well_as_from_one() {
    let off_m = |p_w: &Point3<f64>| ((p_w - Point3::from(MIDDLE_W)).norm() - RADIUS_M).abs();
    let mut one = scene("container_around_finger.toml", &[]);
    (one.whole_object, one.zone) = (None, Some(Zone::new([-0.03, 0.03], Some([0.47, 0.53]))));
    let one = with_sphere(one).unwrap();
    let mut probe = Simulator::new(Arc::clone(&one)).unwrap().probe(1).unwrap();
    let touches = one.task().zone().unwrap().grid(4).into_iter().map(|place| {
        let approach = one.task().approach(&place.into()).unwrap();
        off_m(&contact(probe.touch(&approach).unwrap()).p_wc)
    });
    let worst_m = touches.fold(0.0, f64::max);
    let all = around("container_around_finger.toml", &[]);
    let mut probe = Simulator::new(Arc::clone(&all)).unwrap().probe(1).unwrap();
    for outward_w in outwards() {
        let aim = Aim::against(MIDDLE_W.into(), &outward_w);
        let found = contact(probe.touch(&all.task().approach(&aim.into()).unwrap()).unwrap());
        let found_m = off_m(&found.p_wc);
        assert!(found_m < worst_m, "{outward_w:?}: {found_m}, of a zone {worst_m}");
        assert!((found.p_wc - Point3::from(MIDDLE_W)).dot(&outward_w) > 0.0, "{outward_w:?}");
    }
}

#[test]
fn the_finger_is_rolled_only_where_it_must_be_and_always_the_same() {
    let free = around("container_around.toml", &[]);
    let low = around("container_around.toml", &["whole_object.lowest_m=0.45"]);
    let mut rolled = 0;
    for i in 0..200 {
        let outward_w = direction(i, 200);
        let aim = Aim::against(MIDDLE_W.into(), &outward_w);
        assert!(free.task().is_reachable(&aim) && free.task().is_probably_reachable(&aim));
        let unrolled = free.task().approach(&aim.into()).unwrap();
        assert!((unrolled.r_wa * Vector3::z()).z > -1e-12);
        let approach = low.task().approach(&aim.into());
        assert_eq!(low.task().is_reachable(&aim), approach.is_some());
        if let Some(approach) = approach {
            assert_eq!(Some(approach), low.task().approach(&aim.into()));
            let angle_rad = approach.r_wa.angle_to(&unrolled.r_wa);
            rolled += usize::from(angle_rad > 1e-9);
            let steps = angle_rad.to_degrees() / 45.0;
            assert!((steps - steps.round()).abs() < 1e-6, "{steps}");
        }
    }
    assert!(rolled > 0);
}

/// Below the support neither the hull may move nor a touch may start.
#[test]
fn nothing_goes_below_what_the_object_stands_on() {
    for name in ["container_around.toml", "container_around_finger.toml"] {
        let environment = around(name, &["whole_object.lowest_m=0.45"]);
        let (task, finger) = (environment.task(), &environment.scene().finger);
        let below = Aim::against(MIDDLE_W.into(), &-Vector3::z());
        assert!(!task.is_reachable(&below) && !task.is_probably_reachable(&below));
        assert!(!task.contains(&below.into()) && task.approach(&below.into()).is_none());
        let mut probe = Simulator::new(Arc::clone(&environment)).unwrap().probe(1).unwrap();
        let mut touched = 0;
        for i in (0..60).step_by(3) {
            let aim = Aim::against(MIDDLE_W.into(), &direction(i, 60));
            if task.is_reachable(&aim) {
                let approach = task.approach(&aim.into()).unwrap();
                let outcome = probe.touch(&approach).unwrap();
                touched += usize::from(outcome.contact().is_some());
                let tip_m = outcome.free().map_or(1.0, |free| free.p_wt.z);
                let lowest_m = tip_m - finger.drop_m(&approach.r_wa);
                assert!(lowest_m > 0.45 - 1e-9, "{i}: {lowest_m}");
            }
        }
        assert!(touched > 5);
        let notice = Simulator::new(environment).unwrap().notices();
        assert!(notice.iter().any(|notice| notice.to_string().contains("below")), "{notice:?}");
    }
}

/// An arm reaches every target that it reports as reachable, in any order; without redundancy near
/// the singularities of its wrist too.
#[test]
fn an_arm_comes_to_all_that_it_reaches() {
    let sets = ["simulator=\"kinematic\""];
    assert!(comes_to_all("container_around_pa10.toml", &sets) >= 10);
    let standing = ["whole_object.lowest_m=0.4", "object.position_m=[0, -0.76, 0.5]"];
    for model in ["ur5e", "iiwa14"] {
        let arm = format!("arm={{ model = \"{model}\" }}");
        let sets = [sets[0], standing[0], standing[1], &arm];
        assert!(comes_to_all("container_around.toml", &sets) >= 4, "{model}");
    }
}

/// Touches the object from each of 40 directions that the arm reports as reachable; returns their
/// number.
fn comes_to_all(name: &str, sets: &[&str]) -> usize {
    let environment = environment(name, sets);
    let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
    assert!(simulator.check_reach().is_ok());
    let task = environment.task();
    let middle_w = task.ball().unwrap().centre_w;
    let mut probe = simulator.probe(1).unwrap();
    let mut reached = 0;
    for i in 0..40 {
        let aim = Aim::against(middle_w, &direction((i * 17) % 40, 40));
        if task.is_reachable(&aim) {
            reached += 1;
            let touch = probe.touch(&task.approach(&aim.into()).unwrap());
            let end = touch.as_ref().map(|outcome| outcome.end);
            assert_eq!(end, Ok(End::Contact), "{name} {aim:?}: {touch:?}");
        }
    }
    assert!(reached < 40);
    reached
}

/// Arm of `scenes/container_around_pa10.toml` at rest at these joints, rad, without contact.
fn standing_at(q: [f64; 7]) -> Box<dyn Backend> {
    let home = format!("arm.home_deg={:?}", q.map(f64::to_degrees));
    let sets = ["simulator=\"kinematic\"", "object.position_m=[0, -3, 0.5]", &home];
    let far = Environment::build(scene("container_around_pa10.toml", &sets)).unwrap();
    Box::new(KinematicBackend::new(&Arc::new(far)).unwrap())
}

/// Joints after touches from all sides, and the next of 420 directions: elbow on the other side,
/// wrist turned far, shoulder near its limit, behind the object.
const LEFT_AT: [([f64; 7], usize); 6] = [
    ([1.3223, -0.7235, -1.4155, 1.8936, -1.6301, -0.7120, 1.7469], 154),
    ([-1.3248, 1.5450, 1.9588, 1.6553, 3.8247, -0.9869, 1.5909], 196),
    ([1.7677, -1.5965, -1.1097, 1.7269, 3.4990, -1.0048, 0.9062], 202),
    ([-0.9365, 1.0205, 1.1342, 1.1531, 1.2611, 2.1454, 3.9704], 217),
    ([0.2245, 0.1130, 0.3678, 1.8997, -1.5401, 1.8387, 3.6251], 224),
    ([0.4303, 0.4438, 0.0858, 1.6614, -1.9527, 2.3476, 2.7834], 229),
];

/// The arm reaches the target or does not start; the latter only from a pose that it reached by an
/// unchecked movement.
#[test]
fn from_where_a_touch_left_it_an_arm_comes_to_what_it_reaches_or_does_not_move() {
    let environment = environment("container_around_pa10.toml", &["simulator=\"kinematic\""]);
    let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
    let task = environment.task();
    let mut arrived = Vec::new();
    for (q, i) in LEFT_AT {
        let aim = Aim::against(task.ball().unwrap().centre_w, &direction(i, 420));
        assert!(task.is_reachable(&aim), "{i}");
        let mut servo = simulator.servo(standing_at(q), 1).unwrap();
        match servo.touch(&task.approach(&aim.into()).unwrap()) {
            Ok(outcome) if outcome.end == End::Miss => arrived.push(i),
            Err(Fault::NoPath { time_s, .. }) => assert_eq!(time_s, 0.0),
            end => panic!("{i}: {end:?}"),
        }
    }
    assert!(arrived.len() >= 4, "{arrived:?}");
}

/// Only checked movements are made.
#[test]
fn an_arm_that_knows_no_way_does_not_move() {
    let environment = environment("container_around_pa10.toml", &["simulator=\"kinematic\""]);
    let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
    let task = environment.task();
    let ball = task.ball().unwrap();
    let Scene { finger, touch, .. } = environment.scene();
    let mut servo = simulator.servo(simulator.body().unwrap().unwrap(), 1).unwrap();
    let (before_s, mut refused) = (servo.time_s(), 0);
    let reach = ArmReach::new(&environment.robot().unwrap(), touch).unwrap();
    let aims = task.unreached(64).into_iter().map(|side_w| Aim::against(ball.centre_w, &side_w));
    let approaches = aims.map(|aim| ball.approach(&aim, finger, touch.standoff_m, 0.0));
    for approach in approaches.filter(|approach| !reach.reaches(approach)) {
        let end = servo.touch(&approach);
        assert!(matches!(end, Err(Fault::NoPath { .. })), "{end:?}");
        assert_eq!(servo.time_s(), before_s);
        refused += 1;
    }
    assert!(refused > 5, "{refused}");
}

#[test]
fn a_body_that_cannot_go_around_is_refused() {
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_around.toml");
    let error = Scene::load(&path, &["simulator=dynamic".into()]).unwrap_err().to_string();
    assert!(error.contains("[arm]"), "{error}");
    let small = scene("container_around_finger.toml", &["whole_object.radius_m=0.04"]);
    let Err(small) = with_sphere(small) else { panic!("a ball smaller than the object") };
    assert!(small.to_string().contains("reaches 0.05"), "{small}");
    let near = scene("container_around_pa10.toml", &["object.position_m=[0, -0.5, 0.7]"]);
    let Err(near) = Environment::build(near) else { panic!("a tip that begins in the object") };
    assert!(near.to_string().contains("arm.home_deg"), "{near}");
    let far = scene("container_around_pa10.toml", &["object.position_m=[0, -3, 0.5]"]);
    let far = Simulator::new(Arc::new(Environment::build(far).unwrap())).unwrap();
    assert!(far.check_reach().unwrap_err().to_string().contains("64 directions"));
    // An object whose middle is at the height of its table.
    let ball = environment("container_around.toml", &[]).task().ball().copied().unwrap();
    let table = format!("whole_object.lowest_m={}", ball.centre_w.z);
    let table = Simulator::new(environment("container_around.toml", &[&table])).unwrap();
    let error = table.check_reach().unwrap_err().to_string();
    let stated = format!("the finger stays above {:.3} m", ball.centre_w.z);
    assert!(error.contains(&stated) && error.contains("whole_object.lowest_m"), "{error}");
}
