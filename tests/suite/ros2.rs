//! An arm behind topics of ROS 2: run in a network namespace by `make test-ros2`, and ignored without
//! one, because DDS sends to whoever is near.

use palpate::backend::ros::clock;
use palpate::backend::ros::connect::connect;
use palpate::backend::ros::joints::JointNames;
use palpate::backend::ros::link::{Link, Sink};
use palpate::backend::ros::packet::Packet;
use palpate::backend::ros::settings::{BackendKind, BackendSettings};
use palpate::backend::ros::topics::Side;
use palpate::backend::ros::transport::Delivery;
use palpate::experiment::row::TrialRow;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::probe::Touch;
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

const EXPERIMENT: &str = "experiments/container_pa10.toml";

fn palpate() -> Command {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
}

/// A twin in a process of its own, and what it has told.
struct TwinProcess {
    child: Child,
    events: Arc<Mutex<Vec<Value>>>,
    reader: Option<JoinHandle<()>>,
}

impl TwinProcess {
    fn new(path: &str, domain: u16, more: &[&str]) -> Self {
        let mut child = palpate()
            .args(["--quiet", "twin", path, "--domain", &domain.to_string()])
            .args(more)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let events: Arc<Mutex<Vec<Value>>> = Arc::default();
        let (lines, told) = (BufReader::new(child.stdout.take().unwrap()), Arc::clone(&events));
        let reader = std::thread::spawn(move || {
            for line in lines.lines().map_while(Result::ok) {
                told.lock().unwrap().push(serde_json::from_str(&line).unwrap());
            }
        });
        let twin = Self { child, events, reader: Some(reader) };
        twin.wait_for(|event| event == "serving", 20.0);
        twin
    }

    /// When an event of this kind was told last; waits for it.
    fn wait_for(&self, is_it: impl Fn(&Value) -> bool, patience_s: f64) -> f64 {
        let begun = Instant::now();
        loop {
            let events = self.events.lock().unwrap();
            let found = events.iter().rev().find(|line| is_it(&line["event"]));
            if let Some(at_s) = found.and_then(|line| line["time_unix_s"].as_f64()) {
                return at_s;
            }
            drop(events);
            assert!(begun.elapsed().as_secs_f64() < patience_s, "{:?}", self.events);
            sleep(Duration::from_millis(5));
        }
    }

    /// Whether it moves, by what it told last.
    fn is_moving(&self) -> bool {
        let events = self.events.lock().unwrap();
        let last = events
            .iter()
            .rev()
            .find(|line| line["event"] == "moving" || line["event"] == "at_rest");
        last.is_some_and(|line| line["event"] == "moving")
    }

    /// Ends it; what it counted.
    fn end(mut self) -> Value {
        signal(&self.child, "INT");
        self.child.wait().unwrap();
        self.reader.take().unwrap().join().unwrap();
        let events = self.events.lock().unwrap();
        events.last().unwrap()["ended"].clone()
    }
}

impl Drop for TwinProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args([&format!("-{name}"), &id]).status().unwrap().success());
}

/// `palpate run` of the shipped experiment on the arm of `domain`: nothing of it is changed but the
/// backend, the planner and the number of trials.
fn run(domain: u16, planner: &str, touches: u32, out: &Path) -> Command {
    let sets = [
        "backend.kind=\"ros2\"".to_owned(),
        format!("backend.domain={domain}"),
        "trials=1".into(),
        format!("touches={touches}"),
        format!("planners=[\"{planner}\"]"),
    ];
    let mut command = palpate();
    command.args(["--quiet", "run", EXPERIMENT, "--no-report", "--out"]).arg(out);
    for set in &sets {
        command.args(["--set", set]);
    }
    command
}

fn row(out: &Path) -> TrialRow {
    let text = fs::read_to_string(out.join("trials.jsonl")).unwrap();
    serde_json::from_str(text.lines().next().unwrap()).unwrap()
}

fn python(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var("PALPATE_PEER").expect("PALPATE_PEER"));
    command.arg("tests/ros2/peer.py").args(arguments);
    command
}

/// How many touches are made with each planner; fewer where time is short.
fn touches() -> u32 {
    std::env::var("PALPATE_TOUCHES").ok().and_then(|text| text.parse().ok()).unwrap_or(20)
}

/// An exploration with each planner, one twin for each, at the same time; meanwhile a peer of another
/// implementation reads what the explorer sends.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn the_container_is_explored_over_topics_as_in_the_simulator() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = [(11, "active"), (12, "random")];
    let twins = jobs.map(|(domain, _)| TwinProcess::new(EXPERIMENT, domain, &[]));
    let runs = jobs.map(|(domain, planner)| {
        run(domain, planner, touches(), &folder.path().join(planner)).spawn().unwrap()
    });
    sleep(Duration::from_secs(6));
    let listener = python(&["listen", "11", "8"]).output().unwrap();
    let heard = String::from_utf8_lossy(&listener.stdout).into_owned();
    for mut child in runs {
        assert!(child.wait().unwrap().success());
    }
    assert!(listener.status.success(), "{heard}");
    println!("a Cyclone DDS peer heard of the explorer: {}", heard.trim());
    for (twin, (_, planner)) in twins.into_iter().zip(jobs) {
        println!("{planner}: the twin counted {}", twin.end());
    }

    let sets = ["trials=1", "planners=[\"active\",\"random\"]"].map(String::from);
    let sets = [&sets[..], &[format!("touches={}", touches())]].concat();
    let experiment = Experiment::load(Path::new(EXPERIMENT), &sets).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let mut far = Vec::new();
    let mut near = Vec::new();
    for (_, planner) in jobs {
        let row = row(&folder.path().join(planner));
        assert_eq!(row.failure, None);
        far.push(row.touches.last().unwrap().metrics.unwrap().rmse_m);
        let entry = palpate::explore::planner::by_name(planner).unwrap();
        near.push(simulation.trial(entry, 0).touches.last().unwrap().metrics.unwrap().rmse_m);
        // The same targets, one after another, by the body in this process.
        let mut probe = simulation.probe(0).unwrap();
        let mut off_m = Vec::new();
        for touch in &row.touches {
            let approach = simulation.task().approach(&touch.target);
            let here = match probe.touch(&approach).unwrap() {
                Touch::Contact(contact) => Some(contact.p_wc),
                _ => None,
            };
            let there = touch.contact.map(nalgebra::Point3::from);
            assert_eq!(here.is_some(), there.is_some(), "{:?}", touch.target);
            if let (Some(here), Some(there)) = (here, there) {
                off_m.push((here - there).norm());
            }
        }
        off_m.sort_by(f64::total_cmp);
        let [.., second_m, worst_m] = off_m.as_slice() else { panic!("{off_m:?}") };
        println!("{planner}: contacts off the simulator's by {:.3} mm at most", 1e3 * worst_m);
        // Where the surface is steep a tick that comes late moves the contact: one may.
        assert!(*second_m < 3e-4 && *worst_m < 6e-4, "{planner}: {off_m:?}");
    }
    println!("RMSE of active and random, over topics {far:?} m, in the simulator {near:?} m");
    // Who wins is asked where somebody does.
    if near[0].max(near[1]) > 1.5 * near[0].min(near[1]) {
        assert_eq!(far[0] < far[1], near[0] < near[1], "{far:?} {near:?}");
    }
}

/// Written from the table of topics alone, it makes a touch, with either driver's messages.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn a_peer_of_another_implementation_drives_the_twin_through_a_touch() {
    let folder = tempfile::tempdir().unwrap();
    let scene = fs::canonicalize("scenes/container_finger.toml").unwrap();
    for (domain, peer, type_name) in [
        (13, "hand", "biotac_sensors/msg/BioTacHand"),
        (14, "fingers", "sr_robot_msgs/msg/BiotacAll"),
    ] {
        let text = format!(
            "name = \"peer\"\nplanners = [\"active\"]\ntrials = 1\ninitial_touches = 1\ntouches = 1\ngrid = 5\n\
             scene = {scene:?}\n[backend.topics.tactile]\ntype = \"{type_name}\"\n"
        );
        let path = folder.path().join(format!("{peer}.toml"));
        fs::write(&path, text).unwrap();
        let twin = TwinProcess::new(path.to_str().unwrap(), domain, &[]);
        let output = python(&["touch", &domain.to_string(), peer]).output().unwrap();
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{told}{}", String::from_utf8_lossy(&output.stderr));
        let felt_m = serde_json::from_str::<Value>(&told).unwrap()["felt_y_m"].as_f64().unwrap();
        // The container's front stands at most 60 mm before its axis at y = -0.65 m; the tip's centre is
        // 7 mm before that.
        assert!((-0.65..-0.58).contains(&felt_m), "{felt_m}");
        println!("{peer}: {}", told.trim());
        twin.end();
    }
}

/// Sends itself back what it is told, with the stamp of the command.
struct Echo(Arc<Mutex<Vec<(f64, f64)>>>);

impl Sink for Echo {
    fn take(&mut self, delivery: Delivery) {
        if let Delivery::Packet { packet: Packet::Joints(message), .. } = delivery {
            self.0.lock().unwrap().push((message.header.stamp.s(), clock::now_s()));
        }
    }

    fn tick(&mut self, _: &mut dyn FnMut(Packet)) {}
}

/// Commands at 250 Hz to a peer of another implementation, which answers each.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn the_loop_loses_nothing_at_250_hz() {
    let span_s: f64 =
        std::env::var("PALPATE_LOOP_S").ok().and_then(|text| text.parse().ok()).unwrap_or(10.0);
    let settings = BackendSettings { kind: BackendKind::Ros2, domain: 15, ..Default::default() };
    let mut peer = python(&["echo", "15", &(span_s + 4.0).to_string()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let answers: Arc<Mutex<Vec<(f64, f64)>>> = Arc::default();
    let open = connect(&settings, Side::Explorer, Vec::new()).unwrap();
    let period = Duration::from_millis(4);
    let link = Link::open(open, period, Box::new(Echo(Arc::clone(&answers)))).unwrap();
    let names =
        JointNames::new(["S1", "S2", "S3", "E1", "E2", "W1", "W2"].map(String::from).into());
    let send = || link.send(names.command(clock::now_s(), 0.02, &[0.0; 7], false));
    // Until the two have found each other.
    while answers.lock().unwrap().is_empty() {
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

/// Who is stopped or killed, on which side: the other notices.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn the_death_of_either_side_stops_the_other() {
    let folder = tempfile::tempdir().unwrap();
    for (domain, name) in [(16, "STOP"), (17, "KILL")] {
        // The explorer.
        let out = folder.path().join(name);
        let twin = TwinProcess::new(EXPERIMENT, domain, &[]);
        let mut explorer = run(domain, "random", 20, &out).stderr(Stdio::piped()).spawn().unwrap();
        twin.wait_for(|event| event == "moving", 30.0);
        sleep(Duration::from_millis(300));
        assert!(twin.is_moving());
        let at_s = clock::now_s();
        signal(&explorer, name);
        sleep(Duration::from_millis(1000));
        let rest_s = twin.wait_for(|event| event == "at_rest", 1.0) - at_s;
        println!("explorer, SIG{name}: the twin is at rest after {:.0} ms", 1e3 * rest_s);
        assert!((0.0..0.5).contains(&rest_s), "{rest_s}");
        if name == "STOP" {
            // What was queued moves nothing; the explorer is told why.
            let count = twin.events.lock().unwrap().len();
            signal(&explorer, "CONT");
            let output = explorer.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(2));
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            let is_told = said.contains("commands ceased") || said.contains("nothing new on");
            assert!(is_told, "{said}");
            let events = twin.events.lock().unwrap();
            assert!(events[count..].iter().all(|line| line["event"] != "moving"), "{events:?}");
        } else {
            explorer.wait().unwrap();
        }
        twin.end();
    }
    for (domain, name) in [(18, "STOP"), (19, "KILL")] {
        // The twin.
        let out = folder.path().join(format!("twin-{name}"));
        let twin = TwinProcess::new(EXPERIMENT, domain, &[]);
        let explorer = run(domain, "random", 20, &out).stderr(Stdio::piped()).spawn().unwrap();
        twin.wait_for(|event| event == "moving", 30.0);
        sleep(Duration::from_millis(300));
        let at_s = clock::now_s();
        signal(&twin.child, name);
        let output = explorer.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains("nothing new on"), "{said}");
        let journal = fs::read_to_string(out.join("touches.jsonl")).unwrap();
        let fault: Value = serde_json::from_str(journal.lines().last().unwrap()).unwrap();
        let found_s = fault["time_unix_s"].as_f64().unwrap() - at_s;
        println!("twin, SIG{name}: the explorer halts after {:.0} ms", 1e3 * found_s);
        assert!((0.0..0.5).contains(&found_s), "{found_s}");
        if name == "STOP" {
            signal(&twin.child, "CONT");
        }
    }
}

/// A fault in the middle of a trial: what was touched is kept, and the same command goes on.
#[test]
#[ignore = "needs a network namespace: make test-ros2"]
fn a_run_that_was_halted_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let twin = TwinProcess::new(EXPERIMENT, 20, &["--inject", "estop@9+1"]);
    let first = run(20, "random", 6, &out).output().unwrap();
    let said = String::from_utf8_lossy(&first.stderr).into_owned();
    assert_eq!(first.status.code(), Some(2), "{said}");
    assert!(said.contains("emergency stop") && said.contains("touches of it are kept"), "{said}");
    let lines = |text: &str| text.lines().filter(|line| line.contains("\"touch\"")).count();
    let journal = fs::read_to_string(out.join("touches.jsonl")).unwrap();
    let kept = lines(&journal);
    assert!((1..6).contains(&kept), "{journal}");
    sleep(Duration::from_millis(1500));
    let second = run(20, "random", 6, &out).arg("--clear-fault").output().unwrap();
    assert!(second.status.success(), "{}", String::from_utf8_lossy(&second.stderr));
    let row = row(&out);
    assert_eq!((row.failure, row.touches.len()), (None, 6));
    let after = fs::read_to_string(out.join("touches.jsonl")).unwrap();
    assert!(after.starts_with(&journal) && lines(&after) == 6);
    twin.end();
}
