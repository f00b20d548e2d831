//! Tests of the backend contract, for every body and every wrapper around it.

use crate::common::shipped;
use palpate::backend::delay::DelayedBackend;
use palpate::backend::interlock::{InterlockSettings, InterlockedBackend, SafetyContext};
use palpate::backend::live_view::{LiveView, ViewedBackend};
use palpate::backend::{Backend, Capabilities, Command, Fault, Reading};
use palpate::robot::arm::Chain;
use palpate::robot::{Finger, Robot};
use palpate::ros::recording::{Recording, RecordingBackend, RecordingMetadata, wall_clock};
use palpate::sim::Environment;
use palpate::sim::simulator::Simulator;
use std::sync::Arc;

#[cfg(feature = "mujoco")]
const KINDS: [&str; 2] = ["kinematic", "dynamic"];
#[cfg(not(feature = "mujoco"))]
const KINDS: [&str; 1] = ["kinematic"];

const EVERYTHING: &str = "effects={skin={}, fluid={}, electrodes={}, thermal={}, friction={}, \
     wrench={}, registration={}}";

fn environment(sets: &[&str]) -> Arc<Environment> {
    shipped::environment("container_finger.toml", sets)
}

/// Function that wraps a body.
type Wrap = fn(Box<dyn Backend>, &Chain) -> Box<dyn Backend>;

const WRAPS: [(&str, Wrap); 5] = [
    ("bare", |body, _| body),
    ("interlocked", |body, chain| Box::new(interlocked(body, chain))),
    ("recorded", |body, _| recorded(body)),
    ("delayed", |body, _| Box::new(DelayedBackend::new(body, 0.03))),
    ("watched", |body, _| Box::new(ViewedBackend::new(body, LiveView::new(100.0)))),
];

fn recorded(body: Box<dyn Backend>) -> Box<dyn Backend> {
    let about = RecordingMetadata {
        version: String::new(),
        experiment: String::new(),
        planner: String::new(),
        trial: 0,
        seed: 0,
        capabilities: body.capabilities().clone(),
    };
    let recording = Recording::new(Box::new(std::io::sink()), &about, wall_clock).unwrap();
    Box::new(RecordingBackend::new(body, recording))
}

fn interlocked(body: Box<dyn Backend>, chain: &Chain) -> InterlockedBackend {
    let robot = Robot::new(chain.clone(), Finger::default(), true);
    let (touch_force_n, travel_m_s) = (15.0, 0.1);
    let site = SafetyContext {
        robot,
        tip_w: None,
        farthest: None,
        object: None,
        touch_force_n,
        travel_m_s,
    };
    InterlockedBackend::new(body, &site, &InterlockSettings::default()).unwrap()
}

/// Runs `check` on every body in every wrapper.
fn each(check: impl Fn(&str, &mut dyn Backend, &Chain)) {
    for kind in KINDS {
        for arm in [None, Some("arm={model=\"pa10\"}")] {
            for effects in [Some(EVERYTHING), (kind == "dynamic").then_some("effects={}")] {
                let Some(effects) = effects else { continue };
                let body = format!("simulator=\"{kind}\"");
                let sets: Vec<&str> = [&*body, effects].into_iter().chain(arm).collect();
                let simulator = Simulator::new(environment(&sets)).unwrap();
                let chain = simulator.environment().chain().unwrap();
                for (name, wrap) in WRAPS {
                    let mut body = wrap(simulator.body().unwrap().unwrap(), &chain);
                    let name = format!("{name} {kind} {arm:?} {effects}");
                    check(&name, body.as_mut(), &chain);
                }
            }
        }
    }
}

/// Slow motion within the limits of every body.
fn motion(tick: u32, joints: usize) -> Command {
    let phase = f64::from(tick) * 0.02;
    Command {
        qdot: (0..joints).map(|i| 0.05 * (phase + i as f64).sin() * phase.min(1.0)).collect(),
    }
}

fn run(body: &mut dyn Backend, seed: u64, ticks: u32) -> Vec<Reading> {
    let joints = body.capabilities().joints.len();
    let mut readings = vec![body.reset(seed).unwrap().clone()];
    for tick in 0..ticks {
        readings.push(body.step(&motion(tick, joints)).unwrap().clone());
    }
    readings
}

fn bits(readings: &[Reading]) -> String {
    // Debug output has the shortest digits that distinguish two numbers.
    format!("{readings:?}")
}

#[test]
fn reset_brings_back_the_same_bits_and_another_seed_others() {
    each(|name, body, _| {
        let first = run(body, 7, 60);
        assert!(bits(&run(body, 7, 60)) == bits(&first), "{name}");
        if first.iter().any(|reading| reading.wrench.is_some()) {
            assert!(bits(&run(body, 8, 60)) != bits(&first), "{name}");
        }
    });
}

#[test]
fn time_goes_on_by_the_period_and_readings_are_finite() {
    each(|name, body, _| {
        let Capabilities { period_s, joints, .. } = body.capabilities().clone();
        for (tick, reading) in run(body, 1, 100).iter().enumerate() {
            assert!((reading.time_s - tick as f64 * period_s).abs() < 1e-12, "{name}");
            for part in [&reading.q, &reading.qdot, &reading.applied.qdot] {
                assert_eq!(part.len(), joints.len(), "{name}");
                assert!(part.iter().all(|value| value.is_finite()), "{name}");
            }
            assert!(reading.frames().all(|frame| frame.is_finite()), "{name}");
            if let Some(wrench) = reading.wrench {
                assert!(wrench.force_n.norm() < 10.0 && wrench.torque_nm.norm() < 1.0, "{name}");
            }
        }
    });
}

#[test]
fn nonsense_is_refused_and_does_not_move_the_body() {
    each(|name, body, _| {
        let joints = body.capabilities().joints.len();
        let still = Command { qdot: vec![0.0; joints] };
        let before = body.reset(1).unwrap().clone();
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut command = still.clone();
            command.qdot[joints - 1] = bad;
            assert!(matches!(body.step(&command), Err(Fault::Refused { .. })), "{name}");
        }
        for wrong in [0, joints - 1, joints + 1, 100] {
            let command = Command { qdot: vec![0.0; wrong] };
            assert!(matches!(body.step(&command), Err(Fault::Refused { .. })), "{name}");
        }
        let after = body.step(&still).unwrap();
        let moved = after.q.iter().zip(&before.q).map(|(after, before)| (after - before).abs());
        assert!(moved.fold(0.0, f64::max) < 1e-4, "{name}");
    });
}

#[test]
fn what_is_applied_keeps_the_limits() {
    each(|name, body, _| {
        let Capabilities { qdot_limits, q_limits, joints, .. } = body.capabilities().clone();
        body.reset(1).unwrap();
        for tick in 0..300 {
            let qdot = vec![if tick % 100 < 50 { 1e3 } else { -1e3 }; joints.len()];
            let Ok(reading) = body.step(&Command { qdot }) else { break };
            for (qdot, limit) in reading.applied.qdot.iter().zip(&qdot_limits) {
                assert!(qdot.abs() <= limit * (1.0 + 1e-6), "{name}: {qdot}");
            }
            for (q, [low, high]) in reading.q.iter().zip(&q_limits) {
                assert!((low - 0.2..=high + 0.2).contains(q), "{name}: {q}");
            }
        }
    });
}

#[test]
fn capabilities_are_those_of_the_chain() {
    each(|name, body, chain| {
        let capabilities = body.capabilities();
        assert_eq!(capabilities.joints.len(), chain.joints.len(), "{name}");
        for (i, joint) in chain.joints.iter().enumerate() {
            assert_eq!(*capabilities.joints[i], *joint.name, "{name}");
            assert_eq!(capabilities.q_limits[i], joint.q_limits, "{name}");
            assert_eq!(capabilities.qdot_limits[i], joint.qdot_limit, "{name}");
        }
        assert!(capabilities.resettable && !capabilities.real_time, "{name}");
        let start = body.reset(0).unwrap();
        assert_eq!(start.q, chain.start(), "{name}");
    });
}

#[test]
fn limits_hold_acceleration_and_braking_and_leave_a_good_command_alone() {
    for sets in [&["arm={model=\"pa10\"}"][..], &[]] {
        let simulator = Simulator::new(environment(sets)).unwrap();
        let chain = simulator.environment().chain().unwrap();
        let body = || simulator.body().unwrap().unwrap();
        let mut limited = interlocked(body(), &chain);
        assert_eq!(bits(&run(&mut limited, 3, 60)), bits(&run(body().as_mut(), 3, 60)));
        limited.reset(1).unwrap();
        let period_s = limited.capabilities().period_s;
        let mut before = vec![0.0; chain.joints.len()];
        for _ in 0..2000 {
            // Moves away from the object at full speed into the limits; on an arm, the joints that
            // turn the foot and the hand.
            let last = before.len() - 1;
            let is_asked = |i: usize| last == 2 || i.is_multiple_of(last);
            let qdot = (0..=last).map(|i| if is_asked(i) { 9.0 } else { 0.0 }).collect();
            let reading = limited.step(&Command { qdot }).unwrap();
            for ((joint, now), before) in
                chain.joints.iter().zip(&reading.applied.qdot).zip(&mut before)
            {
                let change = (now - *before).abs();
                assert!(change <= joint.qddot_limit * period_s * (1.0 + 1e-6), "{}", joint.name);
                *before = *now;
            }
        }
        assert!(before.iter().all(|qdot| qdot.abs() < 1e-3), "{before:?}");
    }
}

/// A body whose clock stops after a while.
struct Stopped(Box<dyn Backend>, Reading);

impl Backend for Stopped {
    fn capabilities(&self) -> &Capabilities {
        self.0.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.1.clone_from(self.0.reset(seed)?);
        Ok(&self.1)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let reading = self.0.step(command)?;
        if reading.time_s < 0.1 {
            self.1.clone_from(reading);
        }
        Ok(&self.1)
    }
}

#[test]
fn a_body_whose_time_stands_still_is_lost_and_stays_so_until_reset() {
    let simulator = Simulator::new(environment(&[])).unwrap();
    let inner = Stopped(simulator.body().unwrap().unwrap(), Reading::default());
    let mut limited = interlocked(Box::new(inner), &simulator.environment().chain().unwrap());
    let still = Command { qdot: vec![0.0; 3] };
    limited.reset(1).unwrap();
    let fault = (0..100).find_map(|_| limited.step(&still).err()).unwrap();
    assert!(fault.to_string().contains("joint state age"), "{fault}");
    assert_eq!(limited.step(&still).unwrap_err(), fault);
    limited.reset(1).unwrap();
    assert!(limited.step(&still).is_ok());
}

#[test]
fn a_delayed_body_does_later_what_the_bare_one_does() {
    let simulator = Simulator::new(environment(&[])).unwrap();
    let body = || simulator.body().unwrap().unwrap();
    let bare = run(body().as_mut(), 1, 50);
    let delayed = run(&mut DelayedBackend::new(body(), 0.031), 1, 53);
    for (bare, delayed) in bare.iter().zip(&delayed[3..]) {
        let apart = bare.q.iter().zip(&delayed.q).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-12);
    }
}

/// A live view changes no reading and shows the last one. The body is ahead of real time by at most
/// its sleep granularity, and stops when the view is closed.
#[test]
fn a_watched_body_is_the_same_body_at_the_pace_of_the_clock() {
    let simulator = Simulator::new(environment(&[EFFECTS_DRY])).unwrap();
    let mut bare = simulator.body().unwrap().unwrap();
    let sight = LiveView::new(4.0);
    let mut watched = ViewedBackend::new(simulator.body().unwrap().unwrap(), sight.clone());
    let begun = std::time::Instant::now();
    let readings = run(&mut watched, 3, 20);
    // On a busy machine it is only later.
    let last = readings.last().unwrap();
    assert!(begun.elapsed().as_secs_f64() > last.time_s / 4.0 - 0.01);
    assert!(bits(&run(bare.as_mut(), 3, 20)) == bits(&readings));
    let seen = sight.seen();
    assert_eq!((seen.time_s, &seen.q), (last.time_s, &last.q));
    sight.mark(nalgebra::Point3::origin());
    assert_eq!(sight.seen().marks_w.len(), 1);
    sight.close();
    let joints = watched.capabilities().joints.len();
    let ended = watched.step(&motion(21, joints)).unwrap_err();
    assert_eq!(ended, Fault::Stopped { time_s: last.time_s });
}

const EFFECTS_DRY: &str = "effects={skin={}}";
