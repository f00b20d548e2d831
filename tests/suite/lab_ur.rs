//! Tests of a UR5e behind its driver over ROS 2, run in a network namespace by `make test-ros2`.

use crate::common::lab::{
    End, Network, TwinProcess, UR_EXPERIMENT, contacts_off_m, count, end_planners, journal,
    median_and_worst, row, touch_sets,
};
use palpate::backend::Backend;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::planner::Fallback;
use palpate::ros::arm::RosArm;
use palpate::ros::service::Service;
use palpate::ros::settings::BackendSettings;
use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// The contacts are those of the same scene in this process.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn the_container_is_touched_by_a_ur_as_in_the_simulator() {
    let touches = count("PALPATE_UR_TOUCHES", 6);
    let network = Network::of_ur(60);
    let twin = TwinProcess::new(&network, UR_EXPERIMENT, &[]);
    let folder = tempfile::tempdir().unwrap();
    let output = network.run("active", touches, folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    println!("the twin counted {}", twin.end());
    let row = row(folder.path());
    assert_eq!((&row.failure, row.touches.len()), (&None, touches as usize));

    let [touches, initial_touches] = touch_sets(touches);
    let sets = ["backend.kind=\"simulated\"".into(), touches, initial_touches];
    let experiment = Experiment::load(Path::new(UR_EXPERIMENT), &sets).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let off_m = contacts_off_m(&simulation, &row);
    let [median_m, worst_m] = median_and_worst(&off_m);
    println!(
        "{} contacts, off the simulator's by {:.3} mm (median), {:.3} mm (worst)",
        off_m.len(),
        1e3 * median_m,
        1e3 * worst_m
    );
    // On a steep surface a late tick moves the contact; one such contact is allowed.
    assert!(off_m[off_m.len() - 2] < 3e-4 && worst_m < 6e-4, "{off_m:?}");
}

/// An arm whose planner is killed, stopped or cut off comes to rest by itself, no touch is lost,
/// and the same command continues.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn a_ur_without_its_planner_comes_to_rest() {
    for (number, end) in [(61, End::Kill), (62, End::Stop), (63, End::Cut)] {
        let network = Network::of_ur(number);
        let twin = TwinProcess::new(&network, UR_EXPERIMENT, &[]);
        let folder = tempfile::tempdir().unwrap();
        end_planners(end, count("PALPATE_UR_ENDS", 2), &twin, folder.path(), |touches| {
            let mut run = network.run("random", touches, folder.path());
            run.arg("--clear-fault");
            run
        });
    }
}

/// A stop that the robot reports ends the run, and the message says how to go on.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn stops_of_a_ur_end_the_run_and_say_what_to_do() {
    for (i, (name, words)) in [
        ("protective_stop", "enable the robot on the pendant"),
        ("program_stop", "External Control"),
        ("estop", "emergency stop"),
        ("deadman", "dead-man"),
        ("no_wrench", "no new message on /force_torque_sensor_broadcaster/wrench"),
    ]
    .into_iter()
    .enumerate()
    {
        let network = Network::of_ur(64 + i as u16);
        let twin = TwinProcess::new(&network, UR_EXPERIMENT, &["--inject", &format!("{name}@1+1")]);
        let folder = tempfile::tempdir().unwrap();
        let output = network.run("random", 2, folder.path()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{name}: {said}");
        assert!(said.contains(words), "{name}: {said}");
        println!("{name}: {}", said.lines().next().unwrap_or_default());
        let begins = |event: &Value| event["failure"]["is_on"] == true;
        let begun_s = twin.last(begins).unwrap();
        sleep(Duration::from_millis(1200));
        let rest_s = twin.rest_s().unwrap() - begun_s;
        assert!(rest_s < 0.3, "{name}: {rest_s}");
        let again = network.run("random", 2, folder.path()).arg("--clear-fault").output().unwrap();
        assert!(again.status.success(), "{name}: {}", String::from_utf8_lossy(&again.stderr));
    }
}

/// At half speed the run takes longer, and ends as it should.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn a_ur_at_half_speed_is_followed() {
    let network = Network::of_ur(70);
    let twin = TwinProcess::new(&network, UR_EXPERIMENT, &["--inject", "slow@0"]);
    let folder = tempfile::tempdir().unwrap();
    let output = network.run("random", 2, folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let row = row(folder.path());
    assert!(row.touches.iter().all(|touch| touch.contact.is_some()), "{row:?}");
    println!("the twin counted {}", twin.end());
}

/// An independent peer, written from the tables of `docs/arms.md`.
fn peer(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var("PALPATE_PEER").expect("PALPATE_PEER"));
    command.arg("tests/ros2/ur_peer.py").args(arguments);
    command
}

#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn a_peer_of_another_implementation_drives_the_twin_of_a_ur() {
    let network = Network::of_ur(71);
    let mapping = ["--set", "backend.service_mapping=\"cyclone\""];
    let twin = TwinProcess::new(&network, UR_EXPERIMENT, &mapping);
    let output = peer(&["drive", "71"]).output().unwrap();
    let values = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{values}{}", String::from_utf8_lossy(&output.stderr));
    println!("{}", values.trim());
    twin.end();
}

/// The arm moves as far as commanded, stops, and is handed back as it was.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn a_ur_of_another_implementation_is_driven() {
    let network = Network::of_ur(72);
    let arm = peer(&["arm", "72", "14"]).stdout(Stdio::piped()).spawn().unwrap();
    sleep(Duration::from_millis(1500));
    let experiment = Experiment::load(Path::new(UR_EXPERIMENT), &[]).unwrap();
    let chain = experiment.scene.arm.unwrap().chain().unwrap();
    let patient = BackendSettings { connect_timeout_s: 8.0, ..network.settings.clone() };
    let lab = RosArm::connect_over(&patient, &chain).unwrap();
    lab.call(&Service::ZeroFtSensor).unwrap();
    let mut body = lab.backend();
    let start = body.reset(0).unwrap().q[0];
    let mut command = palpate::backend::Command { qdot: vec![0.0; 6] };
    for (ticks, speed) in [(125, 0.1), (75, 0.0)] {
        command.qdot[0] = speed;
        for _ in 0..ticks {
            body.step(&command).unwrap();
        }
    }
    let end = body.step(&command).unwrap();
    let moved = end.q[0] - start;
    // The time between two ticks is measured, so a late one is commanded for longer.
    assert!((moved - 0.05).abs() < 5e-3, "{moved}");
    assert!(end.qdot[0].abs() < 2e-3, "{}", end.qdot[0]);
    drop((body, lab));
    let values = String::from_utf8(arm.wait_with_output().unwrap().stdout).unwrap();
    println!("{}", values.trim());
    let found: Value = serde_json::from_str(&values).unwrap();
    assert_eq!(found["problems"], serde_json::json!([]), "{values}");
    assert_eq!(found["is_active"], false, "it was inactive before: {values}");
    assert!(found["trajectories"].as_u64().unwrap() > 20, "{values}");
}

/// An operator confirms, skips and moves touches; the same command continues with the same ones.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn an_operator_is_asked_before_each_touch() {
    let network = Network::of_ur(73);
    let twin = TwinProcess::new(&network, UR_EXPERIMENT, &[]);
    let folder = tempfile::tempdir().unwrap();
    let answered = |answers: &str| {
        let mut run = network.run("active", 4, folder.path());
        run.args(["--set", "initial_touches=2", "--step"])
            .stdin(Stdio::piped())
            .stderr(Stdio::piped());
        let mut run = run.spawn().unwrap();
        run.stdin.take().unwrap().write_all(answers.as_bytes()).unwrap();
        let output = run.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, said) = answered("go\nskip\nyes\nelsewhere 9 9\nelsewhere 0.01 0.5\nstop\n");
    assert_eq!(code, Some(130), "{said}");
    for words in [
        "touch 1 of 4: target (",
        "surface not yet estimated",
        "`yes`: allowed are go, skip, elsewhere X Z (in metres), stop",
        "[9.0, 9.0] is outside the region",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert_eq!(journal(folder.path()).len(), 3, "{said}");
    let (code, said) = answered("\n");
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("touch 4 of 4") && said.contains("95 % within"), "{said}");
    let row = row(folder.path());
    let chosen: Vec<_> = row.touches.iter().map(|touch| touch.fallback).collect();
    let operator = Some(Fallback::Operator);
    assert_eq!(chosen, [None, operator, operator, None]);
    assert_eq!(row.touches[2].target, [0.01, 0.5].into());
    twin.end();
}
