//! The same bytes for any number of threads, after a kill, and after an interrupt.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

fn start(out: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["run", "experiments/toy.toml", "--set", "trials=20", "--no-report"])
        .args(["--set", "touches=35"])
        .arg("--out")
        .arg(out)
        .args(if arguments.contains(&"--threads") { &[][..] } else { &["--threads", "2"] })
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn finish(out: &Path, arguments: &[&str]) -> Vec<u8> {
    assert!(start(out, arguments).wait().unwrap().success());
    fs::read(trials(out)).unwrap()
}

fn trials(out: &Path) -> PathBuf {
    out.join("trials.jsonl")
}

/// Waits until the run has written some of its rows; false if it ended before.
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

#[test]
fn a_killed_run_resumes_to_the_same_bytes() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("killed");
    let mut child = start(&out, &[]);
    assert!(half_way(&out, &mut child), "finished before it could be killed");
    child.kill().unwrap();
    child.wait().unwrap();
    // As if the kill had come in the middle of a write.
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
