//! Tests of a UR5e behind its driver over ROS 2, run in a network namespace by
//! `make test PART=ros2`.

use crate::common::lab::{
    BALL_EXPERIMENT, End, Network, TwinProcess, UR_EXPERIMENT, contacts_off_m, count, end_planners,
    journal, median_and_worst, row, touch_sets,
};
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::planner::Fallback;
use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// The contacts are those of the same scene in this process.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn the_container_is_touched_by_a_ur_as_in_the_simulator() {
    touched_as_in_the_simulator(&Network::of(60, UR_EXPERIMENT), &[]);
}

/// The same without a tactile sensor, with forces at a tool centre point far from the flange, and
/// at one that is turned, too.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn the_container_is_touched_by_force_as_in_the_simulator() {
    for (number, tcp) in [(74, "0,0,0.12,0,0,0"), (75, "0.01,-0.03,0.15,0.4,-0.5,0.8")] {
        touched_as_in_the_simulator(&Network::of(number, BALL_EXPERIMENT), &["--tcp", tcp]);
    }
}

/// Touches through a simulated robot, and compares the contacts with those in this process.
fn touched_as_in_the_simulator(network: &Network, options: &[&str]) {
    let touches = count("PALPATE_UR_TOUCHES", 6);
    let twin = TwinProcess::new(network, network.experiment, options);
    let folder = tempfile::tempdir().unwrap();
    let output = network.run("active", touches, folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    println!("the twin counted {}", twin.end());
    let row = row(folder.path());
    assert_eq!((&row.failure, row.touches.len()), (&None, touches as usize));

    let [touches, initial_touches] = touch_sets(touches);
    let sets = [touches, initial_touches];
    let mut experiment = Experiment::load(Path::new(network.experiment), &sets).unwrap();
    experiment.backend.ros2 = None;
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
    let others_m = &off_m[..off_m.len() - 1];
    assert!(others_m.iter().all(|off_m| *off_m < 3e-4) && worst_m < 6e-4, "{off_m:?}");
}

/// An arm whose planner is killed, stopped or cut off comes to rest by itself, no touch is lost,
/// and the same command continues.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_ur_without_its_planner_comes_to_rest() {
    for (number, end) in [(61, End::Kill), (62, End::Stop), (63, End::Cut)] {
        let network = Network::of(number, UR_EXPERIMENT);
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
#[ignore = "needs a network namespace: make test PART=ros2"]
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
        let network = Network::of(64 + i as u16, UR_EXPERIMENT);
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
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_ur_at_half_speed_is_followed() {
    let network = Network::of(70, UR_EXPERIMENT);
    let twin = TwinProcess::new(&network, UR_EXPERIMENT, &["--inject", "slow@0"]);
    let folder = tempfile::tempdir().unwrap();
    let output = network.run("random", 2, folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let row = row(folder.path());
    assert!(row.touches.iter().all(|touch| touch.contact().is_some()), "{row:?}");
    println!("the twin counted {}", twin.end());
}

/// An independent client of a UR's driver.
fn peer(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var("PALPATE_PEER").expect("PALPATE_PEER"));
    command.arg("tests/ros2/ur_peer.py").args(arguments);
    command
}

#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_peer_of_another_implementation_drives_the_twin_of_a_ur() {
    let network = Network::of(71, UR_EXPERIMENT);
    let twin = TwinProcess::new(&network, UR_EXPERIMENT, &[]);
    let output = peer(&["drive", "71"]).output().unwrap();
    let values = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{values}{}", String::from_utf8_lossy(&output.stderr));
    println!("{}", values.trim());
    twin.end();
}

/// An operator confirms, skips and moves touches; the same command continues with the same ones.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn an_operator_is_asked_before_each_touch() {
    let network = Network::of(73, UR_EXPERIMENT);
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
