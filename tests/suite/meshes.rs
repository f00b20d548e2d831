//! Tests of `palpate export`.

use palpate::sim::{Environment, Scene};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

fn palpate(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .unwrap()
}

/// Runs the program, which must succeed.
fn done(arguments: &[&str]) {
    let output = palpate(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Returns the error message of an invalid command.
fn refused(arguments: &[&str]) -> String {
    let output = palpate(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// Numbers of a PLY file's vertices and faces.
fn ply(path: &Path) -> (Vec<Vec<f64>>, Vec<Vec<usize>>) {
    let text = fs::read_to_string(path).unwrap();
    let (head, body) = text.split_once("end_header\n").unwrap();
    let count = |element: &str| {
        let line = head.lines().find_map(|line| line.strip_prefix(element));
        line.map_or(0, |count| count.parse().unwrap())
    };
    let vertices: usize = count("element vertex ");
    let lines: Vec<&str> = body.lines().collect();
    assert_eq!(lines.len(), vertices + count("element face "));
    let (vertices, faces) = lines.split_at(vertices);
    let numbers = |line: &&str| line.split(' ').map(|number| number.parse().unwrap()).collect();
    let indices = |line: &&str| line.split(' ').map(|index| index.parse().unwrap()).collect();
    (vertices.iter().map(numbers).collect(), faces.iter().map(indices).collect())
}

/// The container is convex, so the finger touches its true surface.
#[test]
fn a_scan_is_the_surface_and_does_not_depend_on_threads() {
    let folder = TempDir::new().unwrap();
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
    for (out, threads) in [(&one, "1"), (&two, "2")] {
        let out = out.to_str().unwrap();
        let scene = "scenes/container.toml";
        done(&["export", scene, "--grid", "7x9", "--threads", threads, "--out", out]);
    }
    for name in ["cloud.ply", "cloud.csv", "scan.svg", "scan.png", "scan.pdf"] {
        assert!(fs::read(one.join(name)).unwrap() == fs::read(two.join(name)).unwrap(), "{name}");
    }
    let (points, faces) = ply(&one.join("cloud.ply"));
    assert_eq!((points.len(), faces.len()), (63, 0));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container.toml");
    let environment = Environment::build(Scene::load(&path, &[]).unwrap()).unwrap();
    for point in &points {
        let true_m = environment.true_height_m(&[point[0], point[2]]).unwrap();
        let felt_m = point[1] - environment.task().zone().unwrap().datum_y_m();
        assert!((felt_m - true_m).abs() < 1e-4, "{point:?}: {true_m}");
        let length = point[3..6].iter().map(|part| part * part).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-5 && point[4] > 0.0, "{point:?}");
    }
    let lines = fs::read_to_string(one.join("cloud.csv")).unwrap().lines().count();
    assert_eq!(lines, 64);
}

#[test]
fn a_belief_is_exported_as_it_was_and_mistakes_say_what_is_allowed() {
    let folder = TempDir::new().unwrap();
    let run = folder.path().join("run");
    let (run, sets) = (run.to_str().unwrap(), ["trials=1", "touches=9", "grid=11"]);
    let mut arguments = vec!["run", "experiments/container.toml", "--no-report", "--out", run];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    arguments.extend(["--threads", "1"]);
    done(&arguments);
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (mesh, other) = (file("belief.ply"), file("belief.obj"));
    done(&["export", run, "--planner", "active", "--touches", "8", "--out", &mesh]);
    done(&["export", run, "--planner", "active", "--touches", "8", "--out", &other]);

    let (points, faces) = ply(Path::new(&mesh));
    assert_eq!((points.len(), faces.len()), (121, 200));
    for face in &faces {
        let [a, b, c] = [1, 2, 3].map(|i| nalgebra::Vector3::from_row_slice(&points[face[i]][..3]));
        assert!((b - a).cross(&(c - a)).y > 0.0, "a face looks away from the finger");
    }
    let is_sure = |point: &Vec<f64>| (0.0..0.05).contains(&point[9]) && point[4] > 0.0;
    assert!(points.iter().all(is_sure));
    // The RMSE of the vertices relative to the recorded truth is the recorded one.
    let run_read = palpate::experiment::store::Run::read(Path::new(run)).unwrap();
    let (truth, datum_m) =
        (&run_read.truth, run_read.experiment.scene.zone.as_ref().unwrap().datum_y_m());
    let squares: Vec<f64> = (points.iter().zip(&truth.heights_m))
        .filter_map(|(point, height_m)| Some((point[1] - datum_m - (*height_m)?).powi(2)))
        .collect();
    let rmse_m = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let recorded_m = run_read.rows[0].touches[7].metrics.unwrap().rmse_m;
    assert!((rmse_m - recorded_m).abs() < 1e-6, "{rmse_m} {recorded_m}");

    let text = fs::read_to_string(&other).unwrap();
    let count = |start: &str| text.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!([count("v "), count("vn "), count("f ")], [121, 121, 200]);
    for extension in ["svg", "png", "pdf"] {
        assert!(Path::new(&file(&format!("belief.{extension}"))).is_file(), "{extension}");
    }

    let export = |planner: &str, trial: &str, touches: &str, out: &str| {
        let choice = ["--planner", planner, "--trial", trial, "--touches", touches];
        refused(&[&["export", run, "--out", out], &choice[..]].concat())
    };
    assert!(export("activ", "0", "8", &mesh).contains("active, random, sobol"));
    assert!(export("active", "1", "8", &mesh).contains("trials 0 to 0"));
    assert!(export("active", "0", "4", &mesh).contains("5 to 9 touches"));
    assert!(export("active", "0", "8", &file("belief.stl")).contains(".ply or .obj (mesh)"));
}

#[test]
fn what_cannot_be_scanned_is_refused() {
    assert!(refused(&["export", "scenes/toy.toml"]).contains("no object"));
    assert!(refused(&["export", "scenes/bird.toml", "--grid", "1x9"]).contains("NxM"));
}
