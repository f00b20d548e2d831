//! Fuzz tests with randomly altered files and settings: the program neither panics nor hangs, and
//! rejects invalid input with clear messages.
//!
//! `PROPTEST_RNG_SEED` selects the alterations, the same in each `make test` and others in each
//! `make test PART=fuzz`. `PALPATE_FUZZ` is the number of cases per target: the latter uses 100000,
//! a thousandth of them through the program itself.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use palpate::experiment::Experiment;
use palpate::experiment::analysis::Analysis;
use palpate::experiment::store::{Run, resolved};
use palpate::geometry::import::import;
use palpate::report::replay::BeliefReplay;
use palpate::report::{FIGURES, tables};
use palpate::sim::Scene;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use tempfile::TempDir;

use crate::common::program::{EXPERIMENT, SCENE, command, folder, run_to_end, stderr, succeeds};
use crate::formats;

/// Default number of cases per target.
const CASES: u32 = 300;

/// Time after which a case counts as a hang.
const PATIENCE: Duration = Duration::from_secs(60);

fn cases() -> u32 {
    std::env::var("PALPATE_FUZZ").map_or(CASES, |count| count.parse().expect("a number of cases"))
}

/// One alteration; positions are shares of the length.
#[derive(Clone, Debug)]
enum Edit {
    Set(f64, u8),
    Insert(f64, Vec<u8>),
    Remove(f64, usize),
    Repeat(f64, usize),
    Cut(f64),
    /// Replaces the number at or after a position.
    Number(f64, Vec<u8>),
    Line(f64, f64),
}

/// Values that often break parsers.
const WORDS: [&str; 36] = [
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "3",
    "255",
    "256",
    "65536",
    "4294967295",
    "4294967296",
    "-2147483649",
    "18446744073709551616",
    "1e999",
    "-1e999",
    "1e308",
    "-1e308",
    "1e-320",
    "1e30",
    "1e-30",
    "0.5",
    "nan",
    "inf",
    "null",
    "true",
    "\"\"",
    "\"\u{0}\"",
    "[]",
    "{}",
    "[[",
    "{\"a\":",
    "\u{feff}",
    "é",
    "\n",
    " ",
    "#",
];

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let place = || 0.0..1.0f64;
    let word = || {
        prop_oneof![
            4 => prop::sample::select(&WORDS[..]).prop_map(|word| word.as_bytes().to_vec()),
            1 => prop::collection::vec(any::<u8>(), 1..8),
        ]
    };
    let edit = prop_oneof![
        2 => (place(), any::<u8>()).prop_map(|(at, byte)| Edit::Set(at, byte)),
        2 => (place(), word()).prop_map(|(at, word)| Edit::Insert(at, word)),
        1 => (place(), 1..40usize).prop_map(|(at, count)| Edit::Remove(at, count)),
        1 => (place(), 1..40usize).prop_map(|(at, count)| Edit::Repeat(at, count)),
        1 => place().prop_map(Edit::Cut),
        4 => (place(), word()).prop_map(|(at, word)| Edit::Number(at, word)),
        1 => (place(), place()).prop_map(|(from, to)| Edit::Line(from, to)),
    ];
    prop::collection::vec(edit, 1..4)
}

fn altered(original: &[u8], edits: &[Edit]) -> Vec<u8> {
    let mut bytes = original.to_vec();
    for edit in edits {
        let length = bytes.len();
        let at = |share: f64| (share * length as f64) as usize;
        match edit {
            Edit::Set(place, byte) => {
                bytes.iter_mut().skip(at(*place)).take(1).for_each(|b| *b = *byte)
            }
            Edit::Insert(place, word) => {
                drop(bytes.splice(at(*place)..at(*place), word.iter().copied()))
            }
            Edit::Remove(place, count) => {
                drop(bytes.drain(at(*place)..(at(*place) + count).min(length)));
            }
            Edit::Repeat(place, count) => {
                let part = bytes[at(*place)..(at(*place) + count).min(length)].to_vec();
                drop(bytes.splice(at(*place)..at(*place), part));
            }
            Edit::Cut(place) => bytes.truncate(at(*place)),
            Edit::Number(place, word) => {
                let is_number = |byte: &u8| byte.is_ascii_digit() || b"+-.e".contains(byte);
                let Some(start) = bytes.iter().skip(at(*place)).position(u8::is_ascii_digit) else {
                    continue;
                };
                let start = start + at(*place);
                let count = bytes[start..].iter().take_while(|byte| is_number(byte)).count();
                drop(bytes.splice(start..start + count, word.iter().copied()));
            }
            Edit::Line(from, to) => {
                let mut lines: Vec<&[u8]> = bytes.split_inclusive(|&byte| byte == b'\n').collect();
                let count = lines.len() as f64;
                if count > 0.0 {
                    lines.swap((from * count) as usize, (to * count) as usize);
                }
                bytes = lines.concat();
            }
        }
    }
    bytes
}

/// Runs `try_out` on `count` values of `strategy`.
fn fuzz<S: Strategy>(strategy: S, count: u32, try_out: impl Fn(&S::Value) -> Result<(), String>) {
    let config = Config {
        cases: count,
        failure_persistence: None,
        max_shrink_iters: 200,
        ..Config::default()
    };
    let outcome = TestRunner::new(config)
        .run(&strategy, |value| try_out(&value).map_err(TestCaseError::fail));
    outcome.unwrap_or_else(|error| panic!("{error}"));
}

/// Returns the error of a piece of work; a panic or a hang is an error of the test.
fn survived(work: impl FnOnce() -> Result<(), String> + Send + 'static) -> Result<(), String> {
    let (sender, receiver) = channel();
    thread::spawn(move || sender.send(catch_unwind(AssertUnwindSafe(work))));
    match receiver.recv_timeout(PATIENCE) {
        Ok(Ok(Ok(()))) => Ok(()),
        Ok(Ok(Err(message))) => worded(&message),
        Ok(Err(_)) => Err("panicked".into()),
        Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => Err("hung".into()),
    }
}

/// Words of the programming language, forbidden in messages.
const LEAKS: [&str; 10] = [
    "expected u32",
    "expected u64",
    "expected f64",
    "invalid type",
    "invalid length",
    "unit variant",
    "string only",
    "expected struct",
    "wanted exactly",
    "panicked",
];

/// Requires a non-empty message in plain words.
fn worded(message: &str) -> Result<(), String> {
    match LEAKS.iter().find(|leak| message.contains(**leak)) {
        Some(leak) => Err(format!("\"{leak}\" in: {message}")),
        None if message.len() < 10 || message.len() > 2000 => {
            Err(format!("a message of {}: {message}", message.len()))
        }
        None => Ok(()),
    }
}

#[test]
fn meshes() {
    let seeds = formats::samples();
    let names: Vec<usize> = (0..seeds.len()).collect();
    let folder = TempDir::new().unwrap();
    fuzz((prop::sample::select(names), edits()), cases(), |(seed, edits)| {
        let (name, bytes) = &seeds[*seed];
        let path = folder.path().join(name);
        fs::write(&path, altered(bytes, edits)).unwrap();
        survived(move || import(&path, 1.0).map(drop).map_err(|error| error.to_string()))
    });
}

/// A written experiment loads to the same experiment.
fn loads(path: &Path, sets: &[String]) -> Result<(), String> {
    let experiment = Experiment::load(path, sets).map_err(|error| error.to_string())?;
    let again = path.with_file_name("again.toml");
    fs::write(&again, resolved(&experiment)).unwrap();
    let read =
        Experiment::load(&again, &[]).map_err(|error| format!("panicked: again: {error}"))?;
    match read == experiment {
        true => Ok(()),
        false => Err(format!("panicked: {read:?} is not {experiment:?}")),
    }
}

#[test]
fn settings_files() {
    let folder = folder();
    let full = succeeds(folder.path(), &["show", "small.toml"]);
    let texts = [("small.toml", EXPERIMENT), ("scene.toml", SCENE), ("small.toml", &full)];
    fuzz((0..texts.len(), edits()), cases(), |(text, edits)| {
        for (name, text) in [("small.toml", EXPERIMENT), ("scene.toml", SCENE), texts[*text]] {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let (name, text) = texts[*text];
        fs::write(folder.path().join(name), altered(text.as_bytes(), edits)).unwrap();
        let [experiment, scene] = ["small.toml", "scene.toml"].map(|name| folder.path().join(name));
        survived(move || {
            let scene = Scene::load(&scene, &[]).map_err(|error| error.to_string());
            scene.map(drop).and_then(|()| loads(&experiment, &[]))
        })
    });
}

#[test]
fn assignments() {
    let folder = folder();
    let full: toml::Table = succeeds(folder.path(), &["show", "small.toml"]).parse().unwrap();
    let mut keys = vec!["scene.effects.skin".into(), "scene.arm".into(), "report.claims".into()];
    collect(&full, "", &mut keys);
    assert!(keys.len() > 30, "{keys:?}");
    let value = prop_oneof![
        prop::sample::select(&WORDS[..]).prop_map(String::from),
        "[0-9eE+\\-.\\[\\]{}=,\"a-z ]{0,12}",
        any::<String>(),
    ];
    let key = prop_oneof![6 => prop::sample::select(keys), 1 => "[a-z.\\[\\]0-9_]{0,20}"];
    let sets =
        prop::collection::vec((key, value).prop_map(|(key, value)| format!("{key}={value}")), 1..4);
    let path = folder.path().join("small.toml");
    fuzz(sets, cases(), |sets| {
        let (path, sets) = (path.clone(), sets.clone());
        survived(move || loads(&path, &sets))
    });
}

/// Collects all keys of a table, dotted.
fn collect(table: &toml::Table, prefix: &str, keys: &mut Vec<String>) {
    for (name, value) in table {
        let key = format!("{prefix}{name}");
        if let Some(inner) = value.as_table() {
            collect(inner, &format!("{key}."), keys);
        }
        keys.push(key);
    }
}

/// A finished run and its files.
fn finished() -> (TempDir, Vec<(PathBuf, Vec<u8>)>) {
    let folder = folder();
    let more = ["--set", "planners=[\"random\",\"active\"]", "--set", "gp.normals=true"];
    succeeds(folder.path(), &[&["run", "small.toml", "--no-report"], &more[..]].concat());
    let files = ["trials.jsonl", "trials.jsonl", "resolved.toml", "surface.csv", "manifest.json"];
    let files = files.map(|name| {
        let path = folder.path().join("runs/small").join(name);
        (path.clone(), fs::read(path).unwrap())
    });
    (folder, files.into())
}

/// Restores a run's files and alters one.
fn damage(files: &[(PathBuf, Vec<u8>)], file: usize, edits: &[Edit]) {
    files.iter().for_each(|(path, bytes)| fs::write(path, bytes).unwrap());
    let (path, bytes) = &files[file];
    fs::write(path, altered(bytes, edits)).unwrap();
}

/// Generates all outputs of a run.
fn results(path: &Path, draw: bool) -> Result<(), String> {
    let run = Run::read(path).map_err(|error| error.to_string())?;
    let analysis = Analysis::new(&run);
    drop((tables::summary::text(&run, true), analysis));
    for planner in &run.experiment.planners {
        let replay = BeliefReplay::new(&run, planner, run.experiment.touches);
        replay.map(drop).map_err(|error| format!("{error:#}"))?;
    }
    for figure in FIGURES.iter().filter(|_| draw) {
        (figure.draw)(&run).map_err(|error| format!("{error:#}"))?;
    }
    Ok(())
}

#[test]
fn run_folders() {
    let (folder, files) = finished();
    let path = folder.path().join("runs/small");
    let drawn = std::cell::Cell::new(0);
    fuzz((0..files.len(), edits()), cases(), |(file, edits)| {
        damage(&files, *file, edits);
        drawn.set(drawn.get() + 1);
        // Drawing takes a hundred times as long as reading.
        let (path, draw) = (path.clone(), drawn.get() % 10 == 0);
        survived(move || results(&path, draw))
    });
}

#[test]
fn the_program_on_damaged_runs() {
    let (folder, files) = finished();
    let commands: [&[&str]; 4] = [
        &["export", "runs/small", "--planner", "active", "--out", "out.ply"],
        &["report", "runs/small"],
        &["show", "runs/small"],
        &[
            "run",
            "small.toml",
            "--no-report",
            "--set",
            "planners=[\"random\",\"active\"]",
            "--set",
            "gp.normals=true",
        ],
    ];
    fuzz(
        (0..files.len(), edits(), 0..commands.len()),
        (cases() / 1000).max(24),
        |(file, edits, which)| {
            damage(&files, *file, edits);
            let output = run_to_end(&mut command(folder.path(), commands[*which]), "a damaged run");
            let message = stderr(&output);
            match output.status.code() {
                Some(0) if output.stdout.is_empty() => Err("nothing said".into()),
                Some(0) => Ok(()),
                Some(2) if message.starts_with("error: ") => worded(&message),
                code => Err(format!("{code:?}: {message}")),
            }
        },
    );
}
