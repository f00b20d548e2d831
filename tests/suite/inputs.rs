//! Tests of the files that an experiment reads: their contents belong to a run, and a file that
//! cannot be used is refused before anything is written.

use crate::common::program::{fails, folder, palpate, succeeds};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Points of a plane in `W` seen from the front, `off_m` behind it.
fn cloud(off_m: f64) -> String {
    let side = 40;
    let at = |i: usize| 0.1 + 0.3 * i as f64 / (side - 1) as f64;
    let points = (0..side * side).map(|i| {
        let (x, z) = (at(i % side), at(i / side));
        // The slanted face of the tetrahedron with corners 0 and the unit points.
        let y = 1.0 - x - z - off_m;
        format!("{x} {y} {z}\n")
    });
    let points: String = points.collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double \
         z\nend_header\n{points}",
        side * side
    )
}

/// A folder with an experiment that begins with the views of `camera` and `camera.further.left`.
fn with_views(off_m: f64) -> TempDir {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("view.ply"), cloud(off_m)).unwrap();
    fs::write(at("left.ply"), cloud(off_m)).unwrap();
    let camera = "\n[camera]\nposition_m = [0.25, 2.0, 0.25]\nfile = \"view.ply\"\nframe = \"world\"\n\
                  [camera.pose_error]\n[camera.further.left]\nposition_m = [0.3, 2.0, 0.25]\n\
                  file = \"left.ply\"\n";
    let scene = fs::read_to_string(at("scene.toml")).unwrap() + camera;
    fs::write(at("scene.toml"), scene).unwrap();
    let experiment = fs::read_to_string(at("small.toml")).unwrap();
    let experiment = experiment.replace("trials = 1", "trials = 2\nviews = 2");
    fs::write(at("small.toml"), experiment).unwrap();
    folder
}

fn rows(folder: &Path, run: &str) -> Vec<u8> {
    fs::read(folder.join(run).join("trials.jsonl")).unwrap()
}

const RUN: [&str; 4] = ["--quiet", "run", "small.toml", "--no-report"];

/// Rows of the earlier content are not taken for those of the present one.
#[test]
fn a_run_depends_on_the_content_of_every_file_of_its_settings() {
    for file in ["view.ply", "left.ply"] {
        let folder = with_views(0.0);
        let path = folder.path();
        succeeds(path, &RUN);
        let before = rows(path, "runs/small");
        fs::write(path.join(file), cloud(0.004)).unwrap();
        fails(path, &RUN, &[file, "has changed since the run began", "--fresh"]);
        assert_eq!(rows(path, "runs/small"), before, "{file}");
        succeeds(path, &[&RUN[..], &["--fresh"]].concat());
        assert_ne!(rows(path, "runs/small"), before, "{file}");
    }
}

#[test]
fn a_run_depends_on_the_meshes_of_its_library() {
    let folder = TempDir::new().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("objects")).unwrap();
    let cube = |half: f64| {
        let corners = (0..8).map(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { half } else { -half };
            format!("v {} {} {}\n", sign(0), sign(1), sign(2))
        });
        let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
        corners.collect::<String>() + faces
    };
    let write = |name: &str, half: f64| {
        fs::write(path.join("objects").join(name), cube(half)).unwrap();
    };
    write("large.obj", 0.04);
    write("small.obj", 0.03);
    let scene = "simulator = \"swept\"\n[library]\nfolder = \"objects\"\n[pose]\nposition_m = [0, -0.65, 0.4]\n\
                 half_width_m = [0.01, 0.01, 0]\nturn = \"yaw\"\n[whole_object]\ncentre_m = [0, -0.65, 0.44]\nradius_m = 0.12\nlowest_m = 0.4\n\
                 [finger]\nradius_m = 0.005\nlength_m = 0.1\npitch_deg = 0\n";
    fs::write(path.join("scene.toml"), scene).unwrap();
    let experiment = "name = \"small\"\nscene = \"scene.toml\"\nplanners = [\"sobol\"]\ntrials = 2\n\
                      initial_touches = 1\ntouches = 1\n[recognition]\nparticles = 16\n";
    fs::write(path.join("small.toml"), experiment).unwrap();
    succeeds(path, &RUN);
    // Neither a hidden file nor another kind of file is an object.
    fs::write(path.join("objects/._large.obj"), "resource fork").unwrap();
    fs::write(path.join("objects/README.md"), "two cubes").unwrap();
    succeeds(path, &RUN);
    // In mm, as most parts are.
    write("small.obj", 30.0);
    fails(path, &RUN, &["small.obj", "with library.unit = \"mm\" it would measure 0.10"]);
    write("small.obj", 0.031);
    fails(path, &RUN, &["scene.library.folder", "has changed since the run began"]);
}

#[test]
fn shards_of_other_content_are_not_merged() {
    let folder = with_views(0.0);
    let path = folder.path();
    succeeds(path, &[&RUN[..], &["--shard", "1/2"]].concat());
    fs::write(path.join("left.ply"), cloud(0.004)).unwrap();
    succeeds(path, &[&RUN[..], &["--shard", "2/2"]].concat());
    let shards = ["runs/small-1-of-2", "runs/small-2-of-2"];
    let merge = [&["report", "runs/merged", "--merge"][..], &shards].concat();
    fails(path, &merge, &["scene.camera.further.left.file", "has changed"]);
    assert!(!path.join("runs/merged/trials.jsonl").exists());
}

/// A run folder names its files relative to itself, so that both can be moved together.
#[test]
fn a_run_and_its_files_can_be_moved() {
    let folder = with_views(0.0);
    let project = folder.path().join("project");
    fs::create_dir(&project).unwrap();
    for name in ["mesh.obj", "view.ply", "left.ply", "scene.toml", "small.toml"] {
        fs::rename(folder.path().join(name), project.join(name)).unwrap();
    }
    succeeds(&project, &RUN);
    let rows = rows(&project, "runs/small");
    let moved = folder.path().join("moved");
    fs::rename(&project, &moved).unwrap();
    succeeds(&moved, &["run", "runs/small/resolved.toml", "--no-report", "--out", "runs/again"]);
    assert_eq!(fs::read(moved.join("runs/again/trials.jsonl")).unwrap(), rows);
}

#[test]
fn a_view_that_cannot_be_used_is_refused_before_anything_is_written() {
    let shifted = cloud(0.0).replace("property double z", "property double w");
    let without_points = cloud(0.0).lines().take(6).collect::<Vec<_>>().join("\n");
    let without_points = without_points.replace("vertex 1600", "vertex 0") + "\nend_header\n";
    let cases = [
        ("view.ply", "not a cloud".to_owned(), "neither a PLY or PCD cloud nor a PNG image"),
        ("view.ply", shifted, "must have x, y and z"),
        ("left.ply", without_points, "has no points"),
        ("left.ply", cloud(3.0), "shows nothing of the region"),
    ];
    for (file, text, says) in cases {
        let folder = with_views(0.0);
        let path = folder.path();
        fs::write(path.join(file), text).unwrap();
        fails(path, &RUN, &[file, says]);
        assert!(!path.join("runs").exists(), "{says}");
        // Mended, the same command runs.
        fs::write(path.join(file), cloud(0.0)).unwrap();
        succeeds(path, &RUN);
    }
    let folder = with_views(0.0);
    fs::remove_file(folder.path().join("left.ply")).unwrap();
    fails(folder.path(), &RUN, &["left.ply"]);
    assert!(!folder.path().join("runs").exists());
}

/// Trials that failed before their first touch are run again once their cause is mended.
#[test]
fn a_run_without_a_touch_starts_again() {
    let folder = with_views(0.0);
    let path = folder.path();
    succeeds(path, &RUN);
    let whole = rows(path, "runs/small");
    let failed = |row: &str| {
        let mut row: serde_json::Value = serde_json::from_str(row).unwrap();
        row["touches"] = serde_json::json!([]);
        row["failure"] = "the view has no points".into();
        format!("{row}\n")
    };
    let text = String::from_utf8(whole.clone()).unwrap();
    let text: String = text.lines().map(failed).collect();
    fs::write(path.join("runs/small/trials.jsonl"), text).unwrap();
    fs::write(path.join("runs/small/content.json"), "{\"scene.camera.file\": \"other\"}").unwrap();
    let output = palpate(path, &RUN);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(rows(path, "runs/small"), whole);
}
