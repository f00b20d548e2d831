//! Tests of `palpate benchmark`: its protocol, its results, and that it can be continued.

use crate::common::program::{fails, palpate, succeeds};
use palpate::experiment::runner;
use palpate::experiment::store::{Run, RunFolder};
use palpate::experiment::sweep::sweep_cases;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::Belief;
use palpate::explore::planner::{
    Offer, Plan, PlanError, Planner, PlannerFactory, PlanningSettings, sample,
};
use palpate::study::benchmark::{
    BenchmarkResult, BenchmarkSource, PROTOCOL, REFERENCE, protocol_sha256, summarise,
};
use palpate::study::compare::compare;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

const FILE: &str = "experiments/suite/benchmark-3.toml";

/// The files of protocol 3. A change of one of them changes the results: it needs a new version.
#[test]
fn the_protocol_is_that_of_its_version() {
    assert_eq!(PROTOCOL, "benchmark-3");
    assert_eq!(protocol_sha256(Path::new(FILE)).unwrap(), SHA256);
}

const SHA256: &str = "632a25011723c84dfb8a9a961dae63462d34b6ff0c9a2b33d2694bef1462c204";

/// The hash covers scenes and meshes, and nothing else that lies beside them.
#[test]
fn the_hash_covers_every_file_of_the_protocol() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let hash = || protocol_sha256(&folder.path().join("all.toml")).unwrap();
    write("all.toml", "gp = \"gp.toml\"\nname = \"x\"\n[sweep]\nscene = [\"a.toml\"]\n");
    write("gp.toml", "noise = [1e-4, 1e-1]\n");
    write("a.toml", "[object]\nmesh = \"a.obj\"\n");
    write("a.obj", "v 0 0 0\n");
    let mut seen = vec![hash()];
    for name in ["all.toml", "gp.toml", "a.toml", "a.obj"] {
        let before = fs::read_to_string(folder.path().join(name)).unwrap();
        write(name, &(before + "# more\n"));
        assert!(!seen.contains(&hash()), "{name}");
        seen.push(hash());
    }
    write("b.obj", "v 0 0 0\n");
    assert_eq!(seen.last(), Some(&hash()));
}

/// Touches random places of the part of the zone at one corner that has this share of its sides;
/// finds no target if the share is 0.
struct Mine {
    name: &'static str,
    share: f64,
}

struct Shrunk {
    random: ChaCha8Rng,
    share: f64,
}

impl PlannerFactory for Mine {
    fn name(&self) -> &str {
        self.name
    }

    fn make(&self, _: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner> {
        Box::new(Shrunk { random, share: self.share })
    }
}

impl Planner for Shrunk {
    fn plan(&mut self, belief: &Belief, _: &Offer) -> Result<Plan, PlanError> {
        if self.share == 0.0 {
            return Err("out of order".into());
        }
        let region = belief.region();
        let zone = region.zone().ok_or("needs a zone")?;
        let place = sample::uniform(zone, &mut self.random);
        let low = [zone.x_m[0], zone.z_m.unwrap()[0]];
        let place = place.iter().zip(low).map(|(at, low)| low + self.share * (at - low));
        Ok(Plan::at(place.collect::<Vec<f64>>()))
    }
}

/// Results on two objects of the protocol in open zones, with few touches.
fn small() -> BenchmarkResult {
    let folder = tempfile::tempdir().unwrap();
    let names = ["mine:Corner", "sobol", "mine:Broken", "random"];
    let sets =
        [&format!("planners={names:?}"), "trials=3", "touches=14", "grid=15", "gp.normals=false"]
            .map(ToString::to_string);
    let mut runs = Vec::new();
    let cases = sweep_cases(Path::new(FILE)).unwrap();
    for case in [&cases[0], &cases[2]] {
        let experiment = Experiment::load_cell(Path::new(FILE), case, &sets).unwrap();
        let mine = |name, share| Box::new(Mine { name, share }) as Box<dyn PlannerFactory>;
        let mine = vec![mine("mine:Corner", 0.1), mine("mine:Broken", 0.0)];
        let simulation = Simulation::new(experiment).unwrap().with_planners(mine);
        let path = folder.path().join(&case.label);
        let (mut rows, done) = RunFolder::open(&path, &simulation, "unknown", false).unwrap();
        let jobs = runner::missing_jobs(&simulation, &done).unwrap();
        runner::run(&simulation, &mut rows, jobs, 0, &AtomicBool::new(false), None, &|_| ())
            .unwrap();
        rows.sort(simulation.experiment()).unwrap();
        runs.push((case.label.clone(), Run::read(&path).unwrap()));
    }
    let compared = compare(&runs, REFERENCE).unwrap();
    let runs: Vec<Run> = runs.into_iter().map(|(_, run)| run).collect();
    let source = BenchmarkSource {
        protocol: "it".into(),
        protocol_sha256: "it".into(),
        quick: true,
        commit: "unknown",
        objects: None,
    };
    summarise(source, &runs, &compared)
}

/// A planner that touches a corner only ranks behind random touches. The reference has error 1, and
/// a planner whose trials fail has no error, is last, and its failures are counted.
#[test]
fn a_worse_planner_ranks_worse() {
    let result = small();
    let names: Vec<&str> = result.planners.iter().map(|it| it.name.as_str()).collect();
    let place = |name: &str| names.iter().position(|it| *it == name).unwrap();
    assert!(place("mine:Corner") > place("sobol").max(place("random")), "{names:?}");
    assert_eq!(place("mine:Broken"), 3);
    let [corner, sobol, broken] =
        ["mine:Corner", "sobol", "mine:Broken"].map(|name| &result.planners[place(name)]);
    assert_eq!((sobol.error.error, sobol.error.error_interval), (Some(1.0), Some([1.0, 1.0])));
    assert!(sobol.after.iter().all(|error| error.error == Some(1.0)), "{sobol:?}");
    assert!(corner.better_on == 0 && corner.worse_on > 0, "{corner:?}");
    assert_eq!((corner.trials, corner.failures), (6, 0));
    assert_eq!((broken.error.error, broken.trials, broken.failures), (None, 0, 6));
    // 10 and 14 touches; of the protocol's budgets those that the trials reach, and the last.
    assert_eq!(result.budgets, [10, 14]);
    for planner in [corner, sobol] {
        for object in &planner.objects {
            let errors_m: Vec<f64> = object.error_m.iter().map(|error| error.unwrap()).collect();
            assert!(errors_m.iter().all(|error_m| (1e-5..0.1).contains(error_m)), "{object:?}");
        }
    }
    // The pooled error is the geometric mean over objects with as many trials.
    let logs = corner.objects.iter().map(|object| object.error.error.unwrap().ln());
    let mean = (logs.sum::<f64>() / 2.0).exp();
    assert!((corner.error.error.unwrap() - mean).abs() < 1e-12);
}

/// The command writes its files, states the protocol, and gives the same bytes after its results
/// were cut off and continued.
#[test]
fn a_quick_benchmark_runs_and_continues() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let run = ["benchmark", "--quick", "--out", out];
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let says = succeeds(root, &run);
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let (json, table) = (read("benchmark.json"), read("benchmark.md"));
    let result: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(result["protocol"], PROTOCOL);
    assert_eq!(result["protocol_sha256"], SHA256);
    assert_eq!(result["quick"], true);
    assert_eq!(result["budgets"], serde_json::json!([10, 15]));
    assert_eq!(result["objects"], serde_json::json!(["horseshoe", "horseshoe_full"]));
    assert!(table.contains("not comparable") && table.contains(SHA256), "{table}");
    let planners = result["planners"].as_array().unwrap();
    for planner in planners {
        let name = planner["name"].as_str().unwrap();
        assert!(table.contains(&format!("| {name} |")) && says.contains(name), "{name}");
        assert!(planner["error"].as_f64().unwrap() > 0.0 && planner["failures"] == 0, "{name}");
        let objects = planner["objects"].as_array().unwrap();
        assert!(objects.iter().all(|it| it["trials"] == 2 && it["error_m"][1].is_f64()), "{name}");
    }
    let names: Vec<&str> = planners.iter().map(|it| it["name"].as_str().unwrap()).collect();
    assert_eq!(names[0], "oracle", "the bound that no planner exceeds");
    assert!(["random", "sobol", "active", "expected_contact"].iter().all(|it| names.contains(it)));

    // A kill in the middle of a line.
    let rows = folder.path().join("benchmark-3-scene-horseshoe/trials.jsonl");
    let all = fs::read(&rows).unwrap();
    fs::write(&rows, &all[..all.len() / 2]).unwrap();
    succeeds(root, &run);
    assert!(fs::read(&rows).unwrap() == all);
    assert_eq!((read("benchmark.json"), read("benchmark.md")), (json, table));

    let unknown = [&run[..], &["--planner", "actve"]].concat();
    fails(root, &unknown, &["actve", "active"]);
    assert!(!palpate(root, &["benchmark", "--trials", "3"]).status.success());
}
