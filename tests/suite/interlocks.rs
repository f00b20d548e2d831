//! Tests of interlocks: each trips on its cause only, and stays tripped.

use crate::common::fake::{Fake, FakeScene, body_of};
use crate::common::shipped;
use nalgebra::{Point3, Vector3};
use palpate::backend::interlock::{
    INTERLOCKS, InterlockSettings, InterlockedBackend, SafetyContext,
};
use palpate::backend::{Backend, Command, Fault, Reading, Wrench};
use palpate::explore::probe::interlocks::with_interlocks;
use palpate::robot::arm::stage::stage;
use palpate::robot::arm::{ArmSettings, Chain};
use palpate::robot::{Finger, Robot};
use palpate::sim::simulator::Simulator;
use proptest::prelude::*;
use std::sync::Arc;

fn site(chain: Chain) -> SafetyContext {
    let robot = Robot::new(chain, Finger::default(), true);
    let (touch_force_n, travel_m_s) = (15.0, 0.1);
    SafetyContext { robot, tip_w: None, farthest: None, object: None, touch_force_n, travel_m_s }
}

fn arm() -> SafetyContext {
    site(ArmSettings::default().chain().unwrap())
}

fn interlocks(
    site: &SafetyContext,
    settings: &InterlockSettings,
    world: FakeScene,
) -> (InterlockedBackend, Fake) {
    let (body, fake) = body_of(&site.robot.chain, world);
    let mut body = InterlockedBackend::new(Box::new(body), site, settings).unwrap();
    body.reset(1).unwrap();
    (body, fake)
}

fn command(joints: usize, tick: u32) -> Command {
    Command { qdot: vec![0.02 * (f64::from(tick) * 0.01).sin(); joints] }
}

/// Fault in the readings of a body from tick 100 on.
type Breaks = fn(u64, &mut Reading);

/// Cause, interlock, and fault.
const CAUSES: [(&str, Breaks); 13] = [
    ("force", |tick, reading| force(reading, (0.5 * (tick - 100) as f64).min(40.0))),
    ("force rate", |_, reading| force(reading, 24.0)),
    ("torque", |_, reading| reading.wrench.as_mut().unwrap().torque_nm.x += 2.0),
    ("joint state age", |_, reading| reading.time_s = 0.2),
    ("wrench age", |_, reading| reading.wrench = None),
    ("wrench age", |_, reading| reading.wrench = Some(Wrench::default())),
    ("tactile frame age", |_, reading| reading.samples.clear()),
    ("value of E3", |_, reading| electrode(reading, 2, 4095.0)),
    ("value of E4", |_, reading| electrode(reading, 3, 0.0)),
    ("standstill of E19", |_, reading| electrode(reading, 18, 2000.0)),
    ("velocity tracking error of S1", |_, reading| reading.qdot[0] = 0.4),
    ("joint position of S2", |_, reading| reading.q[1] = 2.0),
    ("tip speed", |_, reading| reading.qdot[0] = 2.0),
];

fn force(reading: &mut Reading, more_n: f64) {
    reading.wrench.as_mut().unwrap().force_n.y += more_n;
}

fn electrode(reading: &mut Reading, i: usize, counts: f64) {
    for frame in reading.frames_mut() {
        frame.electrode_counts.as_mut().unwrap()[i] = counts;
    }
}

#[test]
fn each_trips_on_its_cause_soon_and_stays_tripped_until_an_operator_clears_it() {
    for (named, breaks) in CAUSES {
        let site = arm();
        let world = FakeScene { breaks: Some((100, breaks)), ..FakeScene::real() };
        let (mut body, fake) = interlocks(&site, &InterlockSettings::default(), world);
        for tick in 0..99 {
            body.step(&command(7, tick)).unwrap_or_else(|fault| panic!("{named}: {fault}"));
        }
        let stepped = (99..300).find_map(|tick| Some((tick, body.step(&command(7, tick)).err()?)));
        let (tick, fault) = stepped.unwrap_or_else(|| panic!("{named} does not trip"));
        let Fault::Interlock { trip, .. } = &fault else { panic!("{named}: {fault}") };
        let said = trip.to_string();
        assert!(said.starts_with(&format!("{named} is ")), "{named}: {said}");
        assert!(trip.found > trip.limit || trip.unit == "counts", "{said}");
        // The longest delay is 0.2 s, 100 ticks; a spike needs two readings.
        assert!(tick <= 205, "{named}: {tick}");
        let commands = fake.commands();
        assert!(commands.last().unwrap().iter().all(|qdot| *qdot == 0.0), "{named}");
        let values = commands.len();
        assert_eq!(body.step(&command(7, 0)).unwrap_err(), fault);
        assert_eq!(body.reset(2).unwrap_err(), fault);
        assert_eq!(fake.commands().len(), values, "{named}: it moved after it was stopped");
        body.clear_fault();
        fake.mend();
        body.reset(2).unwrap();
        body.step(&command(7, 0)).unwrap();
    }
}

/// Distance that a stage's tip moves after its joints freeze, and the interlock that stops it.
fn frozen(speed_m_s: f64, noise: f64) -> (f64, String) {
    let site = site(stage(Point3::origin(), Finger::default().r_at()));
    let world = FakeScene { freezes: Some((400, noise)), ..FakeScene::real() };
    let (mut body, fake) = interlocks(&site, &InterlockSettings::default(), world);
    let ahead = Command { qdot: vec![0.0, -speed_m_s, 0.0] };
    let fault = (0..40_000).find_map(|_| body.step(&ahead).err()).unwrap();
    (fake.places()[400][1] - fake.last()[1], fault.to_string())
}

/// Compares positions that repeat exactly with positions that have noise only.
#[test]
fn joints_that_freeze_are_found_within_ten_millimetres_at_any_speed() {
    for speed_m_s in [0.0001, 0.001, 0.003, 0.005, 0.015, 0.04, 0.1] {
        let (went_m, said) = frozen(speed_m_s, 0.0);
        println!("{speed_m_s} m/s: {:.2} mm, {said}", 1e3 * went_m);
        let found = ["joint standstill of Y", "position tracking error of Y"];
        assert!(found.iter().any(|words| said.contains(words)), "{said}");
        // The visible distance, then 0.1 s and one tick, then the stopping distance.
        assert!(went_m < 0.01 && went_m < speed_m_s * 0.13 + 4e-4, "{speed_m_s}: {went_m}");
        let (went_m, said) = frozen(speed_m_s, 1e-6);
        println!("{speed_m_s} m/s: {:.2} mm, {said}", 1e3 * went_m);
        assert!(said.contains("position tracking error of Y"), "{said}");
        assert!(went_m < 0.01, "{speed_m_s}: {went_m}");
    }
}

/// Lagging and smoothing servos do not count as frozen.
#[test]
fn joints_that_lag_by_less_than_is_allowed_trip_nothing() {
    // The fast motion goes back and forth in 0.63 s, once per sample of the longest span.
    for (lag, rate) in [(5, 0.004), (40, 0.004), (40, 0.02)] {
        let site = site(stage(Point3::origin(), Finger::default().r_at()));
        let world = FakeScene { lag, ..FakeScene::real() };
        let (mut body, _) = interlocks(&site, &InterlockSettings::default(), world);
        for tick in 0..10_000 {
            let speed_m_s = 0.1 * (f64::from(tick) * rate).sin();
            let command = Command { qdot: vec![speed_m_s, -speed_m_s, 0.0] };
            body.step(&command).unwrap_or_else(|fault| panic!("{lag}: {fault}"));
        }
    }
}

/// An arm stops by itself while the next command is overdue, and moves less than commanded. Without
/// a late command the same distance counts.
#[test]
fn a_late_command_after_which_the_arm_rested_trips_nothing() {
    let ends = |breaks: Breaks| {
        let site = site(stage(Point3::origin(), Finger::default().r_at()));
        let world = FakeScene { breaks: Some((400, breaks)), ..FakeScene::real() };
        let (mut body, _) = interlocks(&site, &InterlockSettings::default(), world);
        let ahead = Command { qdot: vec![0.0, -0.2, 0.0] };
        (0..800).find_map(|_| body.step(&ahead).err())
    };
    assert_eq!(ends(|_, reading| reading.time_s += 0.036), None);
    let fault = ends(|_, reading| reading.q[1] += 0.2 * 0.032).unwrap().to_string();
    assert!(fault.contains("position tracking error of Y"), "{fault}");
}

/// Bounds apply to the possible position of the tip, not only to the last observed one.
#[test]
fn a_box_bounds_also_a_tip_that_is_not_seen_to_move() {
    let mut site = site(stage(Point3::origin(), Finger::default().r_at()));
    site.tip_w = Some([Point3::origin(); 2]);
    // No other interlock stops it.
    let settings = InterlockSettings {
        tip_margin_m: 0.05,
        stuck_s: 100.0,
        joint_timeout_s: 10.0,
        tracking_lag_s: 1.0,
        ..InterlockSettings::default()
    };
    let world = FakeScene { freezes: Some((100, 0.0)), ..FakeScene::real() };
    let (mut body, fake) = interlocks(&site, &settings, world);
    let ahead = Command { qdot: vec![0.0, -0.1, 0.0] };
    let fault = (0..4000).find_map(|_| body.step(&ahead).err()).unwrap();
    assert!(fault.to_string().contains("workspace of the tip"), "{fault}");
    assert!((-0.0501..-0.04).contains(&fake.last()[1]), "{:?}", fake.last());
}

/// The message gives the pose and how to correct it, not only a negative margin.
#[test]
fn an_arm_away_from_home_is_told_where_to_go_and_not_moved() {
    let mut site = arm();
    site.tip_w = Some([Point3::new(3.0, 0.0, 0.0); 2]);
    let (mut body, fake) = interlocks(&site, &InterlockSettings::default(), FakeScene::real());
    let fault = body.step(&command(7, 100)).unwrap_err();
    let said = fault.to_string();
    for word in ["its tip at [", "workspace of the tip", "jog it close to its home", "S1 -1.571"] {
        assert!(said.contains(word), "{said}");
    }
    assert!(fake.commands().is_empty());
    assert_eq!(body.step(&command(7, 101)).unwrap_err(), fault);
}

/// A single reading does not count as a force.
#[test]
fn a_single_spike_of_force_is_none() {
    let world = FakeScene {
        breaks: Some((100, |tick, reading| {
            // Between two readings used for a rise.
            if tick % 50 == 2 {
                force(reading, 100.0);
            }
        })),
        ..FakeScene::real()
    };
    let (mut body, _) = interlocks(&arm(), &InterlockSettings::default(), world);
    (0..300).for_each(|tick| assert!(body.step(&command(7, tick)).is_ok()));
}

/// Tests that a pause does not count as a frozen electrode: there are no readings during planning,
/// and noise may repeat the earlier value.
#[test]
fn an_electrode_that_reads_the_same_before_and_after_a_pause_is_not_frozen() {
    let world = FakeScene {
        breaks: Some((99, |tick, reading| {
            if tick <= 100 {
                electrode(reading, 18, 2000.0);
            }
            if tick >= 100 {
                reading.time_s += 0.7;
            }
        })),
        ..FakeScene::real()
    };
    let (mut body, _) = interlocks(&arm(), &InterlockSettings::default(), world);
    (0..300).for_each(|tick| body.step(&command(7, tick)).map(|_| ()).unwrap());
}

#[test]
fn a_simulated_body_is_cleared_by_its_reset() {
    let world = FakeScene {
        breaks: Some((10, |_, reading| force(reading, 24.0))),
        ..FakeScene::simulated()
    };
    let (mut body, fake) = interlocks(&arm(), &InterlockSettings::default(), world);
    assert!((0..50).any(|tick| body.step(&command(7, tick)).is_err()));
    fake.mend();
    body.reset(1).unwrap();
    assert!(body.step(&command(7, 0)).is_ok());
}

/// Moves the tip at 20 mm/s against a wall of 20 N/mm across y.
fn pressed(
    wall: impl Fn(f64) -> f64 + Send + 'static,
    settings: &InterlockSettings,
) -> (Fault, Fake) {
    let site = site(stage(Point3::origin(), Finger::default().r_at()));
    let world = FakeScene { wall: Some(Box::new(wall)), ..FakeScene::real() };
    let (mut body, fake) = interlocks(&site, settings, world);
    let ahead = Command { qdot: vec![0.0, -0.02, 0.0] };
    let fault = (0..2000).find_map(|_| body.step(&ahead).err()).unwrap();
    (fault, fake)
}

const N_M: f64 = 20_000.0;
const FRONT_M: f64 = -0.02;

#[test]
fn too_much_force_is_left_by_the_way_it_came_and_no_farther_than_said() {
    let settings = InterlockSettings::default();
    let (fault, fake) = pressed(|y| N_M * (FRONT_M - y).max(0.0), &settings);
    let Fault::Interlock { trip, .. } = &fault else { panic!("{fault}") };
    assert_eq!((trip.interlock, trip.limit), ("force", 25.0));
    let (deepest, last) = (fake.places().iter().map(|q| q[1]).fold(0.0, f64::min), fake.last()[1]);
    let back_m = last - deepest;
    assert!((0.010..0.012).contains(&back_m), "{back_m}");
    let speeds = fake.commands().iter().map(|qdot| qdot[1]).fold(0.0, f64::max);
    assert!(speeds <= 0.02 + 1e-9, "{speeds}");
    assert!(fake.commands().last().unwrap().iter().all(|qdot| *qdot == 0.0));

    let (_, fake) = pressed(
        |y| N_M * (FRONT_M - y).max(0.0),
        &InterlockSettings { retract_m: 0.0, ..settings.clone() },
    );
    let deepest = fake.places().iter().map(|q| q[1]).fold(0.0, f64::min);
    assert_eq!(fake.last()[1], deepest);
}

/// Tests a hook, which would block the retraction.
#[test]
fn going_back_ends_where_the_force_rises() {
    let caught = std::sync::Mutex::new(0.0f64);
    let hook = move |y: f64| {
        let mut deepest = caught.lock().unwrap();
        *deepest = deepest.min(y);
        let pulled_m = (y - *deepest - 0.003).max(0.0);
        N_M * (FRONT_M - y).max(0.0).max(if *deepest < FRONT_M { pulled_m + 0.002 } else { 0.0 })
    };
    let (fault, fake) = pressed(hook, &InterlockSettings::default());
    assert!(matches!(fault, Fault::Interlock { .. }));
    let (deepest, last) = (fake.places().iter().map(|q| q[1]).fold(0.0, f64::min), fake.last()[1]);
    // 2 N at 20 N/mm are 0.1 mm; stopping from 20 mm/s takes 0.2 mm.
    assert!((0.003..0.0042).contains(&(last - deepest)), "{}", last - deepest);
}

#[test]
fn it_goes_back_from_nothing_but_force() {
    for (named, breaks) in CAUSES.into_iter().filter(|(named, _)| *named != "force") {
        let world = FakeScene { breaks: Some((100, breaks)), ..FakeScene::real() };
        let (mut body, fake) = interlocks(&arm(), &InterlockSettings::default(), world);
        let ahead = Command { qdot: vec![0.01; 7] };
        assert!((0..300).any(|_| body.step(&ahead).is_err()), "{named}");
        let back = fake.commands().iter().flatten().fold(0.0, |least: f64, &qdot| least.min(qdot));
        assert_eq!(back, 0.0, "{named}");
    }
    // The same for force, if the skin also sends nothing.
    let both: Breaks = |tick, reading| {
        reading.samples.clear();
        force(reading, (0.24 * (tick - 100) as f64).min(26.0));
    };
    let world = FakeScene { breaks: Some((100, both)), ..FakeScene::real() };
    let settings = InterlockSettings { frame_timeout_s: 0.23, ..InterlockSettings::default() };
    let (mut body, fake) = interlocks(&arm(), &settings, world);
    let ahead = Command { qdot: vec![0.05; 7] };
    let fault = (0..400).find_map(|_| body.step(&ahead).err()).unwrap();
    assert!(fault.to_string().contains("force is"), "{fault}");
    assert!(fake.commands().iter().flatten().all(|qdot| *qdot >= 0.0));
}

#[test]
fn a_body_that_faults_is_told_to_stand_still_at_once() {
    let world = FakeScene { dies_at: Some(50), ..FakeScene::real() };
    let (mut body, fake) = interlocks(&arm(), &InterlockSettings::default(), world);
    let fault = (0..100).find_map(|_| body.step(&Command { qdot: vec![0.05; 7] }).err()).unwrap();
    assert!(matches!(fault, Fault::Stopped { .. }));
    assert_eq!(fake.commands().last().unwrap(), &vec![0.0; 7]);
    assert_eq!(body.step(&command(7, 0)).unwrap_err(), fault);
}

#[test]
fn the_table_has_every_interlock_once() {
    let mut names: Vec<&str> = INTERLOCKS.iter().map(|entry| entry.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), INTERLOCKS.len());
    let docs = include_str!("../../docs/safety.md");
    for name in names {
        assert!(docs.contains(&format!("| {name} |")), "{name}");
    }
}

#[test]
fn no_touch_of_a_shipped_scene_comes_near_one() {
    let names =
        ["container_finger.toml", "bird_finger.toml", "container_pa10.toml", "bird_pa10.toml"];
    for name in names.into_iter().filter(|name| cfg!(feature = "mujoco") || !name.contains("pa10"))
    {
        for sets in [&[][..], &["effects.wrench={}", "effects.timing={}"]] {
            let environment = shipped::environment(name, sets);
            let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
            let mut probe = simulator.probe(1).unwrap();
            for place in environment.task().zone().unwrap().grid(2).into_iter().step_by(3) {
                let touch =
                    probe.touch(&environment.task().approach(&place.as_slice().into()).unwrap());
                assert!(touch.is_ok(), "{name} {sets:?} {place:?}: {touch:?}");
            }
        }
    }
}

/// Tests that interlocks stop a finger without sensors: the depth of the zone, or the box around
/// the paths.
#[test]
fn a_finger_that_feels_nothing_is_stopped_behind_the_zone() {
    let environment = shipped::environment("container_finger.toml", &[]);
    let (robot, task) = (environment.robot().unwrap(), environment.task());
    let [_, far_m] = task.depth_m();
    for (way, named) in [([0.0, -0.05, 0.0], "depth"), ([0.05, 0.0, 0.0], "workspace")] {
        let (body, fake) = body_of(&robot.chain, FakeScene::simulated());
        let settings = InterlockSettings::default();
        let mut body = with_interlocks(Box::new(body), &robot, task, None, &settings).unwrap();
        body.reset(1).unwrap();
        let ahead = Command { qdot: way.to_vec() };
        let fault = (0..5000).find_map(|_| body.step(&ahead).err()).unwrap();
        assert!(fault.to_string().contains(named), "{fault}");
        let y_m = fake.last()[1];
        let deepest_m = far_m + robot.finger.radius_m + 0.01 + settings.depth_margin_m;
        assert!(-y_m <= deepest_m + 1e-9, "{y_m} {deepest_m} {fault}");
        assert!(named != "depth" || -y_m > deepest_m - 0.005, "{y_m} {deepest_m} {fault}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Tests any command, up to ten times a joint's limits.
    #[test]
    fn whatever_is_commanded_limits_hold_and_the_tip_stays_in_its_box(
        wild in prop::collection::vec(prop::array::uniform7(-1.0f64..1.0), 1..12),
        gentle in 0.02f64..1.0,
    ) {
        let mut site = arm();
        let chain = site.robot.chain.clone();
        let home: Point3<f64> = chain.forward(&chain.home).translation.vector.into();
        let room = Vector3::repeat(0.15);
        site.tip_w = Some([home, home]);
        let settings = InterlockSettings {
            tip_margin_m: room.x,
            lowest_m: Some(0.3),
            tip_speed_m_s: Some(2.0),
            ..InterlockSettings::default()
        };
        let (mut body, fake) = interlocks(&site, &settings, FakeScene::simulated());
        'run: for qdot in &wild {
            let wanted = |i: usize| 10.0 * gentle * qdot[i] * chain.joints[i].qdot_limit;
            let command = Command { qdot: (0..7).map(wanted).collect() };
            for _ in 0..150 {
                if body.step(&command).is_err() {
                    break 'run;
                }
            }
        }
        let period_s = body.capabilities().period_s;
        let mut before = vec![0.0; 7];
        for (qdot, q) in fake.commands().iter().zip(fake.places().iter().skip(1)) {
            for (i, joint) in chain.joints.iter().enumerate() {
                let [low, high] = joint.q_limits;
                prop_assert!((low - 1e-6..=high + 1e-6).contains(&q[i]), "{} {}", joint.name, q[i]);
                prop_assert!(qdot[i].abs() <= joint.qdot_limit * (1.0 + 1e-6));
                let step = joint.qddot_limit * period_s * (1.0 + 1e-6);
                prop_assert!((qdot[i] - before[i]).abs() <= step, "{}", joint.name);
            }
            let tip = chain.forward(&chain.joints_from(q).unwrap()).translation.vector - home.coords;
            // Resolution of the look-ahead.
            prop_assert!(tip.amax() <= room.x + 1e-3, "{tip}");
            before.clone_from(qdot);
        }
    }
}
