//! Tests of failures between an explorer and its arm: which side detects each, and how soon the arm
//! is at rest. Prints the table of `docs/safety.md`.

use crate::common::lab::{EXPERIMENT, Network, TwinProcess, journal, set_network, signal};
use palpate::backend::pace;
use palpate::ros::connect;
use palpate::ros::joints::JointNames;
use palpate::ros::link::Link;
use palpate::ros::topics::{CommandTopic, Endpoint};
use serde_json::Value;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// Time without detection; far above any limit, for busy machines.
const NOT_SEEN_S: f64 = 0.6;

/// An exploration that is disturbed while the arm moves.
struct FaultScenario {
    network: Network,
    twin: TwinProcess,
    explorer: Child,
    folder: tempfile::TempDir,
}

impl FaultScenario {
    fn new(number: u16, injected: &[&str], sets: &[&str]) -> Self {
        let network = Network::new(number);
        let injected: Vec<&str> = injected.iter().flat_map(|name| ["--inject", *name]).collect();
        let twin = TwinProcess::new(&network, EXPERIMENT, &injected);
        let folder = tempfile::tempdir().unwrap();
        let mut run = network.run("random", 2, folder.path());
        sets.iter().for_each(|set| {
            run.args(["--set", set]);
        });
        let explorer = run.stderr(Stdio::piped()).spawn().unwrap();
        Self { network, twin, explorer, folder }
    }

    /// Waits for the explorer's end; returns its output and the time of its halt.
    fn halted(&mut self) -> (String, f64) {
        let mut said = String::new();
        let mut errors = self.explorer.stderr.take().unwrap();
        std::io::Read::read_to_string(&mut errors, &mut said).unwrap();
        assert_eq!(self.explorer.wait().unwrap().code(), Some(2), "{said}");
        let halt = journal(self.folder.path()).pop().unwrap();
        assert!(halt["fault"].is_string(), "{halt}");
        (said, halt["time_unix_s"].as_f64().unwrap())
    }

    /// Time from `since_s` to the first rest of the simulated robot; it must be at rest now.
    fn rest_s(&self, since_s: f64) -> f64 {
        assert!(self.twin.rest_s().is_some(), "{:?}", self.twin.events);
        let events = self.twin.events.lock().unwrap();
        let at_s = |line: &Value| line["time_unix_s"].as_f64().unwrap();
        let first = events.iter().find(|line| line["event"] == "at_rest" && at_s(line) >= since_s);
        first.map_or(0.0, |line| at_s(line) - since_s)
    }
}

fn values(what: &str, seen_s: Option<f64>, rest_s: Option<f64>, said: &str) {
    let ms = |time_s: Option<f64>| {
        time_s.map_or("–".into(), |time_s| format!("{:.0} ms", 1e3 * time_s))
    };
    let said = said.lines().next().unwrap_or_default();
    println!("| {what} | {} | {} | {said} |", ms(seen_s), ms(rest_s));
    assert!([seen_s, rest_s].into_iter().flatten().all(|time_s| time_s < NOT_SEEN_S), "{what}");
}

/// Tests failures on the arm's side and the explorer's message for each.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn what_fails_on_the_arms_side_stops_the_exploration() {
    let mut other = Vec::new();
    for (i, (name, words)) in [
        ("nan", "is NaN"),
        ("six_names", "no joint"),
        ("swapped_names", "beyond its speed limit"),
        ("future", "in the future"),
        ("no_joints", "no new message on /joint_states"),
        ("no_wrench", "no new message on /ft_sensor/wrench"),
        ("no_tactile", "no new message on /biotac_pub"),
        ("frozen", "standstill"),
        ("force_spike", "force"),
        ("estop", "emergency stop"),
        ("deadman", "dead-man"),
    ]
    .into_iter()
    .enumerate()
    {
        let mut scene = FaultScenario::new(30 + i as u16, &[&format!("{name}@1")], &[]);
        let (said, halted_s) = scene.halted();
        let begins = |event: &Value| event["failure"]["is_on"] == true;
        let at_s = scene.twin.wait_for(begins, 1.0);
        sleep(Duration::from_millis(500));
        // After a force-limit violation the finger retracts first, then the explorer reports it.
        let goes_back = name == "force_spike";
        let seen_s = Some(halted_s - at_s).filter(|_| !goes_back);
        let rest_s = Some(scene.rest_s(at_s)).filter(|_| !goes_back);
        values(name, seen_s, rest_s, &said);
        other.extend((!said.contains(words)).then_some((name, said)));
    }
    assert!(other.is_empty(), "{other:?}");
}

/// Tests network disturbances that do not lose the arm: the exploration continues.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn loss_latency_and_noise_are_lived_with() {
    for (i, name) in ["loss", "latency", "noise"].into_iter().enumerate() {
        let network = Network::new(45 + i as u16);
        let twin = TwinProcess::new(&network, EXPERIMENT, &["--inject", &format!("{name}@0")]);
        let folder = tempfile::tempdir().unwrap();
        let output = network.run("random", 1, folder.path()).output().unwrap();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        println!("{name}: the exploration ends as it should; the twin counted {}", twin.end());
    }
}

/// Either side is stopped or killed.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn the_death_of_either_side_stops_the_other() {
    for (number, name) in [(50, "STOP"), (51, "KILL")] {
        let mut scene = FaultScenario::new(number, &[], &[]);
        scene.twin.wait_until_it_moves();
        signal(&scene.explorer, name);
        let at_s = pace::now_s();
        sleep(Duration::from_secs(1));
        let seen_s = scene.twin.alarmed_s(at_s) - at_s;
        values(&format!("SIG{name} of the explorer"), Some(seen_s), Some(scene.rest_s(at_s)), "");
        if name == "STOP" {
            // Queued commands move nothing, and the explorer gets an error.
            let count = scene.twin.events.lock().unwrap().len();
            signal(&scene.explorer, "CONT");
            let (said, _) = scene.halted();
            let is_told = said.contains("commands ceased") || said.contains("no new message on");
            assert!(is_told, "{said}");
            let events = scene.twin.events.lock().unwrap();
            assert!(events[count..].iter().all(|line| line["event"] != "moving"), "{events:?}");
        } else {
            scene.explorer.wait().unwrap();
        }
    }
    for (number, name) in [(52, "STOP"), (53, "KILL")] {
        let mut scene = FaultScenario::new(number, &[], &[]);
        scene.twin.wait_until_it_moves();
        signal(&scene.twin.child, name);
        let at_s = pace::now_s();
        let (said, halted_s) = scene.halted();
        values(&format!("SIG{name} of the arm's side"), Some(halted_s - at_s), None, &said);
        assert!(said.contains("no new message on"), "{said}");
        if name == "STOP" {
            // It resumes with an outdated command.
            signal(&scene.twin.child, "CONT");
            let at_s = pace::now_s();
            sleep(Duration::from_secs(1));
            values("and after SIGCONT", None, Some(scene.rest_s(at_s)), "");
        }
    }
}

/// A network cable is disconnected and reconnected.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_network_that_is_gone_and_back_is_a_stop_and_no_more() {
    let mut scene = FaultScenario::new(54, &[], &[]);
    scene.twin.wait_until_it_moves();
    let before_s = pace::now_s();
    set_network(false);
    let at_s = pace::now_s();
    sleep(Duration::from_secs(1));
    let seen_s = scene.twin.alarmed_s(before_s) - at_s;
    let rest_s = scene.rest_s(at_s);
    let count = scene.twin.events.lock().unwrap().len();
    set_network(true);
    let (said, halted_s) = scene.halted();
    values("network gone: the arm's side", Some(seen_s), Some(rest_s), "");
    values("network gone: the explorer", Some(halted_s - at_s), None, &said);
    let events = scene.twin.events.lock().unwrap();
    assert!(events[count..].iter().all(|line| line["event"] != "moving"), "{events:?}");
    drop(events);
    let again = scene.network.run("random", 2, scene.folder.path()).arg("--clear-fault").output();
    let again = again.unwrap();
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
}

/// A second publisher also commands the arm.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_second_publisher_of_commands_stops_the_arm() {
    let mut scene = FaultScenario::new(55, &[], &[]);
    scene.twin.wait_until_it_moves();
    let before_s = pace::now_s();
    let open = connect(&scene.network.settings, Endpoint::Explorer, Vec::new()).unwrap();
    let second = Link::open(open, Duration::from_millis(20), drop, || None).unwrap();
    second.open_commands();
    let topic = CommandTopic { max_age_s: 0.02, ..CommandTopic::default() };
    let joints = ["S1", "S2", "S3", "E1", "E2", "W1", "W2"].map(String::from);
    let names = JointNames::new(joints.into());
    for _ in 0..50 {
        second.send(names.command(pace::now_s(), &[0.0; 7], &topic));
        sleep(Duration::from_millis(20));
    }
    let (said, halted_s) = scene.halted();
    let is_told_by_arm = said.contains("alarm");
    let at_s = if is_told_by_arm { scene.twin.alarmed_s(before_s) } else { before_s };
    values("two publishers", Some(halted_s - at_s), Some(scene.rest_s(at_s)), &said);
    assert!(said.contains("two publishers") || said.contains("2 publishers"), "{said}");
}

/// Tests states in which an explorer does not start.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn an_arm_that_speaks_otherwise_is_not_moved() {
    let network = Network::new(56);
    let key = network.settings.key("topics.tactile.type");
    let set = format!("{key}=\"sr_robot_msgs/msg/BiotacAll\"");
    let twin = TwinProcess::new(&network, EXPERIMENT, &[]);
    let folder = tempfile::tempdir().unwrap();
    let output = network.run("random", 1, folder.path()).args(["--set", &set]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("/biotac_pub"), "{said}");
    println!("| another type | before it moves | at rest | {} |", said.lines().next().unwrap());
    assert_eq!(twin.last(|event| event == "moving"), None);
}

/// A path that moves a link below the table is not started.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_way_into_the_table_is_refused_before_it_is_begun() {
    let network = Network::new(57);
    let twin = TwinProcess::new(&network, EXPERIMENT, &[]);
    let folder = tempfile::tempdir().unwrap();
    let mut run = network.run("random", 2, folder.path());
    let output = run.args(["--set", "backend.interlocks.lowest_m=0.45"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    println!(
        "| a way into the table | before it moves | at rest | {} |",
        said.lines().next().unwrap()
    );
    assert_eq!(twin.last(|event| event == "moving"), None, "{said}");
}
