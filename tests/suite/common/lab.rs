//! An explorer and a simulated robot in separate processes, over ROS 2.

use palpate::backend::pace;
use palpate::experiment::row::TrialRow;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::backend::arm::Connector;
use palpate::robot::arm::ArmSettings;
use palpate::ros::settings::RosSettings;
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

/// Experiment that is run over topics.
pub const EXPERIMENT: &str = "experiments/container_pa10.toml";

/// Experiment with a UR5e and its driver.
pub const UR_EXPERIMENT: &str = "experiments/real_ur5e.toml";

/// Experiment with a UR5e, its driver, and a ball on a stylus.
pub const BALL_EXPERIMENT: &str = "experiments/real_ur5e_ball.toml";

/// Settings of the container and the cell that a real arm needs.
pub const CELL: [&str; 3] = [
    "scene.zone.depth_m=[0.59, 0.71]",
    "backend.interlocks.lowest_m=0.0",
    "backend.interlocks.workspace_m=[[-1.0, 1.0], [-1.2, 0.6], [0.0, 1.8]]",
];

/// An isolated network: a ROS 2 domain.
pub struct Network {
    /// Settings of the arm for this network.
    pub settings: RosSettings,
    /// Experiment that is run.
    pub experiment: &'static str,
}

impl Network {
    /// Creates the ROS 2 network with this number, of the arm of an experiment.
    pub fn of(number: u16, experiment: &'static str) -> Self {
        let domain = format!("backend.ros2.domain={number}");
        let backend = Experiment::load(Path::new(experiment), &[domain]).unwrap().backend;
        let settings = backend.ros2.unwrap();
        Self { settings, experiment }
    }

    /// Creates the network with this number.
    pub fn new(number: u16) -> Self {
        let mut settings = RosSettings::default();
        settings.complete(Some(&ArmSettings::default()));
        settings.is_networked = true;
        settings.domain = Some(number);
        Self { settings, experiment: EXPERIMENT }
    }

    /// Settings as `--set` options.
    fn sets(&self) -> [String; 2] {
        let domain = self.settings.domain.unwrap_or_default();
        ["--set".into(), format!("backend.ros2.domain={domain}")]
    }

    /// Command `palpate` on this network.
    pub fn palpate(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        command.arg("--quiet").args(arguments).args(self.sets());
        command
    }

    /// The shipped experiment with one trial of one planner; only the backend is changed.
    pub fn run(&self, planner: &str, touches: u32, out: &Path) -> Command {
        let mut command = self.palpate(&["run", self.experiment, "--no-report"]);
        command.arg("--out").arg(out).args(["--set", "trials=1"]);
        command.args(touch_sets(touches).iter().flat_map(|set| ["--set", set]));
        command.args(["--set", &format!("planners=[\"{planner}\"]")]);
        command.args(CELL.iter().flat_map(|set| ["--set", *set]));
        command
    }

    /// An independent peer.
    pub fn peer(&self, what: &str, more: &[&str]) -> Command {
        let mut command = Command::new(std::env::var("PALPATE_PEER").expect("PALPATE_PEER"));
        let domain = self.settings.domain.unwrap_or_default().to_string();
        command.args(["tests/ros2/peer.py", what, &domain]).args(more);
        command
    }
}

/// A simulated robot in its own process, and its events.
pub struct TwinProcess {
    /// Process of the robot.
    pub child: Child,
    /// Events, oldest first.
    pub events: Arc<Mutex<Vec<Value>>>,
    reader: Option<JoinHandle<()>>,
}

impl TwinProcess {
    /// Starts the robot of a scene or experiment; it is discovered when this returns.
    pub fn new(network: &Network, path: &str, more: &[&str]) -> Self {
        Self::spawn(network.palpate(&["serve", path]).args(more))
    }

    /// Starts a robot that prints one event per line as JSON; it is discovered when this returns.
    pub fn spawn(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let events: Arc<Mutex<Vec<Value>>> = Arc::default();
        let (lines, values) = (BufReader::new(child.stdout.take().unwrap()), Arc::clone(&events));
        let reader = std::thread::spawn(move || {
            for line in lines.lines().map_while(Result::ok) {
                values.lock().unwrap().push(serde_json::from_str(&line).unwrap());
            }
        });
        let twin = Self { child, events, reader: Some(reader) };
        twin.wait_for(|event| event == "serving", 30.0);
        twin
    }

    /// Time of the last event of this kind, if any.
    pub fn last(&self, is_it: impl Fn(&Value) -> bool) -> Option<f64> {
        let events = self.events.lock().unwrap();
        let found = events.iter().rev().find(|line| is_it(&line["event"]));
        found.and_then(|line| line["time_unix_s"].as_f64())
    }

    /// Waits for an event and returns its time, as [`last`](Self::last) does.
    pub fn wait_for(&self, is_it: impl Fn(&Value) -> bool, connect_timeout_s: f64) -> f64 {
        let begun = Instant::now();
        loop {
            if let Some(at_s) = self.last(&is_it) {
                return at_s;
            }
            assert!(begun.elapsed().as_secs_f64() < connect_timeout_s, "{:?}", self.events);
            sleep(Duration::from_millis(5));
        }
    }

    /// Waits for the first alarm after `since_s` and returns its time.
    pub fn alarmed_s(&self, since_s: f64) -> f64 {
        let begun = Instant::now();
        loop {
            let events = self.events.lock().unwrap();
            let found = events.iter().find(|line| {
                let is_alarm =
                    line["event"]["status"]["alarm"].as_str().is_some_and(|it| !it.is_empty());
                is_alarm && line["time_unix_s"].as_f64().unwrap() >= since_s
            });
            if let Some(line) = found {
                return line["time_unix_s"].as_f64().unwrap();
            }
            drop(events);
            assert!(begun.elapsed().as_secs_f64() < 2.0, "{:?}", self.events);
            sleep(Duration::from_millis(5));
        }
    }

    /// Start of the current rest, if it is at rest.
    pub fn rest_s(&self) -> Option<f64> {
        let is_either = |event: &Value| event == "moving" || event == "at_rest";
        let at_s = self.last(is_either)?;
        (self.last(|event| event == "at_rest") == Some(at_s)).then_some(at_s)
    }

    /// Waits until it has moved for a while.
    pub fn wait_until_it_moves(&self) {
        self.wait_for(|event| event == "moving", 30.0);
        sleep(Duration::from_millis(300));
        assert_eq!(self.rest_s(), None, "{:?}", self.events);
    }

    /// Ends the process; returns its counts.
    pub fn end(mut self) -> Value {
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

/// Values for `--set` of a trial of so many touches.
pub fn touch_sets(touches: u32) -> [String; 2] {
    [format!("touches={touches}"), format!("initial_touches={}", touches.min(5))]
}

/// Returns the number in this environment variable.
pub fn count(name: &str, usual: u32) -> u32 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Ways in which the planner of a moving arm ends.
#[derive(Clone, Copy, Debug)]
pub enum End {
    Kill,
    Stop,
    Cut,
}

/// Ends the planners of a moving robot, `times` times, in travel and approach. `run` returns the
/// command that makes this many touches into `out`. Each time the robot comes to rest by itself, no
/// touch is lost, and the same command continues.
pub fn end_planners(
    end: End,
    times: u32,
    twin: &TwinProcess,
    out: &Path,
    run: impl Fn(u32) -> Command,
) {
    end_planners_marked(end, times, twin, out, run, || ());
}

/// Ends planners as [`end_planners`] does, and calls `mark` at each end. Returns the events of
/// rests after a mark.
pub fn end_planners_marked(
    end: End,
    times: u32,
    twin: &TwinProcess,
    out: &Path,
    run: impl Fn(u32) -> Command,
    mark: impl Fn(),
) -> Vec<Value> {
    let mut rests = Vec::new();
    let touches = times + 3;
    let mut rests_ms = Vec::new();
    let mut kept = 0;
    for i in 0..times {
        twin.events.lock().unwrap().clear();
        let mut explorer = run(touches).stderr(Stdio::piped()).spawn().unwrap();
        twin.wait_for(|event| event == "moving", 30.0);
        sleep(Duration::from_secs_f64(0.2 + 0.37 * f64::from(i % 10)));
        // Not at rest between two movements.
        while twin.rest_s().is_some() {
            assert!(explorer.try_wait().unwrap().is_none(), "{end:?}: the run ended too early");
            sleep(Duration::from_millis(2));
        }
        match end {
            End::Kill => signal(&explorer, "KILL"),
            End::Stop => signal(&explorer, "STOP"),
            End::Cut => set_network(false),
        }
        let at_s = pace::now_s();
        mark();
        sleep(Duration::from_millis(700));
        let rest_s = twin.rest_s().unwrap_or_else(|| panic!("{end:?}: still moving"));
        rests_ms.push(1e3 * (rest_s - at_s).max(0.0));
        let events = twin.events.lock().unwrap();
        rests.extend(events.iter().filter(|line| line["event"] == "rested").cloned());
        drop(events);
        match end {
            End::Kill => (),
            End::Stop => signal(&explorer, "CONT"),
            End::Cut => set_network(true),
        }
        let output = explorer.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let is_reported = matches!(end, End::Kill) || output.status.code() == Some(2);
        assert!(is_reported, "{end:?}: {:?} {said}", output.status);
        // The rest of a stopped planner moves nothing.
        assert!(twin.rest_s().is_some(), "{end:?}: {said}");
        let found = journal(out).iter().filter(|line| line["touch"].is_object()).count();
        assert!(found >= kept, "{end:?}: {found} of {kept} touches");
        kept = found;
    }
    rests_ms.sort_by(f64::total_cmp);
    let [median, worst] = median_and_worst(&rests_ms);
    println!(
        "{end:?}: {times} times, at rest after {median:.0} ms (median), {worst:.0} ms (worst)"
    );
    assert!(worst <= 150.0, "{end:?}: {rests_ms:?}");
    let output = run(touches).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let row = row(out);
    assert_eq!((row.failure, row.touches.len()), (None, touches as usize));
    rests
}

/// Distances, m, ascending, between the contacts of a row and those of the same targets touched in
/// sequence in this process. A miss must be a miss here too.
pub fn contacts_off_m(simulation: &Simulation, row: &TrialRow) -> Vec<f64> {
    let mut probe = simulation.probe(0).unwrap();
    let mut off_m = Vec::new();
    for touch in &row.touches {
        let approach = simulation.task().approach(&touch.target).unwrap();
        let outcome = probe.touch(&approach).unwrap();
        let here = outcome.contact().map(|contact| contact.p_wc);
        let there = touch.contact();
        assert_eq!(here.is_some(), there.is_some(), "{:?}", touch.target);
        off_m.extend(here.zip(there).map(|(here, there)| (here - there).norm()));
    }
    off_m.sort_by(f64::total_cmp);
    off_m
}

/// Median and largest of ascending values.
pub fn median_and_worst(ascending: &[f64]) -> [f64; 2] {
    [ascending[ascending.len() / 2], ascending[ascending.len() - 1]]
}

/// Sets the network devices of this namespace up or down.
pub fn set_network(is_up: bool) {
    let ip = |words: &str| Command::new("ip").args(words.split(' ')).status().unwrap().success();
    let has_dummy = Path::new("/sys/class/net/dds0").exists();
    let state = if is_up { "up" } else { "down" };
    assert!(ip(&format!("link set lo {state}")));
    assert!(!has_dummy || ip(&format!("link set dds0 {state}")));
    let device = if has_dummy { "dds0" } else { "lo" };
    assert!(!is_up || ip(&format!("route replace 224.0.0.0/4 dev {device}")));
}

/// Sends a signal.
pub fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args([&format!("-{name}"), &id]).status().unwrap().success());
}

/// First row of a run.
pub fn row(out: &Path) -> TrialRow {
    let text = fs::read_to_string(out.join("trials.jsonl")).unwrap();
    serde_json::from_str(text.lines().next().unwrap()).unwrap()
}

/// Lines of a run's journal.
pub fn journal(out: &Path) -> Vec<Value> {
    let text = fs::read_to_string(out.join("touches.jsonl")).unwrap_or_default();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}
