//! Tests of a UR5e behind `ur_robot_driver` as its sources describe it: `tests/ros2/ur_driver.py`,
//! on another implementation of DDS, run in a network namespace by `make test PART=ros2`.

use crate::common::driver::{assert_on_plane, driver, passes_its_own_tests, refused, said, touch};
use crate::common::lab::{
    BALL_EXPERIMENT, End, Network, TwinProcess, count, end_planners_marked, signal,
};
use palpate::backend::{Backend, Command as Motion};
use palpate::experiment::Experiment;
use palpate::ros::arm::RosArm;
use palpate::ros::service::Service;
use palpate::ros::settings::RosSettings;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

/// Script of the peer.
const PEER: &str = "ur_driver.py";

fn network(number: u16) -> Network {
    Network::of(number, BALL_EXPERIMENT)
}

#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn the_peer_passes_its_own_tests() {
    passes_its_own_tests(PEER);
}

/// The contacts lie on the surface whatever the release, tool centre point, prefix and namespace.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_ur_touches_where_the_surface_is() {
    let touches = count("PALPATE_UR_TOUCHES", 6);
    let turned = "0.01,-0.03,0.15,0.4,-0.5,0.8";
    for (number, options, sets) in [
        (100, vec!["--release", "jazzy", "--tcp", "0,0,0.12,0,0,0"], vec![]),
        (
            101,
            vec!["--release", "lyrical", "--tcp", turned],
            vec!["backend.ros2.release=\"lyrical\""],
        ),
        (
            102,
            vec!["--release", "humble", "--namespace", "/ur5e", "--prefix", "ur5e_"],
            vec![
                "backend.ros2.release=\"humble\"",
                "backend.ros2.prefix=\"ur5e_\"",
                "backend.ros2.topics.namespace=\"/ur5e\"",
            ],
        ),
    ] {
        let network = network(number);
        let twin = driver(PEER, &network, &options);
        let folder = tempfile::tempdir().unwrap();
        let row = touch(&network, touches, folder.path(), &sets);
        assert_on_plane(&row, &format!("{options:?}"));
        let ended = twin.end();
        assert_eq!(ended["dropped"], json!({}), "{ended}");
        let active = ended["active"].to_string();
        assert!(active.contains("trajectory_controller"), "as it was before: {active}");
    }
}

/// A robot whose lengths and angles differ from the nominal ones is refused; with the URDF that its
/// driver publishes it touches where the surface is.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_calibrated_ur_touches_where_the_surface_is() {
    let network = network(103);
    let twin = driver(PEER, &network, &["--dh-error"]);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let words = refused(&mut network.run("random", 1, &out));
    assert!(words.contains("arm.calibration") && words.contains("doctor --arm"), "{words}");
    assert_eq!(twin.last(|event| event == "moving"), None, "{words}");
    let model = folder.path().join("robot.urdf");
    let mut doctor = network.palpate(&["doctor", "--arm", BALL_EXPERIMENT]);
    let output = doctor.arg("--save").arg(&model).output().unwrap();
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{lines}");
    for words in [
        "robot_mode, ur_dashboard_msgs/msg/RobotMode, on change, reliable, transient local",
        "frame tool0_controller",
        "WRONG   frames",
        "scaled_joint_trajectory_controller active",
    ] {
        assert!(lines.contains(words), "{words}: {lines}");
    }
    let calibrated = format!("scene.arm.calibration=\"{}\"", model.display());
    let row = touch(&network, count("PALPATE_UR_TOUCHES", 6), &out, &[&calibrated]);
    assert_on_plane(&row, "calibrated");
    twin.end();
}

/// Failures of the peer, and parts of the explorer's messages.
const STOPS: &[(&str, &str)] = &[
    ("protective_stop", "protective stop; remove its cause, enable the robot on the pendant"),
    ("estop", "emergency stop"),
    ("program_stop", "External Control"),
    ("remote_off", "the robot is POWER_OFF"),
    ("take_controllers", "scaled_joint_trajectory_controller"),
    ("goal", "goal"),
    ("wrench_silent", "no new message on /force_torque_sensor_broadcaster/wrench"),
    ("wrench_constant", "wrench age"),
    ("joints_silent", "no new message on /joint_states"),
    ("joints_frozen", "standstill"),
    ("packet_loss", "External Control"),
];

/// Largest time and way to rest after a failure.
const REST_S: f64 = 0.15;
const REST_MM: f64 = 10.0;

/// Returns time, s, and way, mm, of the arm to its rest after a failure.
fn rest(twin: &TwinProcess, name: &str) -> (f64, f64) {
    let events = twin.events.lock().unwrap();
    let is_it = |line: &&Value| line["event"] == "rested" && line["after"] == name;
    let found = events.iter().rev().find(is_it).unwrap_or_else(|| panic!("{name}: {events:?}"));
    (found["time_s"].as_f64().unwrap(), found["way_mm"].as_f64().unwrap())
}

/// Every stop ends the run with words, within 0.15 s and 10 mm of the failure, and the same command
/// goes on.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn failures_of_a_ur_bring_it_to_rest() {
    let mut problems = Vec::new();
    for (i, (name, words)) in STOPS.iter().enumerate() {
        let network = network(110 + i as u16);
        let twin = driver(PEER, &network, &["--from-motion", "--event", &format!("{name}@0.5+3")]);
        let folder = tempfile::tempdir().unwrap();
        let output = network.run("random", 1, folder.path()).output().unwrap();
        let message = said(&output);
        sleep(Duration::from_secs(3));
        let (time_s, way_mm) = rest(&twin, name);
        let first = message.lines().next().unwrap_or_default();
        println!("| {name} | {:.0} ms | {way_mm:.1} mm | {first} |", 1e3 * time_s);
        let is_stopped = output.status.code() == Some(2) && message.contains(words);
        let is_short = time_s < REST_S && way_mm < REST_MM;
        let again = network.run("random", 1, folder.path()).arg("--clear-fault").output().unwrap();
        if !is_stopped || !is_short || !again.status.success() {
            problems.push((name, message, time_s, way_mm, said(&again)));
        }
    }
    assert!(problems.is_empty(), "{problems:#?}");
}

/// An arm whose explorer is killed, stopped or cut off comes to rest by itself, and no touch is
/// lost.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_ur_without_its_explorer_comes_to_rest() {
    for (number, end) in [(122, End::Kill), (123, End::Stop), (124, End::Cut)] {
        let network = network(number);
        let twin = driver(PEER, &network, &[]);
        let folder = tempfile::tempdir().unwrap();
        let run = |touches| {
            let mut run = network.run("random", touches, folder.path());
            run.arg("--clear-fault");
            run
        };
        let times = count("PALPATE_UR_ENDS", 2);
        let rests = end_planners_marked(end, times, &twin, folder.path(), run, || {
            signal(&twin.child, "USR1");
        });
        assert_eq!(rests.len(), times as usize);
        for rest in rests {
            println!("{end:?}: {} s, {} mm", rest["time_s"], rest["way_mm"]);
            assert!(rest["time_s"].as_f64().unwrap() < REST_S, "{rest}");
            assert!(rest["way_mm"].as_f64().unwrap() < REST_MM, "{rest}");
        }
    }
}

/// A pause on the pendant, and half the speed, are waited for.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_paused_ur_is_waited_for() {
    for (number, event) in [(125, "pause@0.5+2"), (126, "slow@0.2")] {
        let network = network(number);
        let twin = driver(PEER, &network, &["--from-motion", "--event", event]);
        let folder = tempfile::tempdir().unwrap();
        assert_on_plane(&touch(&network, 2, folder.path(), &[]), event);
        twin.end();
    }
}

/// A second explorer with another folder is refused before it changes anything; the first goes on.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_second_explorer_is_refused_and_the_first_goes_on() {
    let network = network(127);
    let twin = driver(PEER, &network, &[]);
    let [first_out, second_out] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let mut first = network.run("random", 4, first_out.path());
    let first = first.stderr(Stdio::piped()).spawn().unwrap();
    twin.wait_for(|event| event == "moving", 30.0);
    let switches = |twin: &TwinProcess| {
        let events = twin.events.lock().unwrap();
        events.iter().filter(|line| line["event"] == "switch_controller").count()
    };
    let before = switches(&twin);
    for clear in [&[][..], &["--clear-fault"]] {
        let words = refused(network.run("random", 2, second_out.path()).args(clear));
        assert!(words.contains("command"), "{words}");
        println!("{}", words.lines().next().unwrap_or_default());
    }
    assert_eq!(switches(&twin), before);
    let output = first.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
}

/// Mock hardware has no forces and no status: a run names the rehearsal, which follows approaches
/// above the surface.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_rehearsal_needs_no_forces() {
    let network = network(128);
    let twin = driver(PEER, &network, &["--mock"]);
    let folder = tempfile::tempdir().unwrap();
    let words = refused(&mut network.run("random", 2, folder.path()));
    assert!(words.contains("--dry"), "{words}");
    assert_eq!(twin.last(|event| event == "moving"), None, "{words}");
    let output = network.run("random", 2, folder.path()).arg("--dry").output().unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}", said(&output));
    assert!(twin.last(|event| event == "moving").is_some());
    let ended = twin.end();
    assert!(ended["farthest_m"].as_f64().unwrap() > 0.005, "{ended}");
}

/// A driver with another setup is refused by the name of what differs: nothing moves, and its
/// controllers stay as they are.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_driver_set_up_otherwise_is_named_and_left_as_it_was() {
    let passthrough = "passthrough_trajectory_controller";
    for (number, options, words) in [
        (129, vec!["--release", "humble"], "backend.ros2.release"),
        (130, vec!["--release", "lyrical"], "release = \"lyrical\""),
        (131, vec!["--active", passthrough], passthrough),
        (133, vec!["--event", "estop@0"], "emergency stop"),
        (134, vec!["--event", "program_stop@0"], "External Control"),
    ] {
        let network = network(number);
        let twin = driver(PEER, &network, &options);
        let folder = tempfile::tempdir().unwrap();
        let message = refused(&mut network.run("random", 1, folder.path()));
        println!("{options:?}: {}", message.lines().next().unwrap_or_default());
        assert!(message.contains(words), "{options:?}: {message}");
        assert_eq!(twin.last(|event| event == "moving"), None, "{options:?}: {message}");
        let ended = twin.end();
        assert_eq!(ended["farthest_rad"].as_f64(), Some(0.0), "{ended}");
        if options[0] == "--active" {
            assert!(ended["active"].to_string().contains(passthrough), "{ended}");
        }
    }
}

/// Another controller that moved the arm before is active again afterwards.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn the_controller_that_was_active_is_active_again() {
    let network = network(135);
    let before = "forward_velocity_controller";
    let arm = driver(PEER, &network, &["--active", before]);
    let experiment = Experiment::load(Path::new(BALL_EXPERIMENT), &[]).unwrap();
    let chain = experiment.scene.arm.unwrap().chain().unwrap();
    let patient = RosSettings { connect_timeout_s: 8.0, ..network.settings.clone() };
    let lab = RosArm::connect_over(&patient, &chain).unwrap();
    lab.call(&Service::ZeroFtSensor).unwrap();
    let mut body = lab.backend();
    let start = body.reset(0).unwrap().q[0];
    let mut command = Motion { qdot: vec![0.0; 6] };
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
    sleep(Duration::from_millis(300));
    let ended = arm.end();
    let active = ended["active"].to_string();
    assert!(active.contains(before) && !active.contains("scaled_joint"), "{active}");
    assert!(ended["accepted"]["scaled_joint_trajectory_controller"].as_u64().unwrap() > 20);
}
