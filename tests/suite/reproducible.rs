//! Tests of reproducibility: the same bytes for any number of threads, after a kill, after an
//! interrupt, and for any order of added trials and planners; report settings change no row.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

fn command(out: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    command
        .args(["run", "experiments/toy.toml", "--set", "trials=20", "--no-report"])
        .args(["--set", "touches=35"])
        .arg("--out")
        .arg(out)
        .args(if arguments.contains(&"--threads") { &[][..] } else { &["--threads", "2"] })
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

fn start(out: &Path, arguments: &[&str]) -> Child {
    command(out, arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn finish(out: &Path, arguments: &[&str]) -> Vec<u8> {
    assert!(start(out, arguments).wait().unwrap().success());
    fs::read(trials(out)).unwrap()
}

/// Returns the output of a complete run.
fn output(out: &Path, arguments: &[&str]) -> String {
    let output = command(out, arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn trials(out: &Path) -> PathBuf {
    out.join("trials.jsonl")
}

/// Waits until the run has written some of its rows; returns false if it ended before.
fn half_way(out: &Path, child: &mut Child) -> bool {
    let patience = Instant::now() + Duration::from_secs(60);
    loop {
        let rows = fs::read(trials(out)).unwrap_or_default();
        if rows.iter().filter(|&&byte| byte == b'\n').count() >= 6 {
            return child.try_wait().unwrap().is_none();
        }
        assert!(Instant::now() < patience, "no rows in a minute");
        sleep(Duration::from_millis(2));
    }
}

#[test]
fn threads_do_not_change_a_byte() {
    let folder = TempDir::new().unwrap();
    let one = finish(&folder.path().join("one"), &["--threads", "1"]);
    let two = finish(&folder.path().join("two"), &[]);
    assert!(one == two);
    assert_eq!(one.iter().filter(|&&byte| byte == b'\n').count(), 60);
}

/// Maximum number of threads of a run on a machine that reports 40 cores to rayon.
fn most_threads(out: &Path, threads: &str) -> usize {
    let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["run", "experiments/container.toml", "--set", "trials=2", "--no-report"])
        .args(["--threads", threads, "--out"])
        .arg(out)
        .env("RAYON_NUM_THREADS", "40")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let tasks = format!("/proc/{}/task", child.id());
    let mut most = 0;
    while child.try_wait().unwrap().is_none() {
        most = most.max(fs::read_dir(&tasks).map_or(0, Iterator::count));
        sleep(Duration::from_millis(1));
    }
    assert!(child.wait().unwrap().success());
    most
}

/// Besides the worker there are the main thread, a thread that waits for the worker, and threads
/// for Ctrl-C and slow steps.
#[test]
fn threads_bound_what_comes_before_the_trials_too() {
    let folder = TempDir::new().unwrap();
    let all = most_threads(&folder.path().join("all"), "0");
    assert!(all > 40, "{all}");
    let one = most_threads(&folder.path().join("one"), "1");
    assert!(one <= 6, "{one}");
}

#[test]
fn a_killed_run_resumes_to_the_same_bytes() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("killed");
    let mut child = start(&out, &[]);
    assert!(half_way(&out, &mut child), "finished before it could be killed");
    child.kill().unwrap();
    child.wait().unwrap();
    // As after a kill in the middle of a write.
    let mut cut = fs::read(trials(&out)).unwrap();
    cut.extend_from_slice(b"{\"trial\":11,\"planner\":\"act");
    fs::write(trials(&out), cut).unwrap();
    let resumed = finish(&out, &[]);
    assert!(resumed == finish(&folder.path().join("whole"), &[]));
    assert!(resumed == finish(&out, &[]), "a finished run stays as it is");
}

#[test]
#[cfg(unix)]
fn an_interrupt_keeps_what_is_done_and_the_same_command_continues() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("interrupted");
    let mut child = start(&out, &[]);
    assert!(half_way(&out, &mut child), "finished before it could be interrupted");
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupt.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let kept = fs::read(trials(&out)).unwrap();
    assert!(kept.iter().filter(|&&byte| byte == b'\n').count() >= 6);
    assert!(finish(&out, &[]) == finish(&folder.path().join("whole"), &[]));
}

#[test]
fn the_resolved_settings_are_the_run() {
    let folder = TempDir::new().unwrap();
    let first = finish(&folder.path().join("first"), &["--set", "trials=2"]);
    let resolved = folder.path().join("first/resolved.toml");
    let again = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .arg("run")
        .arg(&resolved)
        .arg("--no-report")
        .arg("--out")
        .arg(folder.path().join("again"))
        .output()
        .unwrap();
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    assert!(first == fs::read(folder.path().join("again/trials.jsonl")).unwrap());
    let twin = fs::read(folder.path().join("again/resolved.toml")).unwrap();
    assert!(fs::read(resolved).unwrap() == twin);
}

#[test]
fn trials_and_planners_added_later_give_the_bytes_of_a_run_at_once() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("grown");
    let few = ["--set", "trials=2", "--set", "planners=[\"random\"]"];
    let more = ["--set", "trials=5", "--set", "planners=[\"random\"]"];
    let all = ["--set", "trials=5", "--set", "planners=[\"active\", \"random\", \"sobol\"]"];
    let begun = finish(&out, &few);
    assert_eq!(begun.iter().filter(|&&byte| byte == b'\n').count(), 2);
    finish(&out, &more);
    let grown = finish(&out, &all);
    assert!(grown == finish(&folder.path().join("whole"), &all));
    let resolved = |run: &str| fs::read(folder.path().join(run).join("resolved.toml")).unwrap();
    assert!(resolved("grown") == resolved("whole"));
    // Unlisted trials are kept but not shown, and appear when listed again.
    for fewer in [&few, &more] {
        assert!(finish(&out, fewer) == grown);
    }
    let summary = fs::read_to_string(out.join("summary.csv")).unwrap();
    assert!(!summary.contains("active") && summary.contains("\nrandom,35,5,"), "{summary}");
    let again = output(&out, &all);
    assert!(again.contains("\n0 trials in ") && again.contains("15 already done"), "{again}");
    assert!(fs::read(trials(&out)).unwrap() == grown);
}

#[test]
fn what_is_shown_changes_without_a_trial() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("shown");
    let two = ["--set", "trials=2"];
    finish(&out, &two);
    let read = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    let state = || (read("trials.jsonl"), fs::metadata(trials(&out)).unwrap().modified().unwrap());
    let (rows, resolved, manifest) = (state(), read("resolved.toml"), read("manifest.json"));
    let again = output(&out, &[&two[..], &["--set", "report.trial=1"]].concat());
    assert!(again.contains("\n0 trials in "), "{again}");
    assert!(read("resolved.toml").contains("\ntrial = 1\n"));
    let drawn = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["report", "--set", "report.baselines=[\"sobol\"]", "--set", "question=Why?"])
        .arg(&out)
        .output()
        .unwrap();
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    let set = read("resolved.toml");
    for line in ["question = \"Why?\"", "trial = 1", "baselines = [\"sobol\"]"] {
        assert!(set.lines().any(|found| found == line), "{line}: {set}");
    }
    assert!(read("report.html").contains("<p class=\"question\">Why?</p>"));
    let comparison = read("comparison.csv");
    assert!(comparison.lines().skip(1).all(|line| line.split(',').nth(1) == Some("sobol")));
    assert!(comparison.contains("active,sobol,rmse_m,2,"), "{comparison}");
    finish(&out, &two);
    assert_eq!(read("resolved.toml"), resolved);
    assert!(state() == rows && read("manifest.json") == manifest);
}
