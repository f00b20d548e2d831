//! Tests of shards and their merging.

use crate::common::counting::peak_bytes;
use crate::common::program::palpate;
use palpate::experiment::runner::Shard;
use palpate::experiment::store::merge;
use std::fs;
use std::path::Path;

const SETS: [&str; 4] =
    ["trials=7", "touches=8", "initial_touches=3", "planners=[\"active\",\"random\"]"];

/// Runs the toy with `more` in `out`; returns exit code and output.
fn run(out: &Path, more: &[&str]) -> (Option<i32>, String) {
    let mut arguments =
        vec!["--quiet", "run", "toy", "--no-report", "--out", out.to_str().unwrap()];
    SETS.iter().for_each(|set| arguments.extend(["--set", *set]));
    arguments.extend(more);
    said(&arguments)
}

fn said(arguments: &[&str]) -> (Option<i32>, String) {
    let output = palpate(Path::new("."), arguments);
    let said = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap()).concat();
    (output.status.code(), said)
}

#[test]
fn a_shard_is_every_nth_trial() {
    let third: Shard = "3/8".parse().unwrap();
    assert_eq!((0..24).filter(|&trial| third.contains(trial)).collect::<Vec<_>>(), [2, 10, 18]);
    for text in ["0/8", "9/8", "3", "3/", "/8", "-1/8", "a/b", "1/0"] {
        assert!(text.parse::<Shard>().is_err(), "{text}");
    }
}

/// Merged shards have the bytes of a run in one process; incomplete sets are rejected without
/// writing.
#[test]
fn shards_are_merged_to_the_bytes_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let text = |name: &str| at(name).to_str().unwrap().to_owned();
    assert_eq!(run(&at("whole"), &[]).0, Some(0));
    for shard in ["1", "2", "3"] {
        // The second run is stopped after its first trial and restarted.
        if shard == "2" {
            run(&at(shard), &["--shard", "2/3", "--set", "trials=2"]);
            assert!(
                fs::read_to_string(at(shard).join("trials.jsonl")).unwrap().lines().count() < 4
            );
        }
        let (code, values) = run(&at(shard), &["--shard", &format!("{shard}/3")]);
        assert_eq!(code, Some(0), "{values}");
    }
    let merge = |out: &str, parts: &[&str]| {
        let parts: Vec<String> = parts.iter().map(|part| text(part)).collect();
        let out = text(out);
        let mut arguments = vec!["report", &out, "--merge"];
        arguments.extend(parts.iter().map(String::as_str));
        said(&arguments)
    };
    let (code, values) = merge("merged", &["2", "3", "1"]);
    assert!(code == Some(0) && values.contains("14 trials"), "{values}");
    let rows = |name: &str| fs::read(at(name).join("trials.jsonl")).unwrap();
    assert_eq!(rows("merged"), rows("whole"));
    assert_eq!(said(&["report", &text("merged")]).0, Some(0));

    let (code, values) = merge("missing", &["1", "3"]);
    assert!(code == Some(2) && values.contains("4 of 14 trials are missing"), "{values}");
    let (code, values) = merge("twice", &["1", "2", "3", "whole"]);
    assert!(code == Some(2) && values.contains("is in both"), "{values}");
    run(&at("foreign"), &["--shard", "1/3", "--set", "gp.noise_sd_m=0.01"]);
    let (code, values) = merge("of-two", &["2", "foreign"]);
    assert!(code == Some(2) && values.contains("not the experiment of"), "{values}");
    let (code, values) = merge("merged", &["1", "2", "3"]);
    assert!(code == Some(2) && values.contains("already has rows"), "{values}");
    assert!(["missing", "twice", "of-two"].iter().all(|name| !at(name).exists()));
    let (code, values) = run(&at("no"), &["--shard", "4/3"]);
    assert!(code == Some(2) && values.contains("from 1 to N"), "{values}");
}

/// Only the trial and the position of each row are kept in memory.
#[test]
fn rows_are_merged_without_being_kept() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let more = ["--shard", "1/1", "--set", "trials=300", "--set", "grid=10"];
    assert_eq!(run(&at("1"), &more).0, Some(0));
    let size = fs::metadata(at("1").join("trials.jsonl")).unwrap().len();
    let mut count = 0;
    let peak = peak_bytes(|| {
        count = merge(&at("whole"), &[at("1")], "unknown").unwrap();
    });
    assert_eq!(count, 600);
    assert!((peak as u64) < size / 4, "{peak} bytes of {size}");
}
