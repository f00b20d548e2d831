//! Tests of a Franka Research 3 behind `franka_ros2` as its sources describe it:
//! `tests/ros2/franka_driver.py`, on another implementation of DDS, run in a network namespace by
//! `make test PART=ros2`.

use crate::common::driver::{assert_on_plane, driver, passes_its_own_tests, refused, said, touch};
use crate::common::lab::{Network, count};
use serde_json::json;
use std::thread::sleep;
use std::time::Duration;

const EXPERIMENT: &str = "experiments/real_fr3_ros2.toml";

/// Script of the peer.
const PEER: &str = "franka_driver.py";

fn network(number: u16) -> Network {
    Network::of(number, EXPERIMENT)
}

#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn the_peer_of_an_fr3_passes_its_own_tests() {
    passes_its_own_tests(PEER);
}

/// The contacts lie on the surface whatever the release, end effector, prefix and namespace, and
/// the controllers are as before.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn an_fr3_touches_where_the_surface_is() {
    let touches = count("PALPATE_UR_TOUCHES", 6);
    for (number, options, sets) in [
        (140, vec!["--release", "jazzy", "--tcp=0.01,-0.03,0.15,0.4,-0.5,0.8"], vec![]),
        (
            141,
            vec!["--release", "humble", "--namespace", "/NS_1", "--prefix", "left_", "--active="],
            vec![
                "backend.ros2.release=\"humble\"",
                "backend.ros2.prefix=\"left_\"",
                "backend.ros2.topics.namespace=\"/NS_1\"",
            ],
        ),
    ] {
        let network = network(number);
        let twin = driver(PEER, &network, &options);
        let folder = tempfile::tempdir().unwrap();
        let row = touch(&network, touches, folder.path(), &sets);
        assert_on_plane(&row, &format!("{options:?}"));
        let ended = twin.end();
        println!("{ended}");
        assert_eq!(ended["dropped"], json!({}), "{ended}");
        let was_active = !options.contains(&"--active=");
        let active = ended["active"].to_string();
        assert_eq!(active.contains("fr3_arm_controller"), was_active, "as before: {active}");
    }
}

/// A stop of the arm ends the run with its words, and an operator can go on.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn stops_of_an_fr3_end_the_run_and_say_what_to_do() {
    let topic = "/franka_robot_state_broadcaster";
    let mut problems = Vec::new();
    let silent = format!("no new message on {topic}/external_wrench_in_stiffness_frame");
    for (i, (event, release, words)) in [
        ("reflex", "jazzy", "franka_ros2 has stopped after a reflex"),
        ("reflex", "humble", "franka_ros2 has stopped after a reflex"),
        ("user_stopped", "jazzy", "error_recovery"),
        ("take_controllers", "jazzy", "joint_impedance_example_controller"),
        ("wrench_silent", "jazzy", &silent),
        ("wrench_constant", "jazzy", "wrench age"),
        ("joints_silent", "jazzy", "no new message on /franka/joint_states"),
    ]
    .into_iter()
    .enumerate()
    {
        let network = network(142 + i as u16);
        let event_at = format!("{event}@0.5+3");
        let options = ["--release", release, "--from-motion", "--event", &event_at];
        let twin = driver(PEER, &network, &options);
        let folder = tempfile::tempdir().unwrap();
        let set = format!("backend.ros2.release=\"{release}\"");
        let run = || {
            let mut run = network.run("random", 2, folder.path());
            run.args(["--set", &set]);
            run
        };
        let output = run().output().unwrap();
        let message = said(&output);
        println!("{event}, {release}: {}", message.lines().next().unwrap_or_default());
        // The event ends, and an operator recovers.
        sleep(Duration::from_secs(4));
        let again = run().arg("--clear-fault").output().unwrap();
        let is_stopped = output.status.code() == Some(2) && message.contains(words);
        if !is_stopped || !again.status.success() {
            problems.push((event, release, message, said(&again)));
        }
        twin.end();
    }
    assert!(problems.is_empty(), "{problems:#?}");
}

/// A robot that is not ready is refused before anything is switched.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn an_fr3_that_is_not_ready_is_refused() {
    for (i, (event, words)) in [
        ("reflex", "robot mode REFLEX (cartesian_reflex)"),
        ("user_stopped", "robot mode USER_STOPPED"),
        ("guiding", "robot mode GUIDING"),
        ("locked", "robot mode OTHER"),
        ("state_silent", "franka_robot_state_broadcaster"),
        ("goal", "goal"),
    ]
    .into_iter()
    .enumerate()
    {
        let network = network(150 + i as u16);
        let event_at = format!("{event}@0");
        let active = if event == "goal" { "fr3_arm_controller" } else { "" };
        let active = format!("--active={active}");
        let twin = driver(PEER, &network, &[&active, "--event", &event_at]);
        let folder = tempfile::tempdir().unwrap();
        let message = refused(&mut network.run("random", 1, folder.path()));
        println!("{event}: {}", message.lines().next().unwrap_or_default());
        assert!(message.contains(words), "{event}: {message}");
        let ended = twin.end();
        assert_eq!(ended["calls"]["/controller_manager/switch_controller"], json!(null), "{ended}");
    }
}

/// Another controller that moved the arm before is active again afterwards; a Cartesian one is left.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn controllers_of_an_fr3_are_left_as_they_were() {
    for (number, before, is_refused) in [
        (157, "joint_impedance_example_controller", false),
        (158, "cartesian_pose_example_controller", true),
    ] {
        let network = network(number);
        let twin = driver(PEER, &network, &[&format!("--active={before}")]);
        let folder = tempfile::tempdir().unwrap();
        let output = network.run("random", 1, folder.path()).output().unwrap();
        assert_eq!(output.status.success(), !is_refused, "{}", said(&output));
        let ended = twin.end();
        let active = ended["active"].to_string();
        assert!(active.contains(before) && !active.contains("fr3_arm"), "{active}");
    }
}
