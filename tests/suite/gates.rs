//! Tests of the checks before a body may be moved.

use crate::common::fake::{FakeScene, body_of};
#[cfg(feature = "mujoco")]
use crate::common::program::{palpate, stderr};
use crate::common::shipped;
use palpate::backend::interlock::{StartCheckSettings, check_start};
use palpate::backend::{Fault, Reading};
use palpate::robot::arm::ArmSettings;
use palpate::sim::simulator::Simulator;
#[cfg(feature = "mujoco")]
use std::{fs, path::Path};

fn checked(breaks: fn(u64, &mut Reading)) -> Result<(), Fault> {
    let chain = ArmSettings::default().chain().unwrap();
    let world = FakeScene { breaks: Some((0, breaks)), ..FakeScene::real() };
    let (mut body, _) = body_of(&chain, world);
    check_start(&mut body, &chain, &StartCheckSettings::default(), 1)
}

#[test]
fn a_body_in_order_passes() {
    assert_eq!(checked(|_, _| {}), Ok(()));
    let environment = shipped::environment("container_finger.toml", &["effects.wrench={}"]);
    let mut body = Simulator::new(environment.clone()).unwrap().body().unwrap().unwrap();
    let chain = environment.chain().unwrap();
    assert_eq!(check_start(body.as_mut(), &chain, &StartCheckSettings::default(), 1), Ok(()));
}

#[test]
fn what_is_not_in_order_is_said_with_its_numbers() {
    type Case = (fn(u64, &mut Reading), &'static str);
    let cases: [Case; 7] = [
        (|_, reading| reading.q[1] = 1.7, "the position 1.7000 of joint S2 is outside its limits "),
        (
            |tick, reading| reading.q[0] += 1e-5 * tick as f64,
            "joint S1 moved by 0.01000 while commanded to rest; allowed is 0.002",
        ),
        (
            |tick, reading| reading.wrench.as_mut().unwrap().force_n.z = 1e-3 * tick as f64,
            "the force at rest drifts by 0.75",
        ),
        (|_, reading| reading.samples.clear(), "no tactile frame received in 2 s"),
        (
            |_, reading| counts(reading, |counts| counts[4] = 2000.0),
            "electrode E5 at rest is 2000.0 counts with a standard deviation of 0.00",
        ),
        (
            |_, reading| counts(reading, |counts| counts[0] = 4095.0),
            "electrode E1 at rest is 4095.0 counts",
        ),
        (
            |tick, reading| {
                let sign = if (tick / 5).is_multiple_of(2) { 1.0 } else { -1.0 };
                for frame in reading.frames_mut() {
                    frame.electrode_counts.as_mut().unwrap()[7] += 40.0 * sign;
                }
            },
            "electrode E8 at rest is ",
        ),
    ];
    for (breaks, says) in cases {
        let error = checked(breaks).unwrap_err().to_string();
        assert!(error.contains(says), "{says}: {error}");
    }
    let nan = checked(|_, reading| reading.q[2] = f64::NAN).unwrap_err();
    assert!(matches!(nan, Fault::BadReading { .. }));
}

fn counts(reading: &mut Reading, change: fn(&mut [f64; 19])) {
    reading.frames_mut().for_each(|frame| change(frame.electrode_counts.as_mut().unwrap()));
}

/// A real robot needs its cell's limits and depths from the user; a simulation takes them from the
/// mesh.
#[cfg(feature = "mujoco")]
#[test]
fn what_protects_a_real_robot_is_asked_for_before_anything_moves() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let out = out.to_str().unwrap();
    let needed = [
        "scene.zone.depth_m=[0.59, 0.71]",
        "backend.interlocks.lowest_m=0.0",
        "backend.interlocks.workspace_m=[[-1.0, 1.0], [-1.2, 0.6], [0.0, 1.8]]",
    ];
    let run = |experiment: &'static str, sets: &[&str]| {
        let kind = "backend.ros2={}";
        let sets = [kind].into_iter().chain(sets.iter().copied()).flat_map(|set| ["--set", set]);
        let arguments: Vec<&str> =
            ["run", experiment, "--out", out].into_iter().chain(sets).collect();
        let output = palpate(Path::new(env!("CARGO_MANIFEST_DIR")), &arguments);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        stderr(&output)
    };
    for missing in 0..needed.len() {
        let sets: Vec<_> = (0..needed.len()).filter(|&i| i != missing).map(|i| needed[i]).collect();
        let values = run("container_pa10", &sets);
        let (key, _) = needed[missing].split_once('=').unwrap();
        assert!(
            values.contains("moves a real robot, which needs") && values.contains(key),
            "{values}"
        );
        assert!(
            values.contains(&format!("{key} = [")) || values.contains(&format!("{key} = 0")),
            "{values}"
        );
    }
    let values = run("around", &needed[1..]);
    for key in ["scene.whole_object.centre_m", "scene.whole_object.radius_m"] {
        assert!(values.contains(key), "{values}");
    }
    assert!(!Path::new(out).exists());
}

/// A folder locked by another program is detected before the connection to the arm.
#[cfg(feature = "mujoco")]
#[test]
fn a_folder_that_may_not_be_used_is_refused_before_the_arm_is_looked_for() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let experiment = "experiments/container_pa10.toml";
    let sets = crate::common::lab::CELL.iter().flat_map(|&set| ["--set", set]);
    let arguments: Vec<&str> = ["run", experiment, "--out", out.to_str().unwrap()]
        .into_iter()
        .chain(["--set", "backend.ros2={}", "--set", "touches=5", "--set", "initial_touches=5"])
        .chain(sets)
        .collect();
    let run = || stderr(&palpate(Path::new(env!("CARGO_MANIFEST_DIR")), &arguments));
    fs::create_dir(&out).unwrap();
    let trials = fs::File::create(out.join("trials.jsonl")).unwrap();
    trials.lock().unwrap();
    let values = run();
    assert!(values.contains("another run is writing this folder"), "{values}");
    drop(trials);
}
