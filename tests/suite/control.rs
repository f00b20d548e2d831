//! Tests of the controller: tracking where possible, and limits everywhere.

use crate::common::shipped::anywhere;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use palpate::explore::control::{Controller, Goal, posture};
use palpate::math::seed;
use palpate::robot::arm::ArmError;
use palpate::robot::arm::stage::stage;
use palpate::robot::arm::{ArmSettings, Chain, Joints};
use palpate::robot::finger::Finger;
use palpate::sim::{Environment, Scene};
use proptest::prelude::*;
use std::path::Path;

const PERIOD_S: f64 = 0.004;

fn arm() -> Chain {
    ArmSettings::default().chain().unwrap()
}

fn slides() -> Chain {
    stage([0.0, -0.6, 0.5].into(), Finger::default().r_at())
}

/// Steps the arm exactly as commanded towards `goal(t)` and checks all limits at every tick.
/// Returns the last posture, the largest damping and the last error of the tip.
fn drive(
    chain: &Chain,
    start: Joints,
    ticks: usize,
    goal: impl Fn(f64) -> Goal,
) -> (Joints, f64, f64) {
    let mut controller = Controller::new(chain.clone(), PERIOD_S).unwrap();
    let n = chain.joints.len();
    let (mut q, mut before) = (start, Joints::zeros());
    let (mut damping, mut off): (f64, f64) = (0.0, 0.0);
    for tick in 0..ticks {
        let goal = goal(tick as f64 * PERIOD_S);
        let motion = controller.step(&q.as_slice()[..n], &goal).unwrap();
        for (i, joint) in chain.joints.iter().enumerate() {
            let (qdot, qddot) = (motion.qdot[i], (motion.qdot[i] - before[i]) / PERIOD_S);
            assert!(qdot.abs() <= joint.qdot_limit * (1.0 + 1e-9), "{} {qdot}", joint.name);
            assert!(qddot.abs() <= joint.qddot_limit * (1.0 + 1e-9), "{} {qddot}", joint.name);
        }
        before = motion.qdot;
        damping = damping.max(motion.damping);
        q += motion.qdot * PERIOD_S;
        for (i, joint) in chain.joints.iter().enumerate() {
            let [low, high] = joint.q_limits;
            assert!((low - 1e-9..=high + 1e-9).contains(&q[i]), "{} {} {start}", joint.name, q[i]);
        }
        off = (chain.forward(&q).translation.vector - goal.x_wt.translation.vector).norm();
    }
    (q, damping, off)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..Default::default() })]

    /// Tests any posture, including limits and singularities, and any goal, mostly out of reach,
    /// with velocities beyond any arm.
    #[test]
    fn limits_hold_for_any_goal(
        fractions in prop::array::uniform7(prop_oneof![Just(0.0), Just(1.0), Just(0.5), 0.0..1.0]),
        place in prop::array::uniform3(-3.0..3.0),
        turn in prop::array::uniform3(-3.0..3.0),
        twist in prop::array::uniform6(-10.0..10.0),
        slide in any::<bool>(),
    ) {
        let chain = if slide { slides() } else { arm() };
        let mut q = Joints::zeros();
        for (i, joint) in chain.joints.iter().enumerate() {
            q[i] = joint.q_limits[0] + fractions[i] * (joint.q_limits[1] - joint.q_limits[0]);
        }
        let x_wt = Isometry3::new(Vector3::from(place), Vector3::from(turn));
        drive(&chain, q, 300, |t| Goal {
            x_wt,
            // The sign changes every 0.2 s.
            twist: Vector6::from(twist) * (-1.0_f64).powi((t / 0.2) as i32),
        });
    }
}

/// Moves the tip out along -y at 0.1 m/s until the elbow is straight and beyond, and back.
#[test]
fn a_goal_that_leaves_the_reach_and_returns_is_met_again() {
    let chain = arm();
    let home = chain.forward(&chain.home);
    let (_, damping, off) = drive(&chain, chain.home, 6000, |t| {
        let out = (0.1 * t).min(1.2 - 0.1 * t).max(0.0);
        let speed = if t > 12.0 { 0.0 } else { -0.1 * (6.0 - t).signum() };
        let mut twist = Vector6::zeros();
        twist.y = speed;
        Goal { x_wt: Translation3::new(0.0, -out, 0.0) * home, twist }
    });
    assert!(damping > 0.9, "{damping}");
    assert!(off < 1e-4, "{off}");
}

/// Turns the finger in place until W1 is straight, where S3, E2 and W2 align, and beyond.
#[test]
fn the_wrist_passes_its_singularity() {
    let chain = arm();
    let mut q = chain.home;
    q[5] = 0.3;
    let start = chain.forward(&q);
    let rate = 0.15;
    let (_, damping, off) = drive(&chain, q, 1000, |t| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), (rate * t).min(0.6));
        let x_wt = Isometry3::from_parts(start.translation, turn * start.rotation);
        let mut twist = Vector6::zeros();
        twist[3] = if rate * t < 0.6 { rate } else { 0.0 };
        Goal { x_wt, twist }
    });
    assert!(damping > 0.3, "{damping}");
    assert!(off < 1e-3, "{off}");
}

/// Returns a chain of six joints, without redundancy.
fn six_joints() -> Chain {
    let mut settings = ArmSettings { model: "ur5e".into(), ..ArmSettings::default() };
    settings.complete();
    settings.chain().unwrap()
}

/// Goal of the movement that joint `i` alone makes at `rate` from `from` by `by`, then at rest.
fn turned(chain: &Chain, from: Joints, i: usize, rate: f64, by: f64) -> impl Fn(f64) -> Goal {
    move |t| {
        let (mut q, mut qdot) = (from, Joints::zeros());
        q[i] += (rate * t).min(by);
        qdot[i] = if rate * t < by { rate } else { 0.0 };
        let (x_wt, jacobian) = chain.jacobian(&q);
        Goal { x_wt, twist: jacobian * qdot }
    }
}

/// A six-joint arm passes the singularity of its wrist, where two axes align, within its limits.
#[test]
fn six_joints_pass_the_wrists_singularity() {
    let chain = six_joints();
    let mut q = chain.home;
    q[4] = -0.3;
    let (_, damping, off) = drive(&chain, q, 2500, turned(&chain, q, 4, 0.15, 0.6));
    assert!(damping > 0.3, "{damping}");
    assert!(off < 1e-3, "{off}");
}

/// The tip crosses the axis of the base, where the first joint cannot move it sideways: the arm
/// stays within its limits and comes to the goal, or stands still; it never races.
#[test]
fn six_joints_are_not_raced_at_the_shoulders_singularity() {
    let chain = six_joints();
    let mut q = chain.home;
    // The wrist's centre is near the base's axis, above the shoulder.
    (q[1], q[2]) = (-2.3, 1.9);
    let start = chain.forward(&q);
    for side in [0.0, 0.02, 0.1] {
        let away = Vector3::new(-start.translation.x, side - start.translation.y, 0.0);
        let goal = |t: f64| {
            let share = (0.1 * t).min(2.0);
            let mut twist = Vector6::zeros();
            if share < 2.0 {
                twist.fixed_rows_mut::<3>(0).copy_from(&(away * 0.1));
            }
            Goal { x_wt: Translation3::from(away * share) * start, twist }
        };
        let (_, _, off) = drive(&chain, q, 10_000, goal);
        assert!(off.is_finite() && off < 2.0 * away.norm() + 1e-3, "{side}: {off}");
    }
}

/// The elbow is stretched and a goal beyond is met again when it returns.
#[test]
fn six_joints_stretch_the_elbow_and_come_back() {
    let chain = six_joints();
    let home = chain.forward(&chain.home);
    let (_, damping, off) = drive(&chain, chain.home, 9000, |t| {
        let out = (0.05 * t).min(1.0 - 0.05 * t).max(0.0);
        let mut twist = Vector6::zeros();
        twist.y = if t > 20.0 { 0.0 } else { -0.05 * (10.0 - t).signum() };
        Goal { x_wt: Translation3::new(0.0, -out, 0.0) * home, twist }
    });
    assert!(damping > 0.9, "{damping}");
    assert!(off < 1e-3, "{off}");
}

/// Moves the tip towards the base until E1, which alone shortens the arm, is at its limit, and out
/// again.
#[test]
fn a_goal_beyond_a_joints_limit_is_met_again_on_its_way_back() {
    let chain = arm();
    let home = chain.forward(&chain.home);
    let path = |t: f64| (0.08 * t).min(0.8 - 0.08 * t).max(0.0);
    let goal = |t: f64| {
        let mut twist = Vector6::zeros();
        twist.y = if t > 10.0 { 0.0 } else { 0.08 * (5.0 - t).signum() };
        Goal { x_wt: Translation3::new(0.0, path(t), 0.0) * home, twist }
    };
    let (inside, _, away) = drive(&chain, chain.home, 1250, goal);
    assert!(away > 0.05, "{away}");
    assert!(chain.joints[3].q_limits[1] - inside[3] < 0.05, "{}", inside[3].to_degrees());
    let (_, _, off) = drive(&chain, chain.home, 5000, goal);
    assert!(off < 1e-4, "{off}");
}

/// Tests an upright arm: all axes lie in one plane, so no direction along the arm can be commanded.
#[test]
fn the_arm_leaves_its_upright_posture() {
    let chain = arm();
    let home = chain.forward(&chain.home);
    let (_, damping, off) = drive(&chain, Joints::zeros(), 5000, |_| Goal::at_rest(home));
    assert!(damping > 0.99, "{damping}");
    assert!(off < 1e-4, "{off}");
}

#[test]
fn away_from_trouble_the_goal_is_followed_exactly() {
    for chain in [arm(), slides()] {
        let start = chain.forward(&chain.home);
        let mut controller = Controller::new(chain.clone(), PERIOD_S).unwrap();
        let n = chain.joints.len();
        let mut q = chain.home;
        for tick in 0..1000 {
            let t = tick as f64 * PERIOD_S;
            // Speed 20 mm/s, after a start within the acceleration limits.
            let speed = 0.02 * (t / 0.2).min(1.0);
            let along = if t < 0.2 { 0.05 * t * t } else { 0.02 * (t - 0.1) };
            let mut twist = Vector6::zeros();
            twist.x = speed;
            let x_wt = Translation3::new(along, 0.0, 0.0) * start;
            let motion = controller.step(&q.as_slice()[..n], &Goal { x_wt, twist }).unwrap();
            assert_eq!(motion.damping, 0.0);
            if t > 0.01 {
                assert!(
                    (motion.achieved_ratio - 1.0).abs() < 1e-6,
                    "{t} {}",
                    motion.achieved_ratio
                );
            }
            q += motion.qdot * PERIOD_S;
        }
        let x = chain.forward(&q);
        assert!(x.rotation.angle_to(&start.rotation) < 1e-4);
        assert!((x.translation.y - start.translation.y).abs() < 2e-5);
    }
}

#[test]
fn the_null_space_brings_the_elbow_home_while_the_tip_stands() {
    let chain = arm();
    let start = chain.forward(&chain.home);
    let mut q = chain.home;
    // A start away from home with the same tip pose: the elbow turned about the line from shoulder
    // to wrist, found by a simulated motion.
    let mut odd = chain.clone();
    odd.home[2] += 0.8;
    q = drive(&odd, q, 2000, |_| Goal::at_rest(start)).0;
    let away = (q - chain.home).norm();
    let (back, _, off) = drive(&chain, q, 4000, |_| Goal::at_rest(start));
    assert!(away > 0.2 && (back - chain.home).norm() < 0.02);
    assert!(off < 1e-4, "{off}");
}

#[test]
fn nonsense_is_an_error() {
    let chain = arm();
    assert!(Controller::new(chain.clone(), f64::NAN).is_err());
    assert!(Controller::new(chain.clone(), 0.0).is_err());
    let mut controller = Controller::new(chain.clone(), PERIOD_S).unwrap();
    let still = Goal::at_rest(chain.forward(&chain.home));
    let wrong = controller.step(&[0.0; 3], &still).unwrap_err();
    assert_eq!(wrong.to_string(), "3 joint positions for an arm of 7 joints");
    assert!(controller.step(&[f64::NAN; 7], &still).is_err());
    let mut nan = still;
    nan.x_wt.translation.vector.x = f64::NAN;
    assert!(controller.step(chain.home.as_slice(), &nan).is_err());
    nan = still;
    nan.twist[4] = f64::INFINITY;
    assert!(controller.step(chain.home.as_slice(), &nan).is_err());
    assert!(posture(&chain, &nan.x_wt).is_ok());
    nan.x_wt.translation.vector.x = f64::NAN;
    let error = posture(&chain, &nan.x_wt).unwrap_err().to_string();
    assert!(error.ends_with("is not finite"), "{error}");
}

#[test]
fn every_place_of_the_scenes_has_a_posture() {
    for name in ["bird", "container"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        for arm in [
            Some(ArmSettings::default()),
            Some(ArmSettings { model: "pa10_a".into(), ..Default::default() }),
            None,
        ] {
            let mut scene = Scene::load(&path, &[]).unwrap();
            scene.arm = arm;
            let environment = Environment::build(scene).unwrap();
            let chain = environment.chain().unwrap();
            let attitude = environment.scene().finger.r_at();
            for place in environment.task().zone().unwrap().grid(5) {
                // From the datum, deep in the object, to well in front of it.
                for height_m in [0.0, 0.1] {
                    let p = environment.task().zone().unwrap().point(&place, height_m);
                    let x_wt = Isometry3::from_parts(p.into(), attitude);
                    let q = posture(&chain, &x_wt).unwrap();
                    let x = chain.forward(&q);
                    assert!((x.translation.vector - p.coords).norm() < 1e-8);
                    assert!(x.rotation.angle_to(&attitude) < 1e-7);
                    assert_eq!(q, chain.clamp(&q));
                    // Home and its neighbourhood are far from limits and singularities.
                    for (i, joint) in chain.joints.iter().enumerate() {
                        let room = (q[i] - joint.q_limits[0]).min(joint.q_limits[1] - q[i]);
                        assert!(room > 0.1, "{name} {place:?} {} {room}", joint.name);
                    }
                }
            }
        }
    }
}

#[test]
fn postures_are_found_wherever_the_arm_can_be() {
    let chain = arm();
    let mut random = seed::stream(1, 0, "posture");
    let mut found = 0;
    for _ in 0..200 {
        let x_wt = chain.forward(&anywhere(&chain, &mut random));
        if let Ok(q) = posture(&chain, &x_wt) {
            let x = chain.forward(&q);
            assert!((x.translation.vector - x_wt.translation.vector).norm() < 1e-8);
            assert_eq!(q, chain.clamp(&q));
            found += 1;
        }
    }
    assert!(found > 190, "{found}");
}

#[test]
fn a_place_out_of_reach_says_by_how_much() {
    let chain = arm();
    let ahead = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -std::f64::consts::FRAC_PI_2);
    let x_wt = Isometry3::from_parts(Translation3::new(0.0, -2.0, 0.317), ahead);
    let Err(ArmError::OutOfReach { distance_m, .. }) = posture(&chain, &x_wt) else { panic!() };
    // Distance from shoulder to fingertip, stretched: 0.45 + 0.48 + 0.07 + 0.12 m.
    assert!((distance_m - (2.0 - 1.12)).abs() < 0.01, "{distance_m}");
    let turned = Translation3::new(0.0, -0.6, 0.5).into();
    let Err(ArmError::OutOfReach { angle_rad, .. }) = posture(&slides(), &turned) else { panic!() };
    assert!(angle_rad > 0.1);
}

#[cfg(feature = "mujoco")]
mod mujoco {
    use super::*;
    use palpate::backend::Wrench;
    use palpate::sim::mjcf;
    use palpate::sim::mjcf::ModelPurpose;
    use palpate::sim::mujoco::{Plant, compile};
    use std::sync::Arc;

    /// Moves 60 mm from rest along -y at 0.02 m/s with masses, friction and servos.
    #[test]
    fn an_approach_stays_on_its_line() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
        let [c, a] = ["pa10", "pa10_a"]
            .map(|model| Some(ArmSettings { model: model.into(), ..Default::default() }));
        for settings in [c, a, None] {
            let mut scene = Scene::load(&path, &[]).unwrap();
            scene.arm = settings;
            let environment = Environment::build(scene).unwrap();
            let chain = environment.chain().unwrap();
            let n = chain.joints.len();
            let text = mjcf::scene(&environment, ModelPurpose::Dynamic { step_s: 0.002 }).unwrap();
            let mut plant = Plant::new(Arc::new(compile(&text).unwrap())).unwrap();
            let start = Translation3::new(0.02, -0.54, 0.47);
            let start = Isometry3::from_parts(start, environment.scene().finger.r_at());
            plant.reset(&posture(&chain, &start).unwrap().as_slice()[..n]).unwrap();
            let mut controller = Controller::new(chain, PERIOD_S).unwrap();
            let (mut aside, mut turned, mut behind): (f64, f64, f64) = (0.0, 0.0, 0.0);
            for tick in 0..750 {
                let t = tick as f64 * PERIOD_S;
                let mut twist = Vector6::zeros();
                twist.y = -0.02 * (t / 0.1).min(1.0);
                let along = if t < 0.1 { 0.1 * t * t } else { 0.02 * (t - 0.05) };
                let x_wt = Translation3::new(0.0, -along, 0.0) * start;
                let motion = controller.step(plant.q(), &Goal { x_wt, twist }).unwrap();
                for _ in 0..2 {
                    plant.step(&motion.qdot.as_slice()[..n], &Wrench::default()).unwrap();
                }
                let off = plant.tip().translation.vector - x_wt.translation.vector;
                aside = aside.max(off.x.hypot(off.z));
                behind = behind.max(off.y.abs());
                turned = turned.max(plant.tip().rotation.angle_to(&start.rotation));
            }
            assert!(aside < 2e-4, "{aside}");
        }
    }
}

/// Pose and Jacobian of a reading are computed once; querying the pose first changes no command.
#[test]
fn a_pose_that_was_asked_for_changes_no_command() {
    let chain = arm();
    let [mut asked, mut other] =
        [(); 2].map(|()| Controller::new(chain.clone(), PERIOD_S).unwrap());
    let goal = Goal::at_rest(chain.forward(&chain.home));
    for tick in 0..50 {
        let q = chain.home + Joints::from_fn(|i, _| 0.1 * f64::from(tick + 7 * i as i32).sin());
        assert_eq!(asked.x_wt(&q.as_slice()[..7]), Ok(chain.forward(&q)));
        assert_eq!(asked.step(&q.as_slice()[..7], &goal), other.step(&q.as_slice()[..7], &goal));
    }
}
