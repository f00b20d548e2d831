//! Tests of run folders after crashes or full disks: the same command resumes or restarts the run,
//! and files of other programs are never changed.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::common::program::{command, fails, folder, stderr, succeeds};
use palpate::experiment::row::TouchRow;
use palpate::experiment::store::{Journal, JournalEntry};

/// Number of kills; `PALPATE_FUZZ` sets more.
const KILLS: u64 = 100;

/// Number of runs killed in parallel.
const WORKERS: u64 = 4;

fn begun(folder: &Path, out: &Path, more: &[&str]) -> Command {
    let mut command = command(folder, &["run", "small.toml", "--threads", "1"]);
    command.args(["--set", "trials=4", "--out"]).arg(out).args(more);
    command
}

fn run(folder: &Path, out: &Path, more: &[&str]) -> Output {
    begun(folder, out, more).output().unwrap()
}

/// Kills a run once or twice and resumes it.
fn kill_and_resume(folder: &Path, kill: u64, longest: Duration, whole: &[u8]) {
    let out = folder.join(format!("killed-{kill}"));
    let mut random = ChaCha8Rng::seed_from_u64(kill);
    for again in 0..=kill % 2 {
        let fresh: &[&str] = if again == 1 && kill % 4 == 3 { &["--fresh"] } else { &[] };
        let mut command = begun(folder, &out, &[fresh, &["--no-report"]].concat());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        sleep(longest.mul_f64(random.random()));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let fresh: &[&str] = if kill % 10 == 9 { &["--fresh"] } else { &[] };
    let resumed = run(folder, &out, &[fresh, &["--no-report"]].concat());
    let left = || fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name());
    assert!(
        resumed.status.success(),
        "{kill}: {} {:?}",
        stderr(&resumed),
        left().collect::<Vec<_>>()
    );
    assert!(fs::read(out.join("trials.jsonl")).unwrap() == whole, "{kill}");
    fs::remove_dir_all(&out).unwrap();
}

#[track_caller]
fn assert_ok(output: &Output) {
    assert!(output.status.success(), "{}", stderr(output));
}

#[test]
fn kills_at_random_moments_of_the_first_second_all_resume() {
    let folder = folder();
    let folder = folder.path();
    let started = Instant::now();
    assert!(run(folder, &folder.join("whole"), &["--no-report"]).status.success());
    // A shorter run is killed at any time of its life.
    let longest = started.elapsed().min(Duration::from_secs(1));
    let whole = fs::read(folder.join("whole/trials.jsonl")).unwrap();
    let asked =
        std::env::var("PALPATE_FUZZ").map_or(0, |count| count.parse::<u64>().unwrap() / 100);
    let kills = asked.max(KILLS);
    std::thread::scope(|scope| {
        for worker in 0..WORKERS {
            let kills = (worker..kills).step_by(WORKERS as usize);
            let whole = &whole;
            scope.spawn(move || {
                kills.for_each(|kill| kill_and_resume(folder, kill, longest, whole))
            });
        }
    });
}

/// Folder contents after a crash: files and their first bytes.
type Left = &'static [(&'static str, &'static [u8])];

const BEGINNINGS: [Left; 8] = [
    &[],
    &[("trials.jsonl", b"")],
    &[("trials.jsonl", b""), ("resolved.toml.part", b"")],
    &[("trials.jsonl", b""), ("resolved.toml.part", b"# Every setting of th")],
    &[("trials.jsonl", b""), ("resolved.toml", b"")],
    &[("trials.jsonl", b"{\"trial\":0,\"pla"), ("resolved.toml", b"RESOLVED")],
    &[("trials.jsonl", b""), ("resolved.toml", b"RESOLVED"), ("surface.csv.part", b"x_m,z")],
    &[("trials.jsonl", b""), ("resolved.toml", b"RESOLVED"), ("surface.csv", b"SURFACE")],
];

#[test]
fn every_beginning_that_a_crash_leaves_is_begun_anew() {
    let folder = folder();
    let whole = folder.path().join("whole");
    assert!(run(folder.path(), &whole, &["--no-report"]).status.success());
    let other = folder.path().join("other");
    assert!(run(folder.path(), &other, &["--set", "seed=1", "--no-report"]).status.success());
    let rows = fs::read(whole.join("trials.jsonl")).unwrap();
    for (i, beginning) in BEGINNINGS.iter().enumerate() {
        // A started run without rows may be replaced by another experiment.
        for begun in [&whole, &other] {
            for fresh in [&["--no-report"][..], &["--no-report", "--fresh"]] {
                let out = TempDir::new_in(folder.path()).unwrap();
                for (name, bytes) in *beginning {
                    let bytes = match *bytes {
                        b"RESOLVED" => fs::read(begun.join("resolved.toml")).unwrap(),
                        b"SURFACE" => fs::read(begun.join("surface.csv")).unwrap(),
                        bytes => bytes.to_vec(),
                    };
                    fs::write(out.path().join(name), bytes).unwrap();
                }
                let output = run(folder.path(), out.path(), fresh);
                assert!(output.status.success(), "{i} {fresh:?}: {}", stderr(&output));
                assert!(fs::read(out.path().join("trials.jsonl")).unwrap() == rows, "{i}");
            }
        }
    }
    // With rows it is kept: only --fresh deletes another run's rows.
    let refused = run(folder.path(), &other, &[]);
    assert!(stderr(&refused).contains("contains another experiment"), "{}", stderr(&refused));
}

#[test]
fn what_others_put_into_a_folder_is_not_touched() {
    let folder = folder();
    let foreign: [&[(&str, &str)]; 7] = [
        &[("notes.txt", "mine")],
        &[("resolved.toml", "mine = 1\n")],
        &[("resolved.toml", "mine = 1\n"), ("trials.jsonl", "")],
        &[("resolved.toml.part", "half"), ("notes.txt", "mine")],
        &[("trials.jsonl", "mine\n")],
        &[("trials.jsonl", ""), ("surface.csv", "mine\n")],
        &[("figures", "mine")],
    ];
    for (i, files) in foreign.iter().enumerate() {
        let out = folder.path().join(format!("foreign-{i}"));
        fs::create_dir(&out).unwrap();
        for (name, text) in *files {
            fs::write(out.join(name), text).unwrap();
        }
        let out_name = out.to_str().unwrap();
        for fresh in [&[][..], &["--fresh"]] {
            let arguments = [&["run", "small.toml", "--out", out_name], fresh].concat();
            fails(folder.path(), &arguments, &["this folder contains other files", "--out"]);
        }
        assert_eq!(fs::read_dir(&out).unwrap().count(), files.len(), "{i}");
        for (name, text) in *files {
            assert_eq!(fs::read_to_string(out.join(name)).unwrap(), *text, "{i}: {name}");
        }
    }
    // Other files beside a run's own files are kept in any case.
    succeeds(folder.path(), &["run", "small.toml", "--no-report"]);
    fs::write(folder.path().join("runs/small/notes.txt"), "mine").unwrap();
    succeeds(folder.path(), &["run", "small.toml", "--no-report", "--fresh", "--set", "seed=3"]);
    assert_eq!(fs::read_to_string(folder.path().join("runs/small/notes.txt")).unwrap(), "mine");
}

/// A finished touch is in the journal at once and is read when it is opened again.
#[test]
fn a_journal_has_the_touches_that_were_added() {
    let folder = TempDir::new().unwrap();
    let row = r#"{"target":{"place":[0.1,0.2]},"outcome":{"end":"miss"}}"#;
    let touch: TouchRow = serde_json::from_str(row).unwrap();
    let entry = |trial| JournalEntry {
        time_unix_s: 1.0,
        trial,
        planner: "active".into(),
        touch: Some(touch.clone()),
        fault: None,
    };
    let mut journal = Journal::open(folder.path()).unwrap();
    for trial in [0, 0, 1] {
        journal.add(entry(trial)).unwrap();
    }
    assert_eq!(journal.touches(0, "active").len(), 2);
    let fault = JournalEntry { touch: None, fault: Some("no".into()), ..entry(0) };
    journal.add(fault).unwrap();
    let again = Journal::open(folder.path()).unwrap();
    for journal in [journal, again] {
        assert_eq!(journal.touches(0, "active").len(), 2);
        assert_eq!(journal.touches(1, "active").len(), 1);
        assert!(journal.touches(0, "random").is_empty());
        assert_eq!(journal.halt_reason(), Some("no"));
    }
}

/// A run that was moved to another user is reported and continued there, and shards of two users
/// merge: only the contents of input files count, not their paths.
#[test]
fn a_run_folder_moves_to_another_user() {
    let users = [folder(), folder()];
    let homes = [TempDir::new().unwrap(), TempDir::new().unwrap()];
    let at = |user: usize, name: &str| users[user].path().join(name);
    let palpate = |user: usize, arguments: &[&str]| {
        let mut command = command(users[user].path(), arguments);
        command.env("PALPATE_HOME", homes[user].path());
        command.output().unwrap()
    };
    // The mesh is one of the shipped files of each user.
    for (user, home) in homes.iter().enumerate() {
        fs::create_dir(home.path().join("models")).unwrap();
        fs::rename(at(user, "mesh.obj"), home.path().join("models/mesh.obj")).unwrap();
        let scene = fs::read_to_string(at(user, "scene.toml")).unwrap();
        let scene = scene.replace("mesh.obj", "models/mesh.obj") + "datum_y_m = 0.5\n";
        fs::write(at(user, "scene.toml"), scene).unwrap();
    }
    let run = |user: usize, more: &[&str]| {
        let run = ["run", "small.toml", "--set", "trials=4", "--no-report"];
        palpate(user, &[&run, more].concat())
    };
    assert_ok(&run(0, &["--out", "whole"]));
    assert_ok(&run(0, &["--out", "first", "--shard", "1/2"]));
    assert_ok(&run(1, &["--out", "second", "--shard", "2/2"]));
    let resolved = fs::read_to_string(at(0, "first/resolved.toml")).unwrap();
    assert!(resolved.contains("mesh = \"models/mesh.obj\""), "{resolved}");
    for (file, text) in fs::read_dir(at(0, "first")).unwrap().map(|entry| {
        let path = entry.unwrap().path();
        (path.clone(), String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned())
    }) {
        let home = homes[0].path().to_string_lossy();
        assert!(!text.contains(&*home), "{}: {text}", file.display());
    }

    fs::rename(at(0, "first"), at(1, "first")).unwrap();
    assert_ok(&palpate(1, &["report", "merged", "--merge", "first", "second"]));
    let rows = |user: usize, run: &str| fs::read(at(user, run).join("trials.jsonl")).unwrap();
    assert!(rows(1, "merged") == rows(0, "whole"));
    assert_ok(&palpate(1, &["report", "first"]));
    assert_ok(&run(1, &["--out", "first"]));
    assert!(rows(1, "first") == rows(0, "whole"));

    // Another mesh of the same name is another experiment.
    let mesh = homes[1].path().join("models/mesh.obj");
    fs::write(&mesh, fs::read_to_string(&mesh).unwrap().replace("v 0 0 1", "v 0 0 2")).unwrap();
    let refused = run(1, &["--out", "first"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("scene.object.mesh"), "{}", stderr(&refused));
}

/// A file system without locks is named, with a remedy; nothing is written.
#[test]
fn a_file_system_without_locks_is_refused_with_a_remedy() {
    let folder = folder();
    let source = folder.path().join("lockless.c");
    fs::write(
        &source,
        "#include <errno.h>\nint flock(int f, int o) { errno = ENOLCK; return -1; }\n",
    )
    .unwrap();
    let library = folder.path().join("lockless.so");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-o"]).args([&library, &source]);
    assert!(compiler.status().unwrap().success());
    let mut command = begun(folder.path(), &folder.path().join("out"), &[]);
    let refused = command.env("LD_PRELOAD", &library).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    let message = stderr(&refused);
    assert!(message.contains("no file locks") && message.contains("--out"), "{message}");
    assert_eq!(fs::read(folder.path().join("out/trials.jsonl")).unwrap(), b"");
}
