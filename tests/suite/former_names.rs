//! Tests of names of version 0.1, which are read for one version.

use crate::common::program::{EXPERIMENT, MESH, SCENE, fails, folder, palpate, stderr};
use palpate::experiment::Experiment;
use palpate::experiment::trial::row::TrialRow;
use palpate::explore::planner::Fallback;
use palpate::sim::Scene;
use std::fs;

const FORMER: &str = "
[planning.ucb]
sds = 3.0

[planning.silhouette]
touch_way_m = 0.2

[[report.claims]]
place = \"Fig. 1\"
says = \"it works\"
touches = 3
measures = [\"rmse_m\"]

[backend.ros2]
patience_s = 7.0
[backend.interlocks]
frozen_s = 0.5
[backend.ros2.topics.joints]
age_s = 0.3
";

/// Keys of [`FORMER`], and the present ones.
const PAIRS: [[&str; 2]; 7] = [
    ["sds =", "kappa ="],
    ["touch_way_m =", "travel_cost_m ="],
    ["place =", "source ="],
    ["says =", "text ="],
    ["patience_s =", "connect_timeout_s ="],
    ["frozen_s =", "stuck_s ="],
    ["age_s =", "max_age_s ="],
];

fn present() -> String {
    PAIRS.iter().fold(FORMER.to_owned(), |text, [former, present]| {
        assert!(text.contains(former), "{former}");
        text.replace(former, present)
    })
}

fn former_scene() -> String {
    SCENE
        .replace("simulator = \"swept\"", "body = \"cast\"")
        .replace("\n[zone]", "outside_buffers = true\n[zone]")
}

#[test]
fn former_settings_are_read_with_a_note() {
    let folder = folder();
    let path = folder.path();
    assert!(!MESH.is_empty() && EXPERIMENT.ends_with("]\n"));
    fs::write(path.join("scene.toml"), former_scene()).unwrap();
    let [former, present] = [FORMER, &present()].map(|more| {
        fs::write(path.join("small.toml"), EXPERIMENT.to_owned() + more).unwrap();
        let mut experiment = Experiment::load(&path.join("small.toml"), &[]).unwrap();
        let names = std::mem::take(&mut experiment.scene.former_names);
        (experiment, names)
    });
    assert_eq!(former.0, present.0);
    for name in ["`scene.body` is now `scene.simulator`", "\"cast\" is now \"swept\""] {
        assert!(present.1.iter().any(|note| note == name), "{:?}", present.1);
    }
    let note = "`backend.interlocks.frozen_s` is now `backend.interlocks.stuck_s`".to_owned();
    assert!(former.1.contains(&note) && !present.1.contains(&note), "{:?}", former.1);
    let output = palpate(path, &["show", "scene.toml"]);
    assert!(output.status.success() && stderr(&output).contains("`body` is now `simulator`"));
}

#[test]
fn wrong_values_of_former_settings_are_reported_as_given() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("small.toml"), EXPERIMENT.to_owned() + FORMER).unwrap();
    fs::write(path.join("scene.toml"), former_scene()).unwrap();
    let set = |text| ["run", "small.toml", "--no-report", "--set", text];
    fails(
        path,
        &set("planning.ucb.sds=-1"),
        &["--set planning.ucb.sds=-1", "`planning.ucb.sds`", "0 to 1000"],
    );
    fails(path, &set("scene.body=\"cats\""), &["scene.body", "cats", "swept"]);
    // --set replaces the file's value under either name.
    let sets = ["planning.ucb.sds=1.5".to_owned(), "scene.body=\"kinematic\"".to_owned()];
    let set = Experiment::load(&path.join("small.toml"), &sets).unwrap();
    assert_eq!(set.planning.ucb.kappa, 1.5);
    // A former table of --set changes single values of the present table.
    fs::write(
        path.join("scene.toml"),
        SCENE.split("[zone]").next().unwrap().to_owned()
            + "[whole_object]\ncentre_m = [0.3, 0.3, 0.3]\n",
    )
    .unwrap();
    for text in ["around.radius_m=2.0", "whole_object.radius_m=2.0"] {
        let scene = Scene::load(&path.join("scene.toml"), &[text.into()]).unwrap();
        let ball = scene.whole_object.unwrap();
        assert_eq!((ball.centre_m, ball.radius_m), (Some([0.3; 3]), Some(2.0)), "{text}");
    }
    fails(
        path,
        &["show", "scene.toml", "--set", "around.radius_m=-1"],
        &["--set around.radius_m=-1", "`around.radius_m`"],
    );
    fs::write(path.join("scene.toml"), format!("simulator = \"swept\"\n{}", former_scene()))
        .unwrap();
    fails(path, &["show", "scene.toml"], &["scene.toml:2", "`body`", "`simulator`", "keep one"]);
}

#[test]
fn former_columns_are_read() {
    let row = r#"{"trial":0,"planner":"active","touches":[{"target":{"place":[0.5]},
        "outcome":{"end":"miss"},
        "stall":"collapsed","outline":{"brier":0.1,"iou":0.5,"wrong_share":0.2}}]}"#;
    let row: TrialRow = serde_json::from_str(row).unwrap();
    let touch = &row.touches[0];
    assert_eq!(touch.fallback, Some(Fallback::NoVariance));
    assert_eq!(touch.silhouette.as_ref().unwrap().misclassified_share, 0.2);
}
