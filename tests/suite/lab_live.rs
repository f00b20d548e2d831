//! A live page in front of an arm over topics; see `lab`.

use crate::common::lab::{CELL, Network, TwinProcess, UR_EXPERIMENT};
use crate::common::viewer::{Viewer, statuses, touches};
use palpate::experiment::store::Run;
use serde_json::json;
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

/// Targets of the person, in the zone of the container, m.
const TARGETS: [[f64; 2]; 9] = [
    [-0.02, 0.48],
    [0.0, 0.48],
    [0.02, 0.48],
    [-0.02, 0.5],
    [0.0, 0.5],
    [0.02, 0.5],
    [-0.02, 0.52],
    [0.0, 0.52],
    [0.02, 0.52],
];

/// A process that does not outlive its test.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_person_explores_by_a_pa10() {
    a_person_explores(&Network::new(15));
}

#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_person_explores_by_a_ur() {
    a_person_explores(&Network::of(16, UR_EXPERIMENT));
}

/// A person explores by ten touches over topics. Without a visible page the arm does not begin; a
/// page that is closed during an approach lets it finish the touch, and then it holds.
fn a_person_explores(network: &Network) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let twin = TwinProcess::new(network, network.experiment, &[]);
    let out = path.to_str().unwrap();
    let mut command = network.palpate(&["live", network.experiment, "--no-browser", "--out", out]);
    let own = ["planners=[\"human\"]", "trials=1", "initial_touches=1", "touches=10"];
    command.args(CELL.iter().chain(&own).flat_map(|set| ["--set", *set]));
    let mut child = Killed(command.stdout(Stdio::piped()).spawn().unwrap());
    let mut printed = BufReader::new(child.0.stdout.take().unwrap());
    let mut line = String::new();
    printed.read_line(&mut line).unwrap();
    let viewer = Arc::new(Viewer::new(line.trim().trim_start_matches("live page: ")));
    let is_at = |status: &'static str, count: u64| {
        move |state: &serde_json::Value| statuses(state) == [status] && touches(state) == [count]
    };
    // No page is visible yet.
    viewer.when(is_at("held", 0));
    sleep(Duration::from_secs(2));
    viewer.when(is_at("held", 0));
    let is_visible = Arc::new(AtomicBool::new(true));
    let beat = {
        let (viewer, is_visible) = (Arc::clone(&viewer), Arc::clone(&is_visible));
        std::thread::spawn(move || {
            while Arc::strong_count(&is_visible) > 1 {
                if is_visible.load(Ordering::Relaxed) {
                    viewer.post("/seen", &json!({}));
                }
                sleep(Duration::from_millis(500));
            }
        })
    };
    let choose = |made: u64| {
        let target = TARGETS[made as usize - 1];
        viewer.order(&json!({ "order": "touch", "planner": "human", "target": target }));
    };
    for made in 1..10 {
        viewer.when(is_at("your_turn", made));
        if made == 5 {
            // The page has been closed during the last approach, and an order was on its way.
            sleep(Duration::from_secs(6));
            choose(made);
            viewer.when(is_at("held", made));
            sleep(Duration::from_secs(3));
            viewer.when(is_at("held", made));
            is_visible.store(true, Ordering::Relaxed);
            continue;
        }
        choose(made);
        if made == 4 {
            viewer.when(is_at("touching", made));
            is_visible.store(false, Ordering::Relaxed);
        }
    }
    drop(is_visible);
    let _ = beat.join();
    viewer.when(|state| state["phase"] == "ended");
    drop(child);
    twin.end();
    let run = Run::read(&path).unwrap();
    let row = &run.rows[0];
    assert_eq!((row.planner.as_str(), row.touches.len(), &row.failure), ("human", 10, &None));
    let contacts = row.touches.iter().filter(|touch| touch.contact().is_some()).count();
    assert!(contacts >= 9, "{contacts} contacts");
    for (touch, target) in row.touches[1..].iter().zip(TARGETS) {
        assert_eq!(touch.target.numbers(), target);
    }
}
