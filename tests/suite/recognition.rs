//! Tests of recognition: which object of a library is touched, and where it is.

use crate::common::program::{fails, palpate, run_to_end, stderr, succeeds};
use palpate::experiment::Simulation;
use palpate::experiment::experiment::Experiment;
use palpate::experiment::metrics::recognition::{NONE, RecognitionMetrics};
use palpate::experiment::row::TrialRow;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn simulation(experiment: &str, sets: &[&str]) -> Simulation {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments").join(experiment);
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    Simulation::new(Experiment::load(&path, &sets).unwrap()).unwrap()
}

fn trial(simulation: &Simulation, planner: &str, number: u32) -> TrialRow {
    let row = simulation.trial(simulation.planner(planner).unwrap(), number);
    assert_eq!(row.failure, None, "{planner}, trial {number}");
    row
}

fn last(row: &TrialRow) -> &RecognitionMetrics {
    row.touches.last().unwrap().recognition.as_ref().unwrap()
}

/// Three boxes that differ by 3 mm, and few poses, so that tests are fast.
const BOXES: [&str; 3] = [
    "scene.library.objects=[\"box\",\"box-wider\",\"box-higher\"]",
    "recognition.particles=128",
    "touches=8",
];

/// Objects that differ by 3 mm are recognised, with probabilities that sum to one, and found within
/// the stated distance, on average within half of these 3 mm: the planner looks for objects.
#[test]
fn objects_that_differ_by_millimetres_are_recognised() {
    let simulation = simulation("lookalikes.toml", &BOXES);
    let mut sum_m = 0.0;
    for number in 0..3 {
        let row = trial(&simulation, "object_information", number);
        for touch in &row.touches {
            let found = touch.recognition.as_ref().unwrap();
            let sum: f64 = found.probabilities.values().sum();
            assert!((sum - 1.0).abs() < 5e-3, "{found:?}");
        }
        let error = last(&row).error.as_ref().unwrap();
        assert!(last(&row).is_right() == Some(true) && error.probability > 0.9, "{:?}", last(&row));
        assert!(error.distance_m.unwrap() < last(&row).pose.distance_95_m, "{:?}", last(&row));
        sum_m += error.distance_m.unwrap();
        assert!(last(&row).is_identified(0.9), "{:?}", last(&row));
    }
    assert!(sum_m / 3.0 < 1.5e-3, "{sum_m} m");
}

/// An object that no hypothesis has is found to be none of these.
#[test]
fn an_unknown_object_is_none_of_these() {
    let sets = [&BOXES[..], &["scene.library.unknown=[\"bottle\"]", "trials=4"]].concat();
    let simulation = simulation("lookalikes.toml", &sets);
    let row = trial(&simulation, "object_information", 3);
    let found = last(&row);
    assert_eq!(found.error.as_ref().unwrap().object, "bottle");
    assert_eq!(found.object, NONE, "{found:?}");
    let found = row.touches.iter().filter_map(|touch| touch.recognition.as_ref());
    let mut named = found.filter(|found| found.object != NONE);
    assert!(named.all(|found| !found.is_identified(0.95)));
}

/// A view is evidence, also by a camera whose pose is off by millimetres: with it and one touch the
/// right object is found, at a place that a touch alone does not tell.
#[test]
fn a_view_is_evidence() {
    let objects = "scene.library.objects=[\"mug-middle\",\"bottle\",\"box\"]";
    let camera = "scene.camera={model=\"d405\",position_m=[0.2,-0.4,0.65],noise={},pose_error={}}";
    let one = [objects, camera, "recognition.particles=128", "initial_touches=0", "touches=1"];
    let rows = |views: &str| {
        let simulation = simulation("lookalikes.toml", &[&one[..], &[views]].concat());
        [0, 1, 2].map(|number| trial(&simulation, "object_information", number))
    };
    let (seen, blind) = (rows("views=1"), rows("views=0"));
    for row in &seen {
        assert!(last(row).error.as_ref().unwrap().probability > 0.999, "{:?}", last(row));
    }
    let off_m = |rows: &[TrialRow]| -> f64 {
        rows.iter().map(|row| last(row).error.as_ref().unwrap().distance_m.unwrap()).sum()
    };
    assert!(off_m(&seen) < 0.8 * off_m(&blind), "{} m, {} m", off_m(&seen), off_m(&blind));
}

/// Every planner works beside a library, and a row does not depend on threads.
#[test]
fn rows_do_not_depend_on_threads_nor_on_the_kind_of_planner() {
    let sets = [&BOXES[..2], &["touches=4", "planners=[\"sobol\"]"]].concat();
    let simulation = simulation("lookalikes.toml", &sets);
    let rows = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let names = ["information", "pose_information", "active", "random"];
            names.map(|name| serde_json::to_string(&trial(&simulation, name, 1)).unwrap())
        })
    };
    assert_eq!(rows(1), rows(3));
}

/// The rows of a relief over a zone name the digit.
#[test]
fn digits_over_a_zone_are_read() {
    let sets = [
        "scene.library.objects=[\"0-plain\",\"1-plain\",\"1-wide\"]",
        "scene.simulator=\"swept\"",
        "scene.sensor={}",
        "scene.effects={}",
        "scene.finger={radius_m=0.002,length_m=0.05,pitch_deg=0}",
        "recognition.particles=128",
        "touches=12",
        "trials=2",
    ];
    let simulation = simulation("digits.toml", &sets);
    for (number, class) in [(0, "0"), (1, "1")] {
        let row = trial(&simulation, "object_information", number);
        assert_eq!(last(&row).object, class, "{:?}", last(&row));
    }
}

/// Any rotation: the pose of a known object is found from touches around it.
#[test]
fn a_pose_in_space_is_found() {
    let sets = [
        "scene.library.objects=[\"mug-high\"]",
        "scene.pose.turn=\"free\"",
        "scene.pose.half_width_m=[0.01,0.01,0.01]",
        "scene.whole_object={}",
        "recognition.particles=1024",
        "recognition.none_probability=0",
        "touches=10",
        "trials=2",
    ];
    let simulation = simulation("lookalikes.toml", &sets);
    for number in 0..2 {
        let row = trial(&simulation, "pose_information", number);
        let error = last(&row).error.as_ref().unwrap();
        assert!(error.distance_m.unwrap() < 2e-3, "{error:?}");
    }
}

/// An object that turns freely about a point of the table would be below it in part.
#[test]
fn a_free_turn_below_the_table_is_refused() {
    let folder = TempDir::new().unwrap();
    let identify = |turn: &str, z: &str| {
        let (turn, z) = (format!("pose.turn={turn}"), format!("pose.position_m=[0,-0.65,{z}]"));
        let scene = ["identify", "models/lookalikes", "scenes/lookalikes.toml", "--touches", "1"];
        palpate(folder.path(), &[&scene[..], &["--set", &turn, "--set", &z]].concat())
    };
    let refused = identify("free", "0.4");
    assert_eq!(refused.status.code(), Some(2));
    let message = stderr(&refused);
    for part in ["scene.pose: turn = \"free\"", "whole_object.lowest_m = 0.4", "position_m[2]"] {
        assert!(message.contains(part), "no {part} in {message}");
    }
    assert_eq!(identify("free", "0.6").status.code(), Some(3));
    assert_eq!(identify("yaw", "0.4").status.code(), Some(3));
}

fn shipped(path: &str) -> String {
    format!("{}/{path}", env!("CARGO_MANIFEST_DIR"))
}

/// A library over a zone has a report, though each trial has another ground truth.
#[test]
fn a_library_over_a_zone_is_reported() {
    let folder = TempDir::new().unwrap();
    let small = "--set=scene.library.objects=[\"0-plain\",\"1-plain\"]";
    let sets = ["--set=trials=1", "--set=touches=3", "--set=recognition.particles=8", small];
    succeeds(folder.path(), &[&["run", "digits"], &sets[..]].concat());
    assert!(folder.path().join("runs/digits/report.html").is_file());
}

#[test]
fn identify_says_what_is_there_and_where() {
    let folder = TempDir::new().unwrap();
    let [library, scene] = ["models/lookalikes", "scenes/lookalikes.toml"].map(shipped);
    let few = ["--set", "library.objects=[\"box\",\"bottle\"]"];
    let identify = ["identify", &library, &scene];
    let says = succeeds(folder.path(), &[&identify[..], &few].concat());
    for part in ["touch  1: ", "after", "position_m = [", "right: the object is bottle"] {
        assert!(says.contains(part), "{part} in {says}");
    }
    // One touch does not tell boxes of nearly the same size apart.
    let alike = ["--set", "library.objects=[\"box\",\"box-deeper\"]"];
    let undecided = palpate(folder.path(), &[&identify[..], &alike, &["--touches", "1"]].concat());
    assert_eq!(undecided.status.code(), Some(3));
    // Its own object is what is there.
    let own = ["--set", "object={mesh=\"box.glb\",position_m=[0,-0.65,0.44]}"];
    let mesh = folder.path().join("box.glb");
    fs::copy(shipped("models/lookalikes/box.glb"), mesh).unwrap();
    let says = succeeds(folder.path(), &[&identify[..], &few, &own].concat());
    assert!(says.contains("\nbox ("), "{says}");
    assert!(!says.contains("right:"), "{says}");
}

#[test]
fn wrong_libraries_are_refused_with_the_reason() {
    let folder = TempDir::new().unwrap();
    let [library, scene] = ["models/lookalikes", "scenes/lookalikes.toml"].map(shipped);
    let empty = folder.path().to_str().unwrap().to_owned();
    for (arguments, words) in [
        (vec!["identify", "nowhere", &scene], "nowhere: not a folder"),
        (vec!["identify", &empty, &scene], "has no mesh; allowed is at least one .obj"),
        (vec!["identify", &library, &scene, "--planner", "x"], "--planner x: no such planner"),
        (vec!["identify", &library, &scene, "--sure", "1"], "allowed is 0.5 to below 1"),
        (
            vec!["identify", &library, &scene, "--set", "library.objects=[\"cup\"]"],
            "library.objects: \"cup\" is no mesh of the folder; allowed are bottle",
        ),
        (
            vec!["identify", &library, &scene, "--set", "pose.half_width_m=[-1,0,0]"],
            "pose.half_width_m",
        ),
        (
            vec!["run", "toy", "--set", "planners=[\"information\"]"],
            "allowed is other planners, or a scene with a table [library]",
        ),
        (
            vec!["run", "lookalikes", "--set", "planners=[\"oracle\"]"],
            "with a library each trial has another ground truth",
        ),
        (vec!["run", "digits", "--set", "scene.zone.depth_m=0"], "scene.zone.depth_m"),
    ] {
        fails(folder.path(), &arguments, &[words]);
    }
}

/// A recorded trial is replayed with the object that was drawn for it.
#[test]
fn a_recording_of_a_drawn_object_is_replayed() {
    let folder = TempDir::new().unwrap();
    let sets = [
        BOXES[0],
        BOXES[1],
        "planners=[\"sobol\"]",
        "scene.simulator=\"kinematic\"",
        "touches=2",
        "trials=2",
    ];
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    let run = ["run", "lookalikes", "--record", "--no-report", "--out", "it"];
    succeeds(folder.path(), &run.into_iter().chain(sets).collect::<Vec<_>>());
    for number in ["0000", "0001"] {
        let recording = format!("it/recordings/sobol-{number}.mcap");
        let says = succeeds(folder.path(), &["check", &recording]);
        assert!(says.contains("2 touches identical"), "{says}");
    }
}

/// A run draws its hypotheses, and its tables have accuracy and pose errors.
#[test]
fn a_run_shows_how_hypotheses_fade() {
    let folder = TempDir::new().unwrap();
    let mut command = crate::common::program::command(
        folder.path(),
        &["run", "lookalikes", "--set", "trials=2", "--set", "touches=3", "--out", "it"],
    );
    for set in [BOXES[0], BOXES[1], "planners=[\"sobol\"]", "report.trial=1"] {
        command.args(["--set", set]);
    }
    let output = run_to_end(&mut command, "run lookalikes");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let figure = fs::read_to_string(folder.path().join("it/figures/hypotheses.svg")).unwrap();
    assert!(figure.contains("box-wider") && figure.contains("recognised object"), "{figure}");
    // Among the probabilities the true object, `box-higher`, has another colour.
    let is_true = |line: &&str| line.contains("</text>") && line.contains("#009e73");
    let true_names: Vec<&str> = figure.lines().filter(is_true).collect();
    assert!(true_names.len() == 1 && true_names[0].contains(">box-higher<"), "{true_names:?}");
    let summary = fs::read_to_string(folder.path().join("it/summary.csv")).unwrap();
    let header = summary.lines().next().unwrap();
    for column in ["recognised_mean", "recognition_log_score_mean", "pose_distance_median_m"] {
        assert!(header.contains(column), "{column} in {header}");
    }
    // Other runs have no such columns.
    succeeds(folder.path(), &["run", "toy", "--set", "trials=1", "--no-report", "--out", "toy"]);
    let summary = fs::read_to_string(folder.path().join("toy/summary.csv")).unwrap();
    assert!(!summary.contains("recognised"), "{summary}");
}
