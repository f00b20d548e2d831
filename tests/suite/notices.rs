//! Tests of warnings about likely mistakes in valid scenes and runs.

use crate::common::program::{fails, palpate, stderr};
use palpate::experiment::store::Run;
use std::fs;
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

/// A folder with the shipped scene `name`, some lines replaced, as `scene.toml`, and an experiment
/// on it.
fn folder(name: &str, changes: &[(&str, &str)]) -> TempDir {
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut scene = fs::read_to_string(home.join("scenes").join(name)).unwrap();
    scene = scene.replace("../models", home.join("models").to_str().unwrap());
    for (from, to) in changes {
        assert!(scene.contains(from), "{from} in {scene}");
        scene = scene.replace(from, to);
    }
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let experiment = "name = \"it\"\nscene = \"scene.toml\"\nplanners = [\"random\", \"sobol\"]\n\
                      trials = 2\ninitial_touches = 4\ntouches = 12\ngrid = 21\n";
    fs::write(folder.path().join("it.toml"), experiment).unwrap();
    folder
}

fn run(folder: &TempDir, more: &[&str]) -> Output {
    let arguments = [&["run", "it.toml", "--no-report"], more].concat();
    palpate(folder.path(), &arguments)
}

fn table(output: &Output) -> String {
    assert!(output.status.success(), "{}", stderr(output));
    String::from_utf8_lossy(&output.stdout).into()
}

/// Returns a column of `summary.csv` for a planner after some touches.
fn summary(folder: &TempDir, planner: &str, touches: &str, column: &str) -> f64 {
    let mut reader = csv::Reader::from_path(folder.path().join("runs/it/summary.csv")).unwrap();
    let at = reader.headers().unwrap().iter().position(|name| name == column).unwrap();
    let records = reader.records().map(Result::unwrap);
    let mut found = records.filter(|record| &record[0] == planner && &record[1] == touches);
    found.next().unwrap()[at].parse().unwrap()
}

#[test]
fn a_scene_that_means_what_it_says_is_told_nothing() {
    let folder = folder("container.toml", &[]);
    let output = run(&folder, &[]);
    assert!(!table(&output).contains("note:"));
    assert_eq!(stderr(&output), "");
}

/// Tests fingers of three radii on the container: the error does not grow with the difference from
/// 7 mm.
#[test]
fn a_soft_finger_of_another_radius_has_no_bias_of_the_difference() {
    for radius in ["0.006", "0.007", "0.008"] {
        let folder = folder("container_finger.toml", &[]);
        let set = format!("scene.finger.radius_m={radius}");
        let sets = ["--set", &set, "--set", "touches=25", "--set", "planners=[\"sobol\"]"];
        let sets = [&sets[..], &["--set", "gp.noise_sd_m=0.0003"]].concat();
        table(&run(&folder, &sets));
        let rmse_m = summary(&folder, "sobol", "25", "rmse_median_m");
        assert!(rmse_m < 0.6e-3, "{radius}: {rmse_m}");
    }
}

#[test]
fn a_datum_that_is_left_out_is_the_middle_of_the_surface() {
    let folder = folder("container.toml", &[("datum_y_m = -0.65\n", "")]);
    let output = run(&folder, &[]);
    assert!(!table(&output).contains("note:") && stderr(&output).is_empty(), "{}", stderr(&output));
    let resolved = fs::read_to_string(folder.path().join("runs/it/resolved.toml")).unwrap();
    let line = resolved.lines().find(|line| line.starts_with("datum_y_m = ")).unwrap();
    // The surface is 22.1 to 40.0 mm in front of the object's middle at y = -0.65.
    let datum_y_m: f64 = line["datum_y_m = ".len()..].parse().unwrap();
    assert!((datum_y_m - (-0.65 + 0.5 * (0.0221 + 0.0400))).abs() < 2e-4, "{datum_y_m}");
}

#[test]
fn a_datum_far_from_the_surface_and_an_r_that_says_nothing_are_told() {
    let folder = folder("container.toml", &[("datum_y_m = -0.65", "datum_y_m = 0")]);
    let output = run(&folder, &["--set", "touches=8"]);
    let (text, notes) = (table(&output), stderr(&output));
    for words in [&text, &notes] {
        assert!(words.contains("zone.datum_y_m = 0 lies 610.0 mm from the surface"), "{words}");
        assert!(words.contains("the zone is 120.0 mm wide"), "{words}");
    }
    assert!(summary(&folder, "random", "8", "r_mean") > 0.999);
    assert!(text.contains("R does not distinguish the belief from a constant height"), "{text}");
    assert!(text.contains("random, sobol"), "{text}");
}

#[test]
fn a_forgotten_unit_is_told_with_the_one_that_fits() {
    let container = folder("container.toml", &[("unit = \"mm\"\n", "")]);
    let output = palpate(container.path(), &["show", "scene.toml"]);
    let notes = stderr(&output);
    assert!(notes.contains("1667 times larger than the zone"), "{notes}");
    assert!(notes.contains("with object.unit = \"mm\" it would measure 0.2000 m"), "{notes}");
    assert!(notes.contains("can reach only 0 of 1681 test points"), "{notes}");
    let bird =
        folder("bird.toml", &[("[zone]", "[zone]"), ("[object]", "[object]\nunit = \"mm\"")]);
    let notes = stderr(&palpate(bird.path(), &["show", "scene.toml"]));
    assert!(notes.contains("702 times smaller than the zone"), "{notes}");
    assert!(notes.contains("with object.unit = \"m\" it would measure 0.1425 m"), "{notes}");
}

#[test]
fn few_places_and_few_contacts_are_told_before_and_after() {
    let folder = folder("container.toml", &[("x_m = [-0.05, 0.05]", "x_m = [-0.05, 0.5]")]);
    let output = palpate(folder.path(), &["run", "it.toml"]);
    let (text, notes) = (table(&output), stderr(&output));
    let page = fs::read_to_string(folder.path().join("runs/it/report.html")).unwrap();
    for words in [&text, &notes, &page] {
        assert!(words.contains("of 441 test points lie on the object"), "{words}");
    }
    for words in [&text, &page] {
        assert!(words.contains("touches made a usable contact"), "{words}");
    }
}

#[test]
fn a_run_whose_every_trial_failed_says_why_and_keeps_headers() {
    let folder = folder("container_finger.toml", &[]);
    let sets = ["--set", "scene.effects.timing.control_delay_s=0.9", "--set", "touches=4"];
    let output = run(&folder, &sets);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let notes = stderr(&output);
    assert!(
        notes.contains("error: 4 of 4 trials failed, the first (random, trial 0): "),
        "{notes}"
    );
    for (file, start) in [
        ("summary.csv", "planner,touches,trials,r_mean,"),
        ("comparison.csv", "planner,baseline,measure,trials,difference,"),
        ("equal_error.csv", "planner,baseline,measure,"),
    ] {
        let text = fs::read_to_string(folder.path().join("runs/it").join(file)).unwrap();
        assert!(text.starts_with(start), "{file}: {text}");
    }
}

#[test]
fn what_an_arm_does_not_reach_is_refused_before_it_is_sent() {
    let folder = folder("container_pa10.toml", &[]);
    let says = ["the arm does not reach 25 of 25 places", "the stand-off", "arm.base_position_m"];
    let far = "arm.base_position_m=[0, 1.5, 0]";
    // A quarter of a metre too far back; a move along y by more brings it within reach.
    let near = "arm.base_position_m=[0, 0.35, 0]";
    let moved = ["places of the zone", "set arm.base_position_m to", "reaches the zone's corners"];
    fails(folder.path(), &["show", "scene.toml", "--set", near], &moved);
    fails(folder.path(), &["show", "scene.toml", "--set", far], &says);
    fails(folder.path(), &["run", "it.toml", "--set", &format!("scene.{far}")], &says);
    assert!(!folder.path().join("runs").exists());
}

#[test]
fn the_last_touch_stands_in_the_table() {
    let folder = folder("container.toml", &[]);
    let sets = ["--set", "report.touch_counts=[4]", "--set", "touches=9"];
    let text = table(&run(&folder, &sets));
    assert!(text.contains("2 paired trials are too few"), "{text}");
    let counts: Vec<&str> = (text.lines().filter(|line| line.contains("  sobol")))
        .map(|line| line.split_whitespace().next().unwrap())
        .collect();
    assert_eq!(counts, ["4", "9"], "{text}");
}

#[test]
fn a_soft_finger_without_tables_is_a_biotac_and_says_so() {
    let folder = folder(
        "container_finger.toml",
        &[("[effects.skin]\n", ""), ("[effects.fluid]\n", ""), ("[effects.electrodes]", "")],
    );
    let output = run(&folder, &["--set", "touches=4"]);
    assert!(stderr(&output).contains("default [effects.skin]"), "{}", stderr(&output));
    let resolved = fs::read_to_string(folder.path().join("runs/it/resolved.toml")).unwrap();
    for table in ["[scene.effects.skin]", "[scene.effects.fluid]", "[scene.effects.electrodes]"] {
        assert!(resolved.contains(table), "{resolved}");
    }
    let quiet = palpate(folder.path(), &["-q", "show", "scene.toml"]);
    assert_eq!(stderr(&quiet), "");
}

/// A note gives the cost of a radius that differs from the calibrated one.
#[test]
fn a_soft_finger_of_another_size_is_told_what_it_costs() {
    let folder = folder("container_finger.toml", &[]);
    let show = |radius_m: &str| {
        let set = format!("finger.radius_m={radius_m}");
        palpate(folder.path(), &["show", "scene.toml", "--set", &set])
    };
    let values = stderr(&show("0.01"));
    assert!(
        values.contains("finger.radius_m = 0.01") && values.contains("0.79 at 0.010"),
        "{values}"
    );
    let values = stderr(&show("0.007"));
    assert!(!values.contains("finger.radius_m"), "{values}");
}

#[test]
fn a_planner_that_repeats_a_target_is_noted() {
    let folder = folder("container.toml", &[]);
    table(&run(&folder, &[]));
    let mut run = Run::read(&folder.path().join("runs/it")).unwrap();
    assert_eq!(run.notices(), Vec::<String>::new());
    for (from, to) in [(2, 5), (5, 9)] {
        run.rows[0].touches[to].target = run.rows[0].touches[from].target.clone();
    }
    let planner = &run.rows[0].planner;
    let [notice] = &run.notices()[..] else { panic!("{:?}", run.notices()) };
    assert!(notice.starts_with(&format!("{planner}: 2 touches at a target")), "{notice}");
}
