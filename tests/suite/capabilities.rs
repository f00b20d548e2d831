//! Capabilities by the ways into the program: each works, or is refused with a reason.
//!
//! The table is `tests/capabilities.md`; `PALPATE_WRITE_REFERENCE=1` writes it anew. The columns of
//! Python are tested by `python/tests/test_capabilities.py`.

use palpate::experiment::recording::recorded_trial;
use palpate::experiment::recording::replay;
use palpate::experiment::row::TrialRow;
use palpate::experiment::simulation::Simulation;
use palpate::experiment::store::RunFolder;
use palpate::experiment::trial::TrialEvent;
use palpate::experiment::{Experiment, real_robot};
use palpate::explore::belief::Belief;
use palpate::live::session::Session;
use palpate::ros::recording::RecordedTrial;
use palpate::task::Target;
use std::fs;
use std::path::{Path, PathBuf};

/// A capability and an experiment that uses it.
struct Capability {
    name: &'static str,
    experiment: &'static str,
    sets: &'static [&'static str],
    /// Further settings of a real robot.
    real: &'static [&'static str],
    planner: &'static str,
    /// Whether a row has used it.
    is_used: fn(&TrialRow) -> bool,
}

/// Topic of a pad's images.
const IMAGES: &str = "backend.ros2.topics.tactile.type=\"sensor_msgs/msg/Image\"";

const CAPABILITIES: [Capability; 6] = [
    Capability {
        name: "tap",
        experiment: "container_strokes",
        sets: &["touches=4"],
        real: &[],
        planner: "active(tap)",
        is_used: |row| row.touches.iter().all(|touch| touch.target.slide_m() == 0.0),
    },
    Capability {
        name: "tilt",
        experiment: "bird",
        sets: &["touches=40", "initial_touches=20", "scene.finger.other_pitches_deg=[0]"],
        real: &[],
        planner: "active",
        is_used: |row| row.touches.iter().any(|it| matches!(it.target, Target::Tilted { .. })),
    },
    Capability {
        name: "stroke",
        experiment: "container_strokes",
        sets: &["touches=4"],
        real: &[],
        planner: "active",
        is_used: |row| row.touches.iter().any(|touch| touch.target.slide_m() > 0.0),
    },
    Capability {
        name: "look",
        experiment: "container_camera",
        sets: &["touches=3", "scene.simulator=\"kinematic\""],
        real: &[],
        planner: "active",
        is_used: |row| !row.views.is_empty(),
    },
    Capability {
        name: "gel patch",
        experiment: "container",
        sets: &[
            "touches=3",
            "scene.simulator=\"kinematic\"",
            "scene.sensor.depth_patch={}",
            "scene.touch.press_m=0.0005",
        ],
        real: &[IMAGES],
        planner: "active",
        is_used: |row| row.touches.iter().any(|touch| touch.outcome.points().len() > 1),
    },
    Capability {
        name: "hypotheses",
        experiment: "digits",
        sets: &["touches=2", "recognition.particles=8"],
        real: &[IMAGES],
        planner: "random",
        is_used: |row| row.touches.iter().all(|touch| touch.recognition.is_some()),
    },
];

/// Result of a cell: `Ok` if it works, or the reason why it is refused.
type Cell = Result<(), String>;

/// A finished trial.
struct Trial {
    experiment: Experiment,
    row: TrialRow,
    belief: Belief,
}

impl Capability {
    fn experiment(&self, more: &[&str]) -> Result<Experiment, String> {
        let path = PathBuf::from(format!("experiments/{}.toml", self.experiment));
        let planners = format!("planners=[\"{}\"]", self.planner);
        let few = "planning.oracle.candidates=3";
        let common = ["trials=1", "initial_touches=1", planners.as_str(), few];
        let sets = common.iter().chain(self.sets).chain(more).map(|set| (*set).to_owned());
        Experiment::load(&path, &sets.collect::<Vec<_>>()).map_err(|error| error.to_string())
    }

    fn simulation(&self) -> Result<Simulation, String> {
        Simulation::new(self.experiment(&[])?).map_err(|error| error.to_string())
    }

    fn trial(&self, planner: &str) -> Result<Trial, String> {
        let simulation = self.simulation()?;
        let drawn = simulation.drawn(0).map_err(|error| error.to_string())?;
        let simulation = drawn.unwrap_or(simulation);
        let mut probe = simulation.probe(0).map_err(|fault| fault.to_string())?;
        let factory = simulation.planner(planner).ok_or("no planner")?;
        let mut last = None;
        let row = simulation.trial_with(&mut *probe, factory, 0, &mut |event| {
            if let TrialEvent::Finished(touched) = event {
                last = Some(touched.belief.clone());
            }
            Ok(None)
        });
        let experiment = simulation.experiment().clone();
        match (&row.failure, last) {
            (None, Some(belief)) => Ok(Trial { experiment, row, belief }),
            (failure, _) => Err(failure.clone().unwrap_or_default()),
        }
    }
}

/// Means at some points of two beliefs are equal to a tenth of a micrometre: the slopes that a view
/// takes depend on the search for the first fit, which is not stored.
fn assert_alike(a: &Belief, b: &Belief) {
    let points = a.references(60).unwrap();
    let [a, b] = [a, b].map(|belief| belief.field().unwrap().means(&points));
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-7, "{a} {b}");
    }
}

fn in_trial(capability: &Capability, trial: &Trial) -> Cell {
    assert!((capability.is_used)(&trial.row), "{}: {:?}", capability.name, trial.row);
    Ok(())
}

/// The settings of a real robot are accepted; touches of robots behind topics are tested elsewhere.
fn on_real_robot(capability: &Capability, _: &Trial) -> Cell {
    let cell = [
        "backend.ros2={}",
        "backend.interlocks.lowest_m=0.02",
        "backend.interlocks.workspace_m=[[-0.6, 0.6], [-1.0, 0.3], [0.05, 1.5]]",
        "scene.zone.depth_m=[0.55, 0.72]",
    ];
    let experiment = capability.experiment(&[&cell[..], capability.real].concat())?;
    real_robot::check(&experiment, false).map_err(|error| error.to_string())
}

fn for_oracle(capability: &Capability, _: &Trial) -> Cell {
    capability.trial("oracle").map(|_| ())
}

fn in_replay(_: &Capability, trial: &Trial) -> Cell {
    let count = trial.row.touches.len() as u32;
    let again = trial.row.belief(&trial.experiment, count).map_err(|error| error.to_string())?;
    assert_alike(&trial.belief, &again.unwrap());
    match trial.belief.hypotheses() {
        Some(_) => Err("the surface is drawn; probabilities are in the row".into()),
        None => Ok(()),
    }
}

fn in_stored_belief(_: &Capability, trial: &Trial) -> Cell {
    let json = trial.belief.to_json().map_err(|error| error.to_string())?;
    assert_alike(&trial.belief, &Belief::from_json(&json).unwrap());
    Ok(())
}

fn on_live_page(capability: &Capability, _: &Trial) -> Cell {
    let session = Session::new(capability.simulation()?, Default::default());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let (mut run, done) = RunFolder::open(&path, session.simulation(), "", true).unwrap();
    session.desk().set_start(false, false);
    assert_eq!(session.run(&mut run, &done).unwrap(), None);
    drop(run);
    let rows = fs::read_to_string(path.join("trials.jsonl")).unwrap();
    let row: TrialRow = serde_json::from_str(&rows).unwrap();
    assert!((capability.is_used)(&row), "{}", capability.name);
    row.failure.map_or(Ok(()), Err)
}

fn in_recording(capability: &Capability, _: &Trial) -> Cell {
    let simulation = capability.simulation()?;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trial.mcap");
    let factory = simulation.planner(capability.planner).ok_or("no planner")?;
    let row =
        recorded_trial::run(&simulation, 0, factory, Some(&path), None, &[], &mut |_| Ok(None));
    if let Some(failure) = row.failure {
        return Err(failure);
    }
    let recorded = RecordedTrial::read(&path).map_err(|error| error.to_string())?;
    let result = replay::replay(&simulation, &recorded).map_err(|fault| fault.to_string())?;
    assert_eq!((result.touches, result.difference), (row.touches.len() as u32, None));
    Ok(())
}

type Door = (&'static str, fn(&Capability, &Trial) -> Cell);

const DOORS: [Door; 7] = [
    ("trial", in_trial),
    ("real robot (settings)", on_real_robot),
    ("oracle", for_oracle),
    ("replay", in_replay),
    ("stored belief", in_stored_belief),
    ("live page", on_live_page),
    ("recording", in_recording),
];

/// Every capability works in every way into the program, or is refused with the reason that the
/// table has.
#[test]
fn every_capability_works_or_is_refused_with_a_reason() {
    let path = Path::new("tests/capabilities.md");
    let mut lines = Vec::new();
    for capability in &CAPABILITIES {
        let trial = capability.trial(capability.planner).unwrap();
        for (door, works) in DOORS {
            let cell = match works(capability, &trial) {
                Ok(()) => "works".into(),
                Err(reason) => reason.lines().next().unwrap_or_default().replace('|', "/"),
            };
            assert!(!cell.is_empty(), "{} × {door}", capability.name);
            lines.push(format!("| {} | {door} | {cell} |", capability.name));
        }
    }
    let text = fs::read_to_string(path).unwrap();
    if std::env::var_os("PALPATE_WRITE_REFERENCE").is_some() {
        let head = text.split("\n| tap |").next().unwrap();
        let python: Vec<&str> = text.lines().filter(|line| line.contains("| Python ")).collect();
        let all = lines.iter().map(String::as_str).chain(python).collect::<Vec<_>>().join("\n");
        fs::write(path, format!("{head}\n{all}\n")).unwrap();
        return;
    }
    for line in lines {
        assert!(text.contains(&line), "{line} is not in tests/capabilities.md");
    }
}
