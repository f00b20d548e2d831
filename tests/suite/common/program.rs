//! The real program, and a folder of files that it can run.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

pub const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

pub const SCENE: &str = "simulator = \"swept\"

[object]
mesh = \"mesh.obj\"

[zone]
x_m = [0.1, 0.4]
z_m = [0.1, 0.4]
";

pub const EXPERIMENT: &str = "name = \"small\"
scene = \"scene.toml\"
planners = [\"random\"]
trials = 1
initial_touches = 2
touches = 3
grid = 5

[gp]
noise = [1e-4, 1e-2]

[report]
touch_counts = [3]
";

/// A folder with a valid mesh, scene and experiment.
pub fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, text) in [("mesh.obj", MESH), ("scene.toml", SCENE), ("small.toml", EXPERIMENT)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// Command `palpate` in a folder.
pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command
}

pub fn palpate(folder: &Path, arguments: &[&str]) -> Output {
    run_to_end(&mut command(folder, arguments), &arguments.join(" "))
}

/// Runs a program with short output; a program that does not end is killed and fails the test.
#[track_caller]
pub fn run_to_end(command: &mut Command, case: &str) -> Output {
    let mut child =
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let patience = Instant::now() + Duration::from_secs(60);
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > patience {
            let _ = child.kill();
            panic!("{case}: no end in a minute");
        }
        sleep(Duration::from_millis(1));
    }
    child.wait_with_output().unwrap()
}

/// Returns the stderr of a program without the names of slow steps, which depend on the machine.
pub fn stderr(output: &Output) -> String {
    let all = String::from_utf8_lossy(&output.stderr);
    let lines = all.lines().filter(|line| !line.ends_with(" ..."));
    lines.map(|line| format!("{line}\n")).collect()
}

/// Requires success; returns stdout.
#[track_caller]
pub fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let output = palpate(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {:?} {}", output.status, stderr(&output));
    String::from_utf8_lossy(&output.stdout).into()
}

/// Requires exit code 2 and an error that contains all of `says`.
#[track_caller]
pub fn fails(folder: &Path, arguments: &[&str], says: &[&str]) -> String {
    let output = palpate(folder, arguments);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(message.starts_with("error: "), "{arguments:?}: {message}");
    for word in says {
        assert!(message.contains(word), "{arguments:?}: no \"{word}\" in {message}");
    }
    message
}
