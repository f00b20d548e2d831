//! Tests of the command lines in the guides: each runs here with fewer trials and touches, or is
//! named below with the test that runs it.

use crate::common::shapes::sphere_mesh;
use nalgebra::Point3;
use std::fmt::Write;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// Starts of command lines that run elsewhere, and where.
const ELSEWHERE: [(&str, &str); 19] = [
    ("git clone", "continuous integration, in a clean checkout"),
    ("make ", "targets of the Makefile, tested below"),
    ("cargo ", "continuous integration; examples in `make test`"),
    ("pip install", "make test PART=python"),
    ("pytest ", "make test PART=python"),
    ("python ", "make test PART=python"),
    ("cd python", "make test PART=python"),
    ("cp .deps", "only after cargo install"),
    ("tar ", "make dist"),
    ("./palpate", "make dist"),
    ("PALPATE=palpate experiments/slurm", "tests/clusters/test.sh"),
    ("parallel ", "tests/clusters/test.sh"),
    ("export ROS_LOCALHOST_ONLY", "tests/ros2/namespace.sh"),
    ("palpate accuracy", "accuracy:: and relevance::, on small scenes"),
    ("palpate serve", "lab::the_loop, over ROS 2"),
    ("palpate live", "live::, and make test PART=live in a browser"),
    ("palpate run real_arm", "lab::the_loop, over ROS 2"),
    ("palpate run real_ur5e", "lab_ur::, over ROS 2"),
    ("palpate register real_arm", "needs a robot, or the simulated one in real time"),
];

/// Parts of command lines that run elsewhere, and where.
const ELSEWHERE_PARTS: [(&str, &str); 4] = [
    ("--planner my_", "make test PART=python"),
    ("--planner policy:", "make test PART=python"),
    ("--watch", "needs a display"),
    ("register experiments/real_arm.toml", "needs a robot, or the simulated one in real time"),
];

/// Stand-in for `palpate` that reduces the work of a command.
const REDUCED: &str = r#"#!/bin/bash
set -e
first=() last=()
case "$1" in
run) first=(--set touches=21) last=(--set trials=4 --set grid=9 --no-report)
    case "$*" in *suite*|*camera*|*strokes*|*pa10*|*arm/*) last=(--set trials=1 --set grid=9 --no-report) ;; esac
    case "$*" in *suite/six*) first=(--set touches=10) ;; esac
    case "$*" in *suite_library*) first=(--set touches=2 --set recognition.particles=16) ;; esac
    case "$*" in *--plan*) set -- run bird --plan 2 --threads 2; last=(--set trials=4) ;; esac ;;
check) last=(--max-trials 4) ;;
export) case "$*" in *--grid*|*runs/*) ;; *) last=(--grid 9x9) ;; esac ;;
esac
# Tests in real time run beside it.
exec nice -n 19 "$PROGRAM" --quiet "$1" "${first[@]}" "${@:2}" "${last[@]}"
"#;

/// Runs that the commands of a page read.
const EARLIER: [(&str, &str); 3] = [
    ("install.md", "mkdir -p ~/.local/share/bash-completion/completions"),
    (
        "results.md",
        "palpate run toy; palpate run container; palpate run bird --set touches=60; \
         cp -r runs/bird runs/bird-before",
    ),
    (
        "many-runs.md",
        "palpate run experiments/suite/six.toml --set 'planners=[\"active\",\"random\"]'; \
         for i in 1 2 3 4 5 6 7 8; do palpate run bird --shard $i/8 --set trials=8; done; \
         rm -rf runs/bird",
    ),
];

/// Command lines in the code blocks of a page, continued lines joined.
fn commands(page: &str) -> Vec<String> {
    let mut commands = Vec::new();
    for block in page.split("```").skip(1).step_by(2) {
        let Some(text) = block.strip_prefix("bash\n").or(block.strip_prefix("sh\n")) else {
            continue;
        };
        let text = text.replace("\\\n", " ");
        commands.extend(text.lines().map(|line| line.trim().to_owned()));
    }
    // Rows of tables may have a command in backticks.
    for row in page.lines().filter(|line| line.starts_with('|')) {
        let code = row.split('`').skip(1).step_by(2).filter(|code| code.starts_with("palpate "));
        commands.extend(
            code.filter(|code| page.starts_with("# Palpate") && code.contains(' '))
                .map(str::to_owned),
        );
    }
    commands.retain(|line| !line.is_empty());
    commands
}

fn runs_elsewhere(command: &str) -> bool {
    ELSEWHERE.iter().any(|(start, _)| command.starts_with(start))
        || ELSEWHERE_PARTS.iter().any(|(part, _)| command.contains(part))
}

/// A folder with nothing but the reduced program in `bin`, as after an installation.
fn empty_folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::create_dir(folder.path().join("bin")).unwrap();
    let program = folder.path().join("bin/palpate");
    fs::write(&program, REDUCED).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

/// A page that lists planners lists all of them.
#[test]
fn every_planner_is_in_the_guide() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/your-planner.md");
    let page = fs::read_to_string(page).unwrap();
    for entry in palpate::explore::planner::PLANNERS {
        assert!(page.contains(&format!("`{}`", entry.name)), "{}", entry.name);
    }
}

#[test]
fn command_lines_of_the_guides_run() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let makefile = fs::read_to_string(root.join("Makefile")).unwrap();
    let pages = fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path());
    for page in pages.chain([root.join("README.md")]) {
        let name = page.file_name().unwrap().to_str().unwrap().to_owned();
        if !name.ends_with(".md") || ["reference.md", "hard-cases.md"].contains(&&*name) {
            continue;
        }
        let all = commands(&fs::read_to_string(&page).unwrap());
        for target in all.iter().filter_map(|line| line.strip_prefix("make ")) {
            let target = target.split([' ', '#', '&']).next().unwrap();
            assert!(makefile.contains(&format!("\n{target}:")), "{name}: make {target}");
        }
        let here: Vec<_> = all.iter().filter(|command| !runs_elsewhere(command)).collect();
        if here.is_empty() {
            continue;
        }
        let folder = empty_folder();
        let stl = fs::write(folder.path().join("my-part.stl"), egg());
        stl.and_then(|()| {
            fs::copy(root.join("models/suite/mug.glb"), folder.path().join("my-part.glb"))
        })
        .unwrap();
        let mut script = String::from("set -e\n");
        for (_, earlier) in EARLIER.iter().filter(|(of, _)| *of == name) {
            writeln!(script, "{earlier}").unwrap();
        }
        // Lines that write the same file again are alternatives.
        let again = |command: &str| match command.starts_with("palpate new") {
            true => "rm -f my-part*.toml; ",
            false => "",
        };
        here.iter().for_each(|line| {
            writeln!(script, "echo '+' {}\n{}{line}", quoted(line), again(line)).unwrap();
        });
        let path =
            format!("{}:{}", folder.path().join("bin").display(), std::env::var("PATH").unwrap());
        let output = Command::new("bash")
            .args(["-c", &script])
            .current_dir(folder.path())
            .env("PATH", path)
            .env("HOME", folder.path())
            .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
            .env("PROGRAM", env!("CARGO_BIN_EXE_palpate"))
            .output()
            .unwrap();
        let text =
            [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        assert!(output.status.success(), "{name}: {}\n{}", text[0], text[1]);
    }
}

/// An egg of 100 x 80 x 120 mm as STL.
fn egg() -> String {
    let sphere = sphere_mesh(Point3::origin(), 50.0, 16);
    let mut text = String::from("solid egg\n");
    for corners in sphere.iter_corners() {
        text += "facet normal 0 0 0\nouter loop\n";
        for p in corners {
            writeln!(text, "vertex {} {} {}", p.x, 0.8 * p.y, 1.2 * p.z).unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid egg\n"
}

/// Quotes a text for the shell.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}
