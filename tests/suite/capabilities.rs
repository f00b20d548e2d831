//! Capabilities by the ways into the program: each works, or is refused with a reason.
//!
//! The table is `docs/capabilities.md`; `PALPATE_WRITE_REFERENCE=1` writes it anew. The columns of
//! Python are tested by `python/tests/test_capabilities.py`.

use palpate::experiment::simulation::Simulation;
use palpate::experiment::store::RunFolder;
use palpate::experiment::trial::TrialEvent;
use palpate::experiment::trial::recorded_trial;
use palpate::experiment::trial::replay;
use palpate::experiment::trial::row::TrialRow;
use palpate::experiment::{Experiment, real_robot};
use palpate::explore::belief::Belief;
use palpate::live::session::Session;
use palpate::ros::recording::RecordedTrial;
use palpate::task::Target;
use std::fs;
use std::path::{Path, PathBuf};

/// A capability: its name, an experiment that uses it, and whether a row has used it.
struct Capability {
    name: &'static str,
    experiment: &'static str,
    sets: &'static [&'static str],
    planner: &'static str,
    is_used: fn(&TrialRow) -> bool,
}

const CAPABILITIES: [Capability; 6] = [
    Capability {
        name: "tap",
        experiment: "container_strokes",
        sets: &["touches=5"],
        planner: "active(tap)",
        is_used: |row| row.touches.iter().all(|touch| touch.target.slide_m() == 0.0),
    },
    Capability {
        name: "tilt",
        experiment: "container",
        sets: &["touches=12", "scene.finger.other_pitches_deg=[0, 80]"],
        planner: "active",
        is_used: |row| row.touches.iter().any(|it| matches!(it.target, Target::Tilted { .. })),
    },
    Capability {
        name: "stroke",
        experiment: "container_strokes",
        sets: &["touches=5"],
        planner: "active",
        is_used: |row| row.touches.iter().any(|touch| touch.target.slide_m() > 0.0),
    },
    Capability {
        name: "look",
        experiment: "container_camera",
        sets: &["touches=4", "scene.simulator=\"kinematic\"", "scene.effects={rigid_tip={}, wrench={}}"],
        planner: "active",
        is_used: |row| !row.views.is_empty(),
    },
    Capability {
        name: "gel patch",
        experiment: "container",
        sets: &[
            "touches=4",
            "scene.simulator=\"kinematic\"",
            "scene.sensor.depth_patch={}",
            "scene.touch.press_m=0.0005",
        ],
        planner: "active",
        is_used: |row| row.touches.iter().any(|touch| touch.outcome.points().len() > 1),
    },
    Capability {
        name: "hypotheses",
        experiment: "digits",
        sets: &["touches=3", "recognition.particles=16"],
        planner: "object_information",
        is_used: |row| row.touches.iter().all(|touch| touch.recognition.is_some()),
    },
];

/// Result of a cell: `Ok` if it works, or the reason why it is refused.
type Cell = Result<(), String>;

impl Capability {
    fn experiment(&self, more: &[&str]) -> Result<Experiment, String> {
        let path = PathBuf::from(format!("experiments/{}.toml", self.experiment));
        let planners = format!("planners=[\"{}\"]", self.planner);
        let common = ["trials=1", "initial_touches=1", planners.as_str()];
        let sets = common.iter().chain(self.sets).chain(more).map(|set| (*set).to_owned());
        Experiment::load(&path, &sets.collect::<Vec<_>>()).map_err(|error| error.to_string())
    }

    fn simulation(&self, more: &[&str]) -> Result<Simulation, String> {
        Simulation::new(self.experiment(more)?).map_err(|error| error.to_string())
    }

    /// Runs a trial; returns its row and its last belief.
    fn trial(
        &self,
        planner: &str,
    ) -> Result<(Simulation, TrialRow, Belief), String> {
        let simulation = self.simulation(&[])?;
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
        match (&row.failure, last) {
            (None, Some(belief)) => Ok((simulation, row, belief)),
            (failure, _) => Err(failure.clone().unwrap_or_default()),
        }
    }
}

/// Means at some points of two beliefs are equal to rounding.
fn assert_alike(a: &Belief, b: &Belief) {
    let points = a.references(60).unwrap();
    let [a, b] = [a, b].map(|belief| belief.field().unwrap().means(&points));
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

fn in_trial(capability: &Capability) -> Cell {
    let (_, row, _) = capability.trial(capability.planner)?;
    assert!((capability.is_used)(&row), "{}: {row:?}", capability.name);
    Ok(())
}

fn on_real_robot(capability: &Capability) -> Cell {
    let cell = [
        "backend.ros2={}",
        "backend.interlocks.lowest_m=0.02",
        "backend.interlocks.workspace_m=[[-0.6, 0.6], [-1.0, 0.3], [0.05, 1.5]]",
        "scene.zone.depth_m=[0.55, 0.72]",
    ];
    let experiment = capability.experiment(&cell)?;
    real_robot::check(&experiment, false).map_err(|error| error.to_string())
}

fn for_oracle(capability: &Capability) -> Cell {
    capability.trial("oracle").map(|_| ())
}

fn in_replay(capability: &Capability) -> Cell {
    let (simulation, row, belief) = capability.trial(capability.planner)?;
    let count = row.touches.len() as u32;
    let again = row.belief(simulation.experiment(), count).map_err(|error| error.to_string())?;
    assert_alike(&belief, &again.unwrap());
    match belief.hypotheses() {
        Some(_) => Err("the surface is drawn; probabilities are in the row".into()),
        None => Ok(()),
    }
}

fn in_stored_belief(capability: &Capability) -> Cell {
    let (_, _, belief) = capability.trial(capability.planner)?;
    let json = belief.to_json().map_err(|error| error.to_string())?;
    assert_alike(&belief, &Belief::from_json(&json).unwrap());
    Ok(())
}

fn on_live_page(capability: &Capability) -> Cell {
    let session = Session::new(capability.simulation(&[])?, Default::default());
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

fn in_recording(capability: &Capability) -> Cell {
    let simulation = capability.simulation(&[])?;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trial.mcap");
    let factory = simulation.planner(capability.planner).ok_or("no planner")?;
    let row = recorded_trial::run(&simulation, (0, factory), (Some(&path), None), &[], &mut |_| Ok(None));
    if let Some(failure) = row.failure {
        return Err(failure);
    }
    let recorded = RecordedTrial::read(&path).map_err(|error| error.to_string())?;
    let result = replay::replay(&simulation, &recorded).map_err(|fault| fault.to_string())?;
    assert_eq!((result.touches, result.difference), (row.touches.len() as u32, None));
    Ok(())
}

type Door = (&'static str, fn(&Capability) -> Cell);

const DOORS: [Door; 7] = [
    ("trial", in_trial),
    ("real robot", on_real_robot),
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
    let path = Path::new("docs/capabilities.md");
    let mut lines = Vec::new();
    for capability in &CAPABILITIES {
        for (door, works) in DOORS {
            let cell = match works(capability) {
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
        assert!(text.contains(&line), "{line} is not in docs/capabilities.md");
    }
}
