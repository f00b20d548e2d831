//! Tests of invalid input to the real program: a clear error, exit code 2, and no panic.

use std::fs;
use std::process::Output;

use crate::common::program::{EXPERIMENT, SCENE, folder, palpate};

/// Cases that were not rejected with the required message.
#[derive(Default)]
struct Accepted(Vec<String>);

impl Accepted {
    /// Requires exit code 2 and a message that starts with `error:` and contains all of `says`.
    fn refuse(&mut self, case: &str, output: &Output, says: &[&str]) {
        let message = String::from_utf8_lossy(&output.stderr);
        let is_error = output.status.code() == Some(2) && message.starts_with("error: ");
        if !is_error || message.contains("panicked") {
            self.0.push(format!("{case}\n    {:?}: {message}", output.status.code()));
        } else if let Some(word) = says.iter().find(|&word| !message.contains(word)) {
            self.0.push(format!("{case}\n    no \"{word}\" in {message}"));
        }
    }
}

impl Drop for Accepted {
    fn drop(&mut self) {
        assert!(self.0.is_empty() || std::thread::panicking(), "\n{}", self.0.join("\n"));
    }
}

#[test]
fn the_unbroken_folder_runs() {
    let folder = folder();
    let output = palpate(folder.path(), &["run", "small.toml"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(folder.path().join("runs/small/report.html").is_file());
}

#[test]
fn broken_experiments_are_refused_with_file_line_key_and_remedy() {
    // Original text, replacement, and required parts of the message.
    let cases: &[(&str, &str, &[&str])] = &[
        ("trials = 1", "trials = 0", &["small.toml:4", "trials", "0", "1 to 1000000"]),
        ("trials = 1", "trials = -1", &["small.toml:4", "trials", "-1"]),
        ("trials = 1", "trials = 1.5", &["small.toml:4", "trials", "1.5"]),
        ("trials = 1", "trials = nan", &["small.toml:4", "trials"]),
        ("trials = 1", "trials = \"many\"", &["small.toml:4", "trials", "many"]),
        ("trials = 1", "trials = 99999999999", &["small.toml:4", "trials"]),
        ("trials = 1", "trials = 9999999", &["small.toml:4", "1 to 1000000"]),
        ("trials = 1", "trails = 1", &["small.toml:4", "`trails`", "did you mean `trials`"]),
        ("trials = 1", "", &["small.toml", "trials"]),
        ("trials = 1", "trials = 1\ntrials = 2", &["small.toml:5", "duplicate"]),
        ("trials = 1", "trials = ", &["small.toml:4", "not valid TOML"]),
        ("trials = 1", "trials = [1]", &["small.toml:4", "trials"]),
        ("trials = 1", "trials = true", &["small.toml:4", "trials"]),
        ("trials = 1", "trials = 1\nseed = -5", &["small.toml:5", "seed", "-5"]),
        ("trials = 1", "trials = 1\nseed = 1e3", &["small.toml:5", "seed"]),
        ("touches = 3", "touches = 0", &["small.toml:6", "touches"]),
        ("touches = 3", "touches = 100000", &["small.toml:6", "1 to 2000"]),
        ("initial_touches = 2", "initial_touches = 4", &["small.toml:5", "1 to 3"]),
        ("initial_touches = 2", "initial_touches = 0", &["small.toml:5", "1 to 3"]),
        ("grid = 5", "grid = 1", &["small.toml:7", "grid", "2 to 2001"]),
        ("grid = 5", "grid = 99999", &["small.toml:7", "2 to 2001"]),
        ("name = \"small\"", "name = \"\"", &["small.toml:1", "name"]),
        ("name = \"small\"", "name = \"../up\"", &["small.toml:1", "../up", "letters"]),
        ("name = \"small\"", "name = \"a/b\"", &["small.toml:1", "a/b"]),
        ("name = \"small\"", "name = \"-rf\"", &["small.toml:1", "-rf", "do not begin with -"]),
        ("name = \"small\"", "name = 7", &["small.toml:1", "name", "7"]),
        ("name = \"small\"", "nmae = \"small\"", &["nmae", "did you mean `name`"]),
        ("[\"random\"]", "[]", &["small.toml:3", "planners", "active, random, sobol"]),
        ("[\"random\"]", "[\"randon\"]", &["small.toml:3", "randon", "active, random, sobol"]),
        ("[\"random\"]", "[\"ei\"]", &["small.toml:3", "active, random, sobol", "silhouette"]),
        ("[\"random\"]", "[\"random\", \"random\"]", &["small.toml:3", "each name once"]),
        ("[\"random\"]", "\"random\"", &["small.toml:3", "planners"]),
        ("[\"random\"]", "[1]", &["small.toml:3", "planners[0]"]),
        ("scene.toml", "nowhere.toml", &["small.toml:2", "nowhere.toml", "readable file"]),
        ("scene.toml", "mesh.obj", &["mesh.obj", "not valid TOML"]),
        ("scene.toml", ".", &["small.toml:2", "readable file"]),
        ("scene = \"scene.toml\"", "scene = 3", &["small.toml:2", "scene"]),
        ("scene = \"scene.toml\"", "scene = {}", &["small.toml", "scene.simulator"]),
        ("scene = \"scene.toml\"", "", &["small.toml", "scene"]),
        ("[1e-4, 1e-2]", "[1e-2, 1e-4]", &["small.toml:10", "noise", "smaller number first"]),
        ("[1e-4, 1e-2]", "[nan, 1e-2]", &["small.toml:10", "gp.noise[0]", "NaN"]),
        ("[1e-4, 1e-2]", "[0, 1e-2]", &["small.toml:10", "gp.noise[0]"]),
        ("[1e-4, 1e-2]", "[1e-4, inf]", &["small.toml:10", "gp.noise[1]"]),
        ("[1e-4, 1e-2]", "[1e-4]", &["small.toml:10", "gp.noise"]),
        ("[1e-4, 1e-2]", "\"low\"", &["small.toml:10", "gp.noise", "low"]),
        ("noise =", "nose =", &["small.toml:10", "gp.nose", "did you mean `noise`"]),
        ("noise =", "kernel = \"cubic\"\nnoise =", &["small.toml:10", "squared_exponential"]),
        ("noise =", "length_scale = [-1, 1]\nnoise =", &["small.toml:10", "length_scale[0]"]),
        ("[gp]", "[pg]", &["small.toml:9", "pg", "did you mean `gp`"]),
        ("[gp]", "[gp", &["small.toml:9", "not valid TOML"]),
        ("[gp]", "gp = 3\n[gp2]", &["small.toml"]),
        ("[3]", "[-3]", &["small.toml:13", "report.touch_counts[0]"]),
        ("[3]", "[0]", &["small.toml:13", "report.touch_counts[0]"]),
        ("[3]", "[3]\ntrial = -5", &["small.toml:14", "report.trial"]),
        ("[3]", "[3]\ntrial = 1", &["small.toml:14", "report.trial", "0 to 0"]),
        ("[3]", "[1,1,1,1,1,1,1,1,1]", &["small.toml:13", "report.touch_counts", "at most 8"]),
        ("[3]", "[3]\nplanners = [\"x\"]", &["small.toml:14", "report.planners[0]"]),
        ("[3]", "[3]\nbaselines = [\"x\"]", &["small.toml:14", "report.baselines[0]", "sobol"]),
        ("[3]", "[3]\nbaselines = \"sobol\"", &["small.toml:14", "report.baselines"]),
        ("[report]", "[planning]\ndirect_evaluations = 0\n[report]", &["small.toml:13"]),
        ("[report]", "[[report]]", &["small.toml:12", "report"]),
    ];
    let mut accepted = Accepted::default();
    for (old, new, says) in cases {
        let folder = folder();
        assert!(EXPERIMENT.contains(old), "{old}");
        fs::write(folder.path().join("small.toml"), EXPERIMENT.replace(old, new)).unwrap();
        accepted.refuse(new, &palpate(folder.path(), &["run", "small.toml"]), says);
    }
}

#[test]
fn broken_scenes_are_refused_with_file_line_key_and_remedy() {
    let cases: &[(&str, &str, &[&str])] = &[
        ("\"swept\"", "\"cats\"", &["scene.toml:1", "simulator", "cats", "swept"]),
        ("\"swept\"", "3", &["scene.toml:1", "simulator"]),
        ("\"swept\"", "\"analytic\"", &["scene.toml", "function", "toy"]),
        ("simulator = \"swept\"", "", &["scene.toml", "simulator"]),
        ("[0.1, 0.4]\nz", "[0.4, 0.1]\nz", &["scene.toml:7", "zone.x_m", "smaller number first"]),
        ("[0.1, 0.4]\nz", "[0.1, 0.1]\nz", &["scene.toml:7", "zone.x_m"]),
        ("[0.1, 0.4]\nz", "[nan, 0.1]\nz", &["scene.toml:7", "zone.x_m[0]"]),
        ("[0.1, 0.4]\nz", "[0, 1e300]\nz", &["scene.toml:7", "zone.x_m[1]", "-1000 to 1000"]),
        ("[0.1, 0.4]\nz", "[0, 1, 2]\nz", &["scene.toml:7", "zone.x_m"]),
        ("[0.1, 0.4]\nz", "[0, 1e-320]\nz", &["scene.toml:7", "zone.x_m", "wide"]),
        ("[object]", "function = \"toy\"\n[object]", &["scene.toml:3", "function"]),
        ("[0.1, 0.4]\nz", "[8, 9]\nz", &["no surface in the zone", "x 0 to 1"]),
        ("x_m", "x_mm", &["scene.toml:7", "zone.x_mm", "did you mean `x_m`"]),
        ("x_m", "datum_y_m = inf\nx_m", &["scene.toml:7", "zone.datum_y_m"]),
        ("[zone]", "[zoen]", &["scene.toml:6", "zoen", "did you mean `zone`"]),
        ("\"mesh.obj\"", "\"mush.obj\"", &["mush.obj", "no such mesh", "[object]"]),
        ("\"mesh.obj\"", "\"\"", &["scene.toml:4", "object.mesh"]),
        ("\"mesh.obj\"", "\".\"", &["cannot be read"]),
        ("\"mesh.obj\"", "\"scene.toml\"", &["scene.toml", "obj, gltf, glb, stl, ply"]),
        ("\"mesh.obj\"", "3", &["scene.toml:4", "object.mesh"]),
        ("[object]", "[obejct]", &["scene.toml:3", "obejct", "did you mean `object`"]),
        ("[object]", "[object]\nunit = \"km\"", &["scene.toml:4", "object.unit", "km", "mm"]),
        ("[object]", "[object]\nscale = 0", &["scene.toml:4", "object.scale"]),
        ("[object]", "[object]\nscale = -1", &["scene.toml:4", "object.scale"]),
        ("[object]", "[object]\nscale = 1e8", &["mesh.obj", "more than 10000 m"]),
        ("[object]", "[object]\nposition_m = [0, 0]", &["scene.toml:4", "object.position_m"]),
        ("[object]", "[object]\nposition_m = [0, 0, nan]", &["scene.toml:4", "position_m[2]"]),
        ("[object]", "[object]\nrotation_deg = [0, 0, 1e9]", &["scene.toml:4", "rotation_deg[2]"]),
        ("[object]", "[object]\ntruth = \"brid\"", &["scene.toml:4", "brid", "container, bird"]),
        ("[object]", "[finger]\nradius_m = 0\n[object]", &["scene.toml:4", "finger.radius_m"]),
        (
            "[object]",
            "[finger]\nradius = 1\n[object]",
            &["scene.toml:4", "did you mean `radius_m`"],
        ),
        ("[object]", "[finger]\npitch_deg = 400\n[object]", &["scene.toml:4", "-90 to 90"]),
        ("[object]", "[finger]\nlength_m = nan\n[object]", &["scene.toml:4", "finger.length_m"]),
    ];
    let mut accepted = Accepted::default();
    for (old, new, says) in cases {
        let folder = folder();
        assert!(SCENE.contains(old), "{old}");
        fs::write(folder.path().join("scene.toml"), SCENE.replacen(old, new, 1)).unwrap();
        accepted.refuse(new, &palpate(folder.path(), &["run", "small.toml"]), says);
        accepted.refuse(new, &palpate(folder.path(), &["show", "scene.toml"]), says);
    }
}

#[test]
fn broken_meshes_are_refused_by_show_and_run() {
    let cases: &[(&str, &[u8], &[&str])] = &[
        ("empty", b"", &["no triangles"]),
        ("only vertices", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", &["no triangles"]),
        ("NaN", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &["mesh.obj"]),
        ("index out of range", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", &["9"]),
        ("index zero", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", &["0"]),
        ("degenerate", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", &["mesh.obj"]),
        ("huge", b"v 0 0 0\nv 1e30 0 0\nv 0 1e30 0\nf 1 2 3\n", &["mesh.obj"]),
        ("words", b"v a b c\nf 1 2 3\n", &["mesh.obj", "line 1"]),
        ("junk", b"\x00\xff\xfe\x01\x80\x80\x00junk", &["mesh.obj"]),
        ("cut short", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2", &["mesh.obj"]),
    ];
    let mut accepted = Accepted::default();
    for (case, bytes, says) in cases {
        let folder = folder();
        fs::write(folder.path().join("mesh.obj"), bytes).unwrap();
        accepted.refuse(case, &palpate(folder.path(), &["show", "mesh.obj"]), says);
        accepted.refuse(case, &palpate(folder.path(), &["run", "small.toml"]), says);
    }
}

#[test]
fn broken_command_lines_are_refused() {
    let cases: &[(&[&str], &[&str])] = &[
        (&["run", "none.toml"], &["none.toml"]),
        (&["run", "."], &["."]),
        (&["run", "mesh.obj"], &["mesh.obj is a mesh", "palpate new mesh.obj"]),
        (&["run", "scene.toml"], &["scene.toml", "this is a scene", "palpate show"]),
        (&["export", "small.toml"], &["small.toml", "this is an experiment", "palpate run"]),
        (&["accuracy", "small.toml"], &["small.toml", "this is an experiment"]),
        (&["run", "small.toml", "--set", "trials"], &["--set trials", "key=value"]),
        (&["run", "small.toml", "--set", "=3"], &["--set =3", "key=value"]),
        (&["run", "small.toml", "--set", "trials=0"], &["--set trials=0", "1 to 1000000"]),
        (&["run", "small.toml", "--set", "trails=3"], &["--set trails=3", "`trials`"]),
        (&["run", "small.toml", "--set", "trials.x=3"], &["--set trials.x=3"]),
        (&["run", "small.toml", "--set", "a.b.c=3"], &["--set a.b.c=3", "unknown key `a`"]),
        (&["show", "mesh.obj", "--set", "a=1"], &["--set", "mesh.obj"]),
        (&["show", "scene.toml", "--unit", "mm"], &["--unit", "object.unit"]),
        (&["run", "small.toml", "--set", "gp.noise=7"], &["--set gp.noise=7"]),
        (&["run", "small.toml", "--set", "scene=none.toml"], &["--set scene=none.toml"]),
        (&["run", "small.toml", "--out", "mesh.obj"], &["mesh.obj"]),
        (&["run", "small.toml", "--out", "."], &[".", "other files", "--out"]),
        (&["run", "small.toml", "--threads", "x"], &["--threads"]),
        (&["run", "small.toml", "--threads", "100000"], &["--threads", "1024"]),
        (&["report", "none"], &["none"]),
        (&["report", "mesh.obj"], &["mesh.obj"]),
        (&["show", "none.obj"], &["none.obj", "no such file"]),
        (&["show", "small.toml", "--mjcf", "x.xml"], &["--mjcf", "scene"]),
        (&["show", "mesh.obj", "--unit", "mile"], &["--unit"]),
        (&["shew", "mesh.obj"], &["shew"]),
    ];
    let mut accepted = Accepted::default();
    for (arguments, says) in cases {
        let folder = folder();
        accepted.refuse(&arguments.join(" "), &palpate(folder.path(), arguments), says);
    }
}

#[test]
fn damaged_run_folders_are_refused_and_lose_nothing() {
    let folder = folder();
    let run =
        |arguments: &[&str]| palpate(folder.path(), &[&["run", "small.toml"], arguments].concat());
    assert!(run(&[]).status.success());
    let trials = folder.path().join("runs/small/trials.jsonl");
    let rows = fs::read(&trials).unwrap();
    let mut accepted = Accepted::default();
    accepted.refuse(
        "another experiment",
        &run(&["--set", "seed=9"]),
        &["seed = 9", "--out", "--fresh"],
    );
    assert_eq!(fs::read(&trials).unwrap(), rows);
    fs::write(&trials, [b"{\"trial\": \"x\"}\n", rows.as_slice()].concat()).unwrap();
    accepted.refuse("a line that is no row", &run(&[]), &["trials.jsonl:1"]);
    fs::write(&trials, [rows.as_slice(), b"{\"trial\": null}\n"].concat()).unwrap();
    accepted.refuse("a whole last line that is no row", &run(&[]), &["trials.jsonl:2"]);
    fs::write(&trials, &rows).unwrap();
    fs::write(&trials, [rows.as_slice(), rows.as_slice()].concat()).unwrap();
    accepted.refuse("the same trial twice", &run(&[]), &["trials.jsonl:2", "duplicate"]);
    assert!(run(&["--set", "touches=2", "--out", "runs/shorter"]).status.success());
    fs::copy(folder.path().join("runs/shorter/trials.jsonl"), &trials).unwrap();
    accepted.refuse("a trial of another run", &run(&[]), &["trials.jsonl:1", "2 touches of 3"]);
    fs::write(&trials, &rows).unwrap();
    let locked = fs::File::open(&trials).unwrap();
    locked.lock().unwrap();
    accepted.refuse("a folder being written", &run(&["--fresh"]), &["another run"]);
    let set = |set: &str| palpate(folder.path(), &["report", "runs/small", "--set", set]);
    accepted.refuse("the same, by its report", &set("question=why"), &["another run"]);
    locked.unlock().unwrap();
    assert_eq!(fs::read(&trials).unwrap(), rows);
    let resolved = fs::read(folder.path().join("runs/small/resolved.toml")).unwrap();
    for (assignment, says) in [
        ("trials=2", ["--set trials=2", "`report.…`", "`question`"]),
        ("reports.trial=0", ["--set reports.trial=0", "`report.…`", "`question`"]),
        ("report.trial=1", ["--set report.trial=1", "`report.trial`", "0 to 0"]),
        ("report.trail=0", ["--set report.trail=0", "`report.trail`", "did you mean `trial`"]),
        ("report.baselines=[\"x\"]", ["--set report.baselines", "report.baselines[0]", "sobol"]),
        ("question", ["--set question", "key=value", ""]),
    ] {
        accepted.refuse(assignment, &set(assignment), &says);
    }
    assert_eq!(fs::read(folder.path().join("runs/small/resolved.toml")).unwrap(), resolved);
    fs::write(folder.path().join("runs/small/surface.csv"), "x_m,z_m,height_m\n1,2,x\n").unwrap();
    let report = palpate(folder.path(), &["report", "runs/small"]);
    let none = palpate(folder.path(), &["report", "."]);
    accepted.refuse("a folder that is no run", &none, &["not a run's folder"]);
    accepted.refuse("a surface that is none", &report, &["surface.csv:2", "\"x\""]);
}
