//! Tests of the command line.

use crate::common::program::{command, fails, folder, palpate, run_to_end, stderr, succeeds};
use palpate::config::Loader;
use palpate::experiment::Experiment;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

#[test]
fn what_has_a_name_is_listed() {
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    let all = succeeds(home, &["list"]);
    for name in ["container_pa10", "bird_thin", "integrated_variance", "rmse_m", "electrodes"] {
        assert!(all.lines().any(|line| line.trim_start().starts_with(name)), "{name} in {all}");
    }
    let planners = succeeds(home, &["list", "planners"]);
    assert!(planners.contains("sobol") && !planners.contains("rmse_m"), "{planners}");
    fails(home, &["list", "colours"], &["colours", "planners"]);
}

#[test]
fn experiments_and_scenes_are_found_by_name() {
    let folder = folder();
    fs::create_dir(folder.path().join("experiments")).unwrap();
    for name in ["mesh.obj", "scene.toml", "small.toml"] {
        let inner = folder.path().join("experiments").join(name);
        fs::rename(folder.path().join(name), inner).unwrap();
    }
    fails(folder.path(), &["run", "smal"], &["smal: no such file", "did you mean `small`?"]);
    let text = succeeds(folder.path(), &["list", "experiments"]);
    assert!(text.contains("small"), "{text}");
    succeeds(folder.path(), &["run", "small", "--no-report"]);
    assert!(folder.path().join("runs/small/trials.jsonl").is_file());
}

/// Outside a checkout the program has its experiments, scenes and models in the user's cache.
#[test]
fn shipped_files_are_found_in_an_empty_folder() {
    let (folder, cache) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let run = |arguments: &[&str]| {
        let mut command = command(folder.path(), arguments);
        let output = run_to_end(command.env("XDG_CACHE_HOME", cache.path()), "in an empty folder");
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let listed = run(&["list"]);
    assert!(["bird_thin", "container_pa10"].iter().all(|name| listed.contains(name)), "{listed}");
    let homes = || fs::read_dir(cache.path().join("palpate")).unwrap().flatten();
    let home = homes().next().unwrap().path();
    for name in ["experiments/toy.toml", "scenes/suite/mug.toml", "models/bird.glb"] {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        assert_eq!(fs::read(home.join(name)).unwrap(), fs::read(source).unwrap(), "{name}");
    }
    let few = [
        "--set",
        "trials=1",
        "--set",
        "touches=6",
        "--set",
        "initial_touches=4",
        "--set",
        "planners=[\"random\"]",
    ];
    run(&[&["run", "bird", "--no-report"], &few[..]].concat());
    assert!(folder.path().join("runs/bird/trials.jsonl").is_file());
    for path in ["paper/bird-10", "experiments/paper/bird-10.toml"] {
        run(&["run", path, "--plan", "2"]);
    }
    let files = run(&["list", "files"]);
    let baseline = "experiments/baselines/toy.jsonl";
    let submit = "experiments/slurm/submit.sh";
    assert!([baseline, submit].iter().all(|name| files.lines().any(|line| line.trim() == *name)));
    assert!(!listed.contains(submit), "{listed}");
    fs::create_dir_all(folder.path().join("experiments/baselines")).unwrap();
    fs::write(folder.path().join(baseline), "mine").unwrap();
    let said = run(&["list", "--copy", "experiments/baselines", "--copy", submit]);
    assert!(said.contains(&format!("{baseline} exists and is kept")), "{said}");
    assert_eq!(fs::read_to_string(folder.path().join(baseline)).unwrap(), "mine");
    for name in [submit, "experiments/baselines/bird.jsonl"] {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let copied = fs::read(folder.path().join(name)).unwrap();
        assert_eq!(copied, fs::read(source).unwrap(), "{name}");
    }
    fails(folder.path(), &["list", "--copy", "experiments/none"], &["palpate list files"]);
    run(&["new", "models/suite/mug.glb"]);
    assert!(run(&["show", "mug-scene.toml"]).contains("mug.glb"));
    assert_eq!(homes().count(), 1, "nothing else is written");
}

/// An option that is named like a setting is answered with the `--set` that changes it.
#[test]
fn a_setting_given_as_an_option_is_answered_with_its_assignment() {
    let folder = folder();
    let cases: [(&[&str], &str); 6] = [
        (&["run", "small.toml", "--trials", "24"], "`--set trials=24`"),
        (&["run", "small.toml", "--touches=9"], "`--set touches=9`"),
        (&["run", "small.toml", "--initial-touches"], "`--set initial_touches=VALUE`"),
        (&["check", "toy", "--seed", "7", "--baseline", "x"], "`--set seed=7`"),
        (&["run", "small.toml", "--planners", "[\"active\"]"], "`--set 'planners=[\"active\"]'`"),
        (&["run", "small.toml", "--gp.noise", "[1e-4, 1]"], "`--set 'gp.noise=[1e-4, 1]'`"),
    ];
    for (arguments, says) in cases {
        let message = stderr(&palpate(folder.path(), arguments));
        assert!(message.contains(says) && !message.contains("similar"), "{message}");
    }
    // Other unknown options keep their own tips; a table is no setting; a command may have none.
    for arguments in [
        &["run", "small.toml", "--thread", "2"][..],
        &["run", "small.toml", "--gp", "2"],
        &["list", "--trials", "2"],
    ] {
        let message = stderr(&palpate(folder.path(), arguments));
        assert!(message.contains("unexpected argument"), "{message}");
        assert!(!message.contains("--set"), "{message}");
    }
}

/// A plain name of a scene in an experiment is that of a file beside it, or else of a shipped
/// scene.
#[test]
fn an_experiment_finds_a_shipped_scene_by_name() {
    let (folder, home) = (folder(), tempfile::tempdir().unwrap());
    let text = fs::read_to_string(folder.path().join("small.toml")).unwrap();
    let by_name = text.replace("\"scene.toml\"", "\"pebble\"");
    assert_ne!(by_name, text);
    let load = |text: &str, sets: &[&str]| {
        let file = folder.path().join("small.toml");
        let loader = Loader::from_text(&file, text.into()).unwrap().with_home(home.path());
        let sets: Vec<String> = sets.iter().map(|&set| set.into()).collect();
        Experiment::from_loader(loader, &sets).map_err(|error| error.to_string())
    };
    fs::create_dir(home.path().join("scenes")).unwrap();
    for name in ["mesh.obj", "scene.toml"] {
        fs::copy(folder.path().join(name), home.path().join("scenes").join(name)).unwrap();
    }
    let shipped = home.path().join("scenes/pebble.toml");
    fs::rename(home.path().join("scenes/scene.toml"), &shipped).unwrap();
    let found = load(&by_name, &[]).unwrap();
    assert_eq!(
        found.scene.object.as_ref().unwrap().mesh,
        home.path().join("scenes/mesh.obj").into()
    );
    assert_eq!(load(&text, &["scene=pebble"]).unwrap(), found);
    let edited = load(&by_name, &["scene.finger.radius_m=0.004"]).unwrap();
    assert_eq!(edited.scene.finger.radius_m, 0.004);
    let error = load(&text.replace("scene.toml", "peble"), &[]).unwrap_err();
    for words in ["small.toml:", "`scene` = \"peble\"", "did you mean `pebble`?", "scenes/"] {
        assert!(error.contains(words), "{error}");
    }
    // The file beside the experiment is preferred.
    fs::copy(folder.path().join("scene.toml"), folder.path().join("pebble")).unwrap();
    let beside = load(&by_name, &[]).unwrap();
    assert_eq!(beside.scene.object.unwrap().mesh, folder.path().join("mesh.obj").into());
}

#[test]
fn the_help_lists_each_command_once_in_its_group() {
    let folder = folder();
    let help = succeeds(folder.path(), &["--help"]);
    for (group, name) in [("Explore:", "  export "), ("Robot:", "  serve "), ("More:", "  list ")] {
        assert!(help.find(group) < help.find(name), "{help}");
        assert_eq!(help.matches(&format!("\n{name}")).count(), 1, "{help}");
    }
    assert!(!help.contains("\n  merge ") && help.contains("--quiet"), "{help}");
}

#[test]
fn shells_are_told_how_to_complete() {
    for shell in ["bash", "zsh", "fish"] {
        let script = succeeds(Path::new("."), &["--completions", shell]);
        assert!(script.contains("accuracy") && script.contains("no-report"), "{shell}");
    }
}

/// Options that apply to one kind of input are refused with another.
#[test]
fn options_of_another_input_are_refused() {
    let folder = folder();
    let with = "cannot be used with";
    for (arguments, words) in [
        (&["export", "--topic", "/view"][..], "--out"),
        (&["export", "runs/small", "--topic", "/view", "--out", "view.ply"], with),
        (&["export", "--topic", "/view", "--out", "view.ply", "--grid", "3"], with),
        (&["export", "--topic", "/view", "--out", "view.obj"], "ending in .ply"),
        (&["export", "runs/small", "--domain", "3", "--out", "it.ply"], with),
        (&["compare", "runs/small", "--threads", "2"], "--sensors"),
        (&["compare", "toy", "--sensors", "biotac", "--svg", "it.svg"], with),
        (&["compare", "toy", "--sensors", "biotac,skin"], "gelsight_mini"),
        (&["list", "planners", "--reference"], with),
        (&["list", "planners", "--copy", "models"], with),
        (&["--completions", "bash", "list"], "--completions"),
        (&["--quiet"], "--help"),
    ] {
        fails(folder.path(), arguments, &[words]);
    }
}

#[test]
fn a_summary_is_told_to_programs() {
    let folder = folder();
    let text = succeeds(folder.path(), &["run", "small.toml", "--no-report", "--json"]);
    let values: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&values["name"], &values["trials"]), (&"small".into(), &1.into()));
    let line = &values["summary"][0];
    assert_eq!((&line["planner"], &line["touches"]), (&"random".into(), &3.into()));
    let csv = fs::read_to_string(folder.path().join("runs/small/summary.csv")).unwrap();
    let columns = csv.lines().next().unwrap().split(',').skip(3);
    let last = csv.lines().last().unwrap().split(',').skip(3);
    for (column, cell) in columns.zip(last) {
        assert_eq!(line["measures"][column].as_f64(), cell.parse().ok(), "{column}");
    }
    let shown = succeeds(folder.path(), &["show", "runs/small", "--json"]);
    assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), values);
}

/// Progress appears only for slow work, and not with --quiet.
#[test]
fn short_work_says_nothing_beside_its_result() {
    let folder = folder();
    let output = palpate(folder.path(), &["run", "small.toml", "--no-report"]);
    assert!(output.status.success() && !stderr(&output).contains("left"), "{}", stderr(&output));
}

#[test]
fn errors_are_coloured_where_that_is_asked_for_only() {
    let folder = folder();
    let plain = stderr(&palpate(folder.path(), &["run", "none.toml"]));
    assert!(plain.starts_with("error: ") && !plain.contains('\u{1b}'), "{plain}");
    let mut coloured = command(folder.path(), &["run", "none.toml"]);
    let coloured = stderr(&run_to_end(coloured.env("CLICOLOR_FORCE", "1"), "coloured"));
    assert!(coloured.contains("\u{1b}[") && coloured.contains("error:"), "{coloured}");
}

#[test]
fn files_of_others_are_replaced_by_force_only() {
    let folder = folder();
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let scene = read("scene.toml");
    fs::write(folder.path().join("zone.svg"), "a drawing").unwrap();
    for (option, file) in [
        ("--mjcf", "scene.toml"),
        ("--picture", "zone.svg"),
        ("--mjcf", "mesh.obj"),
        ("--render", "small.toml"),
    ] {
        let before = read(file);
        let says = [file, "--force"];
        fails(folder.path(), &["show", "scene.toml", option, file], &says);
        assert_eq!(read(file), before, "{option} {file}");
    }
    for special in ["/dev/null", "/dev/full", "."] {
        for force in [&[][..], &["--force"]] {
            let arguments = [&["show", "scene.toml", "--mjcf", special], force].concat();
            fails(folder.path(), &arguments, &["a folder, a device or a pipe"]);
        }
    }
    fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    let says = ["no cloud.ply", "--force"];
    fails(folder.path(), &["export", "scene.toml", "--grid", "3x3", "--out", "."], &says);
    // Palpate's own files are replaced.
    for _ in 0..2 {
        succeeds(folder.path(), &["export", "scene.toml", "--grid", "3x3", "--out", "new"]);
        succeeds(folder.path(), &["show", "scene.toml", "--mjcf", "scene.xml"]);
    }
    succeeds(folder.path(), &["show", "scene.toml", "--mjcf", "notes.txt", "--force"]);
    assert!(read("notes.txt").contains("<mujoco"));
    assert_eq!(read("scene.toml"), scene);
}

#[test]
fn an_exported_belief_replaces_its_own_files_only() {
    let folder = folder();
    succeeds(folder.path(), &["run", "small.toml", "--no-report"]);
    let export = ["export", "runs/small", "--planner", "random", "--out", "it.ply"];
    fs::write(folder.path().join("it.svg"), "mine").unwrap();
    fails(folder.path(), &export, &["it.svg exists", "--force"]);
    assert!(!folder.path().join("it.ply").exists());
    succeeds(folder.path(), &[&export[..], &["--force"]].concat());
    succeeds(folder.path(), &export);
    let onto_mesh = ["export", "runs/small", "--planner", "random", "--out", "mesh.obj"];
    fails(folder.path(), &onto_mesh, &["mesh.obj exists", "--force"]);
}

/// The doctor names every part; invalid ROS variables are wrong, with the allowed values.
#[test]
fn the_doctor_reports_every_part() {
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut program = command(home, &["doctor"]);
    program.env_remove("ROS_DOMAIN_ID").env_remove("ROS_LOCALHOST_ONLY");
    let output = run_to_end(&mut program, "doctor");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in ["palpate", "MuJoCo", "machine", "shipped files", "working folder", "EGL", "clock"]
    {
        assert!(text.lines().any(|line| line[8..].starts_with(part)), "{part} in {text}");
    }
    assert!(output.status.success() && text.contains("experiments, "), "{text}");
    if cfg!(feature = "ros2") {
        let mut program = command(home, &["doctor"]);
        program.env("ROS_DOMAIN_ID", "999");
        let output = run_to_end(&mut program, "doctor");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains("WRONG") && text.contains("allowed are 0 to"), "{text}");
        assert_eq!(output.status.code(), Some(1));
        let mut program = command(home, &["doctor"]);
        program.env("ROS_STATIC_PEERS", "10.0.0.7");
        let output = run_to_end(&mut program, "doctor");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains("ROS_STATIC_PEERS is \"10.0.0.7\": Palpate finds"), "{text}");
    }
}
