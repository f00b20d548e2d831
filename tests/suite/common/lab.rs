//! An explorer and a simulated robot in separate processes, over ROS 2 or ROS 1, selected by
//! `PALPATE_ROS`.

use palpate::experiment::trial::row::TrialRow;
use palpate::robot::arm::ArmSettings;
use palpate::ros::settings::{BackendKind, BackendSettings};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

/// Experiment that is run over topics.
pub const EXPERIMENT: &str = "experiments/container_pa10.toml";

/// Settings of the container and the cell that a real arm needs.
pub const CELL: [&str; 3] = [
    "scene.zone.depth_m=[0.59, 0.71]",
    "backend.interlocks.lowest_m=0.0",
    "backend.interlocks.workspace_m=[[-1.0, 1.0], [-1.2, 0.6], [0.0, 1.8]]",
];

/// An isolated network: a ROS 2 domain, or a ROS 1 master.
pub struct Network {
    /// Settings of `[backend]` for this network.
    pub settings: BackendSettings,
    master: Option<Child>,
}

impl Network {
    /// Creates the network with this number.
    pub fn new(number: u16) -> Self {
        let mut settings = BackendSettings { domain: Some(number), ..Default::default() };
        settings.complete(Some(&ArmSettings::default()));
        let is_first = std::env::var("PALPATE_ROS").is_ok_and(|name| name == "ros1");
        if !is_first {
            settings.kind = BackendKind::Ros2;
            return Self { settings, master: None };
        }
        let port = 11311 + number;
        (settings.kind, settings.master) = (BackendKind::Ros1, format!("http://127.0.0.1:{port}"));
        let master = Command::new("rosmaster")
            .args(["--core", "-p", &port.to_string()])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("rosmaster, of Debian's python3-rosmaster");
        let begun = Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            assert!(begun.elapsed().as_secs() < 20, "no master at {}", settings.master);
            sleep(Duration::from_millis(50));
        }
        Self { settings, master: Some(master) }
    }

    /// Settings as `--set` options.
    fn sets(&self) -> [String; 6] {
        let BackendSettings { kind, domain, master, .. } = &self.settings;
        [
            "--set",
            &format!("backend.kind=\"{}\"", kind.name())[..],
            "--set",
            &format!("backend.domain={}", domain.unwrap_or_default()),
            "--set",
            &format!("backend.master=\"{master}\""),
        ]
        .map(String::from)
    }

    /// Command `palpate` on this network.
    pub fn palpate(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        command.arg("--quiet").args(arguments).args(self.sets());
        command
    }

    /// The shipped experiment with one trial of one planner; only the backend is changed.
    pub fn run(&self, planner: &str, touches: u32, out: &Path) -> Command {
        let mut command = self.palpate(&["run", EXPERIMENT, "--no-report"]);
        command.arg("--out").arg(out).args(["--set", "trials=1"]);
        command.args(["--set", &format!("touches={touches}")]);
        command.args(["--set", &format!("initial_touches={}", touches.min(5))]);
        command.args(["--set", &format!("planners=[\"{planner}\"]")]);
        command.args(CELL.iter().flat_map(|set| ["--set", *set]));
        command
    }

    /// An independent peer.
    pub fn peer(&self, what: &str, more: &[&str]) -> Command {
        let mut command = Command::new(std::env::var("PALPATE_PEER").expect("PALPATE_PEER"));
        match self.settings.kind {
            BackendKind::Ros1 => command.args(["tests/ros1/peer.py", what, &self.settings.master]),
            _ => command.args([
                "tests/ros2/peer.py",
                what,
                &self.settings.domain.unwrap_or_default().to_string(),
            ]),
        };
        command.args(more);
        command
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        if let Some(master) = &mut self.master {
            let _ = master.kill();
            let _ = master.wait();
        }
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
        let mut child =
            network.palpate(&["serve", path]).args(more).stdout(Stdio::piped()).spawn().unwrap();
        let events: Arc<Mutex<Vec<Value>>> = Arc::default();
        let (lines, values) = (BufReader::new(child.stdout.take().unwrap()), Arc::clone(&events));
        let reader = std::thread::spawn(move || {
            for line in lines.lines().map_while(Result::ok) {
                values.lock().unwrap().push(serde_json::from_str(&line).unwrap());
            }
        });
        let twin = Self { child, events, reader: Some(reader) };
        twin.wait_for(|event| event == "serving", 20.0);
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
