//! Tests of an arm over topics, run in a network namespace by `make test PART=ros2`. They are
//! ignored otherwise, because DDS multicasts to the local network.

use crate::common::lab::{
    CELL, EXPERIMENT, Network, TwinProcess, contacts_off_m, count, row, touch_sets,
};
use palpate::backend::pace;
use palpate::experiment::{Experiment, Simulation};
use palpate::format::counted;
use palpate::robot::arm::ArmSettings;
use palpate::ros::arm::RosArm;
use palpate::ros::connect;
use palpate::ros::joints::JointNames;
use palpate::ros::link::Link;
use palpate::ros::service::Service;
use palpate::ros::settings::{MappingKind, RosSettings};
use palpate::ros::topics::{CommandTopic, Endpoint};
use palpate::ros::transport::{Delivery, Packet};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::sync::{Arc, Mutex};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Number of touches per planner; fewer if time is short.
fn touches() -> u32 {
    count("PALPATE_TOUCHES", 20)
}

/// Maximum number of overruns due to a busy machine.
const LATE: u32 = 4;

/// Runs an exploration; after an overrun of the robot controller the same command continues it.
fn run_to_its_end(network: &Network, planner: &str, out: &Path) {
    for halts in 0..=LATE {
        let mut run = network.run(planner, touches(), out);
        if halts > 0 {
            run.arg("--clear-fault");
        }
        let output = run.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() {
            println!("{planner}: {halts} halts because this machine was late");
            return;
        }
        let is_late = said.contains("commands ceased") || said.contains("no new message on");
        assert!(is_late, "{planner}: {said}");
        sleep(Duration::from_millis(500));
    }
    panic!("{planner}: late {LATE} times");
}

/// Runs an exploration with each planner in turn, so that each side has a processor; meanwhile an
/// independent peer reads the first explorer's messages.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn the_container_is_explored_over_topics_as_in_the_simulator() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = [(Network::new(11), "active"), (Network::new(12), "random")];
    let [listener, _] = jobs.each_ref().map(|(network, planner)| {
        let twin = TwinProcess::new(network, EXPERIMENT, &[]);
        let out = folder.path().join(planner);
        let heard = std::thread::scope(|scope| {
            scope.spawn(|| run_to_its_end(network, planner, &out));
            (*planner == "active").then(|| {
                sleep(Duration::from_secs(6));
                network.peer("listen", &["8"]).output().unwrap()
            })
        });
        println!("{planner}: the twin counted {}", twin.end());
        heard
    });
    let listener = listener.unwrap();
    let heard = String::from_utf8_lossy(&listener.stdout).into_owned();
    assert!(listener.status.success(), "{heard}");
    println!("a peer of another implementation heard of the explorer: {}", heard.trim());

    let sets = ["trials=1", "planners=[\"active\",\"random\"]"].map(String::from);
    let sets = [&sets[..], &touch_sets(touches()), &[CELL[0].into()]].concat();
    let experiment = Experiment::load(Path::new(EXPERIMENT), &sets).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let mut far = Vec::new();
    let mut near = Vec::new();
    for (_, planner) in &jobs {
        let row = row(&folder.path().join(planner));
        assert_eq!(row.failure, None);
        far.push(row.touches.last().unwrap().metrics.unwrap().rmse_m);
        let entry = palpate::explore::planner::by_name(planner).unwrap();
        near.push(simulation.trial(entry, 0).touches.last().unwrap().metrics.unwrap().rmse_m);
        let off_m = contacts_off_m(&simulation, &row);
        let [.., second_m, worst_m] = off_m.as_slice() else { panic!("{off_m:?}") };
        println!("{planner}: contacts off the simulator's by {:.3} mm at most", 1e3 * worst_m);
        // On a steep surface a late tick moves the contact; one such contact is allowed.
        assert!(*second_m < 3e-4 && *worst_m < 6e-4, "{planner}: {off_m:?}");
    }
    println!("RMSE of active and random, over topics {far:?} m, in the simulator {near:?} m");
    // The winner is compared only if the difference is clear.
    if near[0].max(near[1]) > 1.5 * near[0].min(near[1]) {
        assert_eq!(far[0] < far[1], near[0] < near[1], "{far:?} {near:?}");
    }
}

/// An independent peer, written from the table of topics alone, makes a touch with the messages of
/// either driver.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_peer_of_another_implementation_drives_the_twin_through_a_touch() {
    let folder = tempfile::tempdir().unwrap();
    let scene = fs::canonicalize("scenes/container_finger.toml").unwrap();
    for (number, peer, type_name) in [
        (13, "hand", "biotac_sensors/msg/BioTacHand"),
        (14, "fingers", "sr_robot_msgs/msg/BiotacAll"),
    ] {
        let network = Network::new(number);
        let table = network.settings.key("topics.tactile");
        let text = format!(
            "name = \"peer\"\nplanners = [\"active\"]\ntrials = 1\ninitial_touches = 1\ntouches = 1\ngrid = 5\n\
             scene = {scene:?}\n[{table}]\ntype = \"{type_name}\"\n"
        );
        let path = folder.path().join(format!("{peer}.toml"));
        fs::write(&path, text).unwrap();
        let twin = TwinProcess::new(&network, path.to_str().unwrap(), &[]);
        let output = network.peer("touch", &[peer]).output().unwrap();
        let values = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{values}{}", String::from_utf8_lossy(&output.stderr));
        let felt_m = serde_json::from_str::<Value>(&values).unwrap()["felt_y_m"].as_f64().unwrap();
        // The container's front is at most 60 mm before its axis at y = -0.65 m; the tip's centre
        // is 7 mm before that.
        assert!((-0.65..-0.58).contains(&felt_m), "{felt_m}");
        println!("{peer}: {}", values.trim());
        twin.end();
    }
}

/// Sends commands at 250 Hz to an independent peer, which answers each.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn the_loop_loses_nothing_at_250_hz() {
    let span_s: f64 =
        std::env::var("PALPATE_LOOP_S").ok().and_then(|text| text.parse().ok()).unwrap_or(10.0);
    let network = Network::new(15);
    let mut peer = network
        .peer("echo", &[&(span_s + 4.0).to_string()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let answers: Arc<Mutex<Vec<(f64, f64)>>> = Arc::default();
    let open = connect(&network.settings, Endpoint::Explorer, Vec::new()).unwrap();
    let period = Duration::from_millis(4);
    let echo = Arc::clone(&answers);
    let take = move |delivery| {
        // The peer returns the stamp of the command.
        if let Delivery::Packet { packet: Packet::Joints(message), .. } = delivery {
            echo.lock().unwrap().push((message.header.stamp.s(), pace::now_s()));
        }
    };
    let link = Link::open(open, period, take, || None).unwrap();
    link.open_commands();
    let topic = CommandTopic { max_age_s: 0.02, ..CommandTopic::default() };
    let names =
        JointNames::new(["S1", "S2", "S3", "E1", "E2", "W1", "W2"].map(String::from).into());
    let send = || link.send(names.command(pace::now_s(), &[0.0; 7], &topic));
    let waiting = Instant::now();
    while answers.lock().unwrap().is_empty() {
        assert!(waiting.elapsed().as_secs() < 20, "no answer: discovery takes too long");
        send();
        sleep(Duration::from_millis(50));
    }
    sleep(Duration::from_millis(300));
    answers.lock().unwrap().clear();
    let (begun, mut sent) = (Instant::now(), 0_u32);
    while begun.elapsed().as_secs_f64() < span_s {
        send();
        sent += 1;
        sleep((begun + period * sent).saturating_duration_since(Instant::now()));
    }
    sleep(Duration::from_millis(300));
    let mut trips_s: Vec<f64> =
        answers.lock().unwrap().iter().map(|(sent_s, back_s)| back_s - sent_s).collect();
    trips_s.sort_by(f64::total_cmp);
    let at = |share: f64| 1e3 * trips_s[((trips_s.len() - 1) as f64 * share) as usize];
    println!(
        "{sent} sent, {} back; round trip p50 {:.2} p95 {:.2} p99 {:.2} max {:.2} ms",
        trips_s.len(),
        at(0.5),
        at(0.95),
        at(0.99),
        at(1.0)
    );
    let lost = sent as usize - trips_s.len();
    assert!(lost <= sent as usize / 1000, "{lost} of {sent} lost");
    assert!(at(0.5) < 5.0, "{}", at(0.5));
    peer.wait().unwrap();
}

/// After a fault in the middle of a trial the touches are kept, and the same command continues.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_run_that_was_halted_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let network = Network::new(20);
    let twin = TwinProcess::new(&network, EXPERIMENT, &["--inject", "estop@9+1"]);
    let first = network.run("random", 6, &out).arg("--record").output().unwrap();
    let said = String::from_utf8_lossy(&first.stderr).into_owned();
    assert_eq!(first.status.code(), Some(2), "{said}");
    assert!(
        said.contains("emergency stop") && said.contains("continue with: palpate run"),
        "{said}"
    );
    let lines = |text: &str| text.lines().filter(|line| line.contains("\"touch\"")).count();
    let journal = fs::read_to_string(out.join("touches.jsonl")).unwrap();
    let kept = lines(&journal);
    assert!((1..6).contains(&kept), "{journal}");
    assert!(said.contains(&counted(kept, "touch")), "{said}");
    sleep(Duration::from_millis(1500));
    let unseen = network.run("random", 6, &out).output().unwrap();
    let said = String::from_utf8_lossy(&unseen.stderr).into_owned();
    assert!(said.contains("a fault halted the run") && said.contains("--clear-fault"), "{said}");
    let mut second = network.run("random", 6, &out);
    let second = second.args(["--clear-fault", "--record"]).output().unwrap();
    assert!(second.status.success(), "{}", String::from_utf8_lossy(&second.stderr));
    let row = row(&out);
    assert_eq!((row.failure, row.touches.len()), (None, 6));
    let after = fs::read_to_string(out.join("touches.jsonl")).unwrap();
    assert!(after.starts_with(&journal) && lines(&after) == 6);
    // Both parts of the recording can be replayed, on any machine.
    let whole = out.join("recordings/random-0000.mcap");
    let replay = network.palpate(&["check", whole.to_str().unwrap()]).output().unwrap();
    let values = String::from_utf8_lossy(&replay.stdout).into_owned();
    assert!(replay.status.success(), "{values}{}", String::from_utf8_lossy(&replay.stderr));
    assert!(
        values.contains("random-0000-part-2.mcap") && values.contains("6 touches identical"),
        "{values}"
    );
    twin.end();
}

/// Tests a status that is published once and latched, and services in another participant than the
/// topics, discovered two seconds later, with the request identity in the payload.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn an_arm_of_another_implementation_is_heard_and_answers() {
    let network = Network::new(16);
    let arm = network.peer("arm", &["14"]).stdout(Stdio::piped()).spawn().unwrap();
    // The status was published before any subscriber existed.
    sleep(Duration::from_millis(1500));
    let chain = ArmSettings::default().chain().unwrap();
    let on_change = RosSettings { status_on_change: true, ..network.settings.clone() };
    let lab = RosArm::connect_over(&on_change, &chain).unwrap();
    for service in Service::COMMON {
        lab.call(&service).unwrap_or_else(|fault| panic!("{}: {fault}", service.name("/pa10")));
    }
    drop(lab);
    // The wrong mapping gets no answer, and the message names the setting.
    let other =
        RosSettings { service_mapping: MappingKind::Enhanced, connect_timeout_s: 2.0, ..on_change };
    let lab = RosArm::connect_over(&other, &chain).unwrap();
    let fault = lab.call(&Service::Hold).unwrap_err().to_string();
    assert!(
        fault.contains("did not answer within 2 s") && fault.contains("service_mapping"),
        "{fault}"
    );
    drop(lab);
    let values = String::from_utf8(arm.wait_with_output().unwrap().stdout).unwrap();
    let called: Value = serde_json::from_str(&values).unwrap();
    for service in Service::COMMON {
        let name = Value::from(service.name("/pa10"));
        assert!(called["called"].as_array().unwrap().contains(&name), "{name}: {values}");
    }
}

/// Number of memberships of each network interface of this namespace in the DDS multicast group.
fn multicast_members(device: &str) -> u32 {
    let text = fs::read_to_string("/proc/net/igmp").unwrap();
    let mut is_device = false;
    let mut members = 0;
    for line in text.lines().skip(1) {
        let mut words = line.split_whitespace();
        if line.starts_with('\t') {
            // 239.255.0.1, little-endian.
            if is_device && words.next() == Some("0100FFEF") {
                members += words.next().unwrap().parse::<u32>().unwrap();
            }
        } else {
            is_device = words.nth(1) == Some(device);
        }
    }
    members
}

/// Only the interfaces named in the settings are used.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn only_the_named_interfaces_are_used() {
    let network = Network::new(17);
    let set = ["--set", "backend.ros2.interfaces=[\"lo\"]"];
    let counts = || ["lo", "dds0"].map(multicast_members);
    let before = counts();
    let twin = TwinProcess::new(&network, EXPERIMENT, &set);
    let with_lo = counts();
    assert!(with_lo[0] > before[0] && with_lo[1] == before[1], "{before:?} {with_lo:?}");
    let settings = RosSettings { interfaces: vec!["lo".into()], ..network.settings.clone() };
    let lab = RosArm::connect_over(&settings, &ArmSettings::default().chain().unwrap()).unwrap();
    assert_eq!(counts()[1], before[1]);
    drop((lab, twin));
    if Path::new("/sys/class/net/dds0").exists() {
        let twin = TwinProcess::new(&network, EXPERIMENT, &[]);
        assert!(counts()[1] > before[1], "without a setting all are used");
        drop(twin);
        let unknown = RosSettings { interfaces: vec!["wlan7".into()], ..network.settings.clone() };
        let fault =
            RosArm::connect_over(&unknown, &ArmSettings::default().chain().unwrap()).err().unwrap();
        assert!(
            fault.to_string().contains("wlan7") && fault.to_string().contains("dds0"),
            "{fault}"
        );
    }
}
