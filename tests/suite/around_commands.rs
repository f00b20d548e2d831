//! Tests of commands on whole objects: outputs can be read back, and commands for zones reject
//! whole objects.

use crate::common::program::{fails, folder, palpate, stderr, succeeds};
use crate::common::shipped::scene;
use nalgebra::Point3;
use palpate::explore::registration::CalibrationBody;
use palpate::geometry::import::import;
use palpate::sim::known_body;
use std::fs;
use tempfile::TempDir;

/// A folder with the tetrahedron of [`folder`] as a whole object, and an experiment that runs in a
/// second.
fn around() -> TempDir {
    let folder = folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write(
        "scene.toml",
        "simulator = \"swept\"\n\n[object]\nmesh = \"mesh.obj\"\n\n[whole_object]\n",
    );
    write(
        "small.toml",
        "name = \"small\"\nscene = \"scene.toml\"\nplanners = [\"active\", \"random\"]\ntrials = 2\n\
         initial_touches = 4\ntouches = 8\n\n[gp]\ncells = 16\nevaluate_every = 4\n\n\
         [report]\ntouch_counts = [8]\n",
    );
    folder
}

#[test]
fn a_whole_belief_is_exported_and_read_back() {
    let folder = around();
    succeeds(folder.path(), &["run", "small.toml", "--no-report"]);
    let mut counts = Vec::new();
    for (name, grid) in [("it.ply", "16"), ("it.obj", "16"), ("fine.ply", "48")] {
        let export =
            ["export", "runs/small", "--planner", "active", "--trial", "1", "--touches", "7"];
        let values =
            succeeds(folder.path(), &[&export[..], &["--grid", grid, "--out", name]].concat());
        assert!(values.contains("sigma up to"), "{values}");
        let (mesh, _) = import(&folder.path().join(name), 1.0).unwrap();
        let (low, high) = mesh.bounds();
        assert!((high - low).max() > 0.2 && (high - low).max() < 2.0, "{name}: {low} {high}");
        counts.push(mesh.triangles().len());
        let words =
            format!("{} vertices, {} triangles", mesh.vertices().len(), mesh.triangles().len());
        assert!(values.contains(&words), "{words} in {values}");
    }
    assert!(counts[0] == counts[1] && counts[2] > 4 * counts[0], "{counts:?}");
    let text = fs::read_to_string(folder.path().join("it.ply")).unwrap();
    assert!(text.contains("property float sigma_m\nproperty float error_m\n"));
    for extension in ["svg", "png", "pdf"] {
        assert!(folder.path().join(format!("it.{extension}")).is_file(), "{extension}");
    }
    // A film has the beliefs whose errors were computed.
    let says = succeeds(
        folder.path(),
        &["export", "runs/small", "--planner", "active", "--out", "it.gif"],
    );
    assert!(says.contains("2 frames, 4 to 8 touches of active"), "{says}");
    assert!(says.contains("the median of 2 by final Chamfer distance"), "{says}");
    let export = ["export", "runs/small", "--planner", "active", "--out", "no.ply", "--grid", "4"];
    fails(folder.path(), &export, &["--grid 4", "8 to 256 cells"]);
    assert!(!folder.path().join("no.ply").exists());
}

#[test]
fn planners_around_an_object_are_held_against_what_they_were() {
    let folder = around();
    let check = ["check", "small.toml", "--baseline", "it.jsonl", "--max-trials", "2"];
    succeeds(folder.path(), &[&check[..], &["--accept", "so it is"]].concat());
    let same = succeeds(folder.path(), &check);
    assert!(same.trim_end().ends_with("identical"), "{same}");
    // Touches are equal, but their evaluation differs.
    let other = palpate(folder.path(), &[&check[..], &["--set", "gp.cells=24"]].concat());
    let values = String::from_utf8_lossy(&other.stdout).into_owned();
    assert!(matches!(other.status.code(), Some(0 | 1 | 3)), "{values} {}", stderr(&other));
    assert!(values.contains("error after the last touch") && !values.contains("RMSE"), "{values}");
}

#[test]
fn what_goes_over_a_zone_refuses_a_whole_object() {
    let folder = around();
    for command in ["export", "accuracy"] {
        fails(folder.path(), &[command, "scene.toml"], &["scene.toml: [whole_object]", "[zone]"]);
    }
    let shown = succeeds(folder.path(), &["show", "scene.toml"]);
    assert!(shown.contains("ball: 9") && shown.contains("% of the surface"), "{shown}");
    assert!(!shown.contains("zone") && !shown.contains("refuses"), "{shown}");
    let mjcf = ["show", "scene.toml", "--mjcf", "it.xml"];
    fails(folder.path(), &mjcf, &["no MuJoCo model", "[arm]"]);
    succeeds(folder.path(), &["show", "scene.toml", "--picture", "reach.svg"]);
    assert!(folder.path().join("reach.svg").is_file());
    fails(folder.path(), &["show", "scene.toml", "--watch"], &["does not move"]);
}

/// A robot for whole objects registers at one side of a body.
#[test]
fn a_known_body_takes_the_place_of_a_whole_object() {
    let body = CalibrationBody::Ball { centre_w: Point3::new(0.0, -0.65, 0.5), radius_m: 0.02 };
    let scene = scene("container_around_pa10.toml", &[]);
    let environment = known_body::environment(&scene, &body).unwrap();
    assert!(environment.task().ball().is_none());
    assert!(environment.task().zone().unwrap().dimension() == 2);
}

/// Centre and radius do not identify the mesh; its hash does.
#[test]
fn a_run_does_not_resume_on_another_mesh() {
    let folder = around();
    let ball = ["scene.whole_object.centre_m=[0.4,0.4,0.4]", "scene.whole_object.radius_m=1.0"];
    let run = ["run", "small.toml", "--no-report", "--set", ball[0], "--set", ball[1]];
    let run = |more: &[&'static str]| [&run[..], more].concat();
    succeeds(folder.path(), &run(&[]));
    let mesh = folder.path().join("mesh.obj");
    let text = fs::read_to_string(&mesh).unwrap();
    // Changes of comments do not matter, only changes of geometry.
    fs::write(&mesh, format!("# the same\n{text}")).unwrap();
    succeeds(folder.path(), &run(&["--set", "trials=3"]));
    fs::write(&mesh, text.replace("v 0 0 1\n", "v 0 0 0.9\n")).unwrap();
    let says = ["scene.object.mesh", "mesh.obj", "has changed", "--fresh", "--out"];
    fails(folder.path(), &run(&["--set", "trials=4"]), &says);
    succeeds(folder.path(), &run(&["--fresh"]));
}

/// The ball derived from the object's size is checked before the run.
#[test]
fn an_object_too_small_to_go_around_is_refused_at_once() {
    let folder = around();
    for scale in ["0.00001", "1000"] {
        let set = format!("scene.object.scale={scale}");
        let says = ["the object's size is", "m, and the ball", "allowed is", "object.scale"];
        fails(folder.path(), &["run", "small.toml", "--set", &set], &says);
    }
    assert!(!folder.path().join("runs").exists());
}

/// The folder contains the truth for figures: it can be moved, and the mesh can be deleted or
/// changed.
#[test]
fn a_report_needs_its_folder_alone() {
    let folder = around();
    succeeds(folder.path(), &["run", "small.toml"]);
    let read = |run: &str| {
        let path = folder.path().join(run);
        let files = ["report.html", "figures/solids.svg", "figures/errors.svg", "summary.csv"];
        files.map(|name| fs::read(path.join(name)).ok())
    };
    let drawn = read("runs/small");
    assert!(drawn[0].is_some() && drawn[1].is_some());
    let mesh = folder.path().join("mesh.obj");
    let text = fs::read_to_string(&mesh).unwrap();
    fs::write(&mesh, text.replace("v 0 0 1\n", "v 0 0 2\n")).unwrap();
    fs::create_dir(folder.path().join("elsewhere")).unwrap();
    fs::rename(folder.path().join("runs/small"), folder.path().join("elsewhere/deep")).unwrap();
    succeeds(folder.path(), &["report", "elsewhere/deep"]);
    assert!(read("elsewhere/deep") == drawn);
    fs::remove_file(&mesh).unwrap();
    succeeds(folder.path(), &["report", "elsewhere/deep"]);
    assert!(read("elsewhere/deep") == drawn);
    let export = ["export", "elsewhere/deep", "--planner", "active", "--out", "it.ply"];
    succeeds(folder.path(), &export);
    let text = fs::read_to_string(folder.path().join("it.ply")).unwrap();
    assert!(text.contains("property float error_m"));
}
