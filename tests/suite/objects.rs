//! Tests of planners over several objects: the statistics, and the order of the planners.

use crate::common::program::palpate;
use palpate::experiment::sweep::sweep_cases;
use palpate::experiment::{Experiment, Simulation};
use palpate::study::check::measures::mean_log_error;
use palpate::study::compare::{Entrant, ObjectResult, SuiteComparison, gap_closed, geometric_mean};
use proptest::prelude::*;
use rayon::prelude::*;
use std::fs;
use std::path::Path;

fn compared(random: &[f64], own: &[f64], oracle: &[f64]) -> SuiteComparison {
    let contender = |(name, scores): (&str, &[f64])| Entrant {
        name: name.into(),
        results: vec![ObjectResult { scores: scores.to_vec(), ..ObjectResult::default() }],
    };
    let named = [("random", random), ("own", own), ("oracle", oracle)];
    let contenders = named.map(contender).into();
    SuiteComparison { reference: "random".into(), objects: vec!["it".into()], contenders }
}

proptest! {
    /// Random closes none of the gap and the oracle all of it; a planner half-way in each trial
    /// closes half, for any unit of the errors.
    #[test]
    fn a_gap_is_closed_from_random_to_the_oracle(
        random in prop::collection::vec(1.0..9.0_f64, 2..20),
        better in 1.1..9.0_f64,
        unit in 0.1..9.0_f64,
    ) {
        let oracle: Vec<f64> = random.iter().map(|score| score / better).collect();
        let halfway: Vec<f64> = random.iter().map(|score| score / better.sqrt()).collect();
        let found = compared(&random, &halfway, &oracle);
        for (contender, share) in found.contenders.iter().zip([0.0, 0.5, 1.0]) {
            let gap = gap_closed(&found, contender, &[0], 1).unwrap();
            prop_assert!((gap.value - share).abs() < 1e-9, "{gap:?}");
            prop_assert!(gap.interval.unwrap().iter().all(|end| (end - share).abs() < 1e-9), "{gap:?}");
        }
        let in_unit = |scores: &[f64]| scores.iter().map(|it| it * unit).collect::<Vec<f64>>();
        let other = compared(&in_unit(&random), &in_unit(&halfway), &in_unit(&oracle));
        let gap = gap_closed(&other, &other.contenders[1], &[0], 1).unwrap();
        prop_assert!((gap.value - 0.5).abs() < 1e-9);
    }
}

#[test]
fn every_object_counts_once() {
    // Two trials of one object and four of another: (½·ln 1·4 + ¼·ln 1·1·16·16)/2 = ln 2√2.
    let found = geometric_mean(&[&[1.0, 4.0], &[1.0, 1.0, 16.0, 16.0]], 0).unwrap();
    assert!((found.value - 8.0_f64.sqrt()).abs() < 1e-12, "{found:?}");
    let [low, high] = found.interval.unwrap();
    assert!(low < found.value && found.value < high);
    assert_eq!(geometric_mean(&[&[1.0], &[]], 0), None);
    let none = compared(&[1.0, 2.0], &[1.0], &[0.5, 0.5]);
    assert_eq!(gap_closed(&none, &none.contenders[1], &[0], 0), None);
}

/// Mean log RMSE over the touches of a planner's first trials.
fn logs(experiment: Experiment, names: &[&str], trials: u32) -> Vec<f64> {
    let simulation = Simulation::new(experiment).unwrap();
    let of = |name: &&str| {
        let planner = simulation.planner(name).unwrap();
        let rows = (0..trials).into_par_iter().map(|trial| simulation.trial(planner, trial));
        let logs = rows.map(|row| {
            let is_whole = row.failure.is_none();
            assert!(is_whole && row.touches.iter().all(|it| it.fallback.is_none()), "{name}");
            mean_log_error(&row, simulation.experiment()).unwrap()
        });
        logs.sum::<f64>() / f64::from(trials)
    };
    names.iter().map(of).collect()
}

/// Over six different objects, `silhouette` is better than an even spread and never stalls; the
/// oracle is better than both.
#[test]
fn planners_keep_their_order_on_six_objects() {
    let path = Path::new("experiments/suite/six.toml");
    // Without normals, which take five times as long.
    let sets = ["planning.oracle.candidates=20", "grid=15", "gp.normals=false"].map(String::from);
    let mut sums = [0.0; 3];
    for cell in sweep_cases(path).unwrap() {
        let experiment = Experiment::load_cell(path, &cell, &sets).unwrap();
        let found = logs(experiment, &["sobol", "silhouette", "oracle"], 3);
        sums.iter_mut().zip(found).for_each(|(sum, log)| *sum += log / 6.0);
    }
    let [sobol, silhouette, oracle] = sums;
    println!("{:.3} {:.3}", (silhouette - sobol).exp(), (oracle - sobol).exp());
    assert!(silhouette < sobol - 0.05 && oracle < silhouette - 0.1, "{sums:?}");
}

/// An oracle with new fits for each candidate predicts the effect of a touch.
#[test]
fn an_oracle_may_fit_again() {
    let path = Path::new("experiments/suite/six.toml");
    let cell = &sweep_cases(path).unwrap()[1];
    let sets = ["planning.oracle.candidates=10", "planning.oracle.refit=true", "grid=15"];
    let sets = [&sets[..], &["touches=12", "gp.normals=false"]].concat();
    let sets: Vec<String> = sets.into_iter().map(String::from).collect();
    let experiment = Experiment::load_cell(path, cell, &sets).unwrap();
    let found = logs(experiment, &["sobol", "oracle"], 2);
    assert!(found[1] < found[0] - 0.05, "{found:?}");
}

/// With the touches of an even spread, free space makes the belief of no object worse by more than
/// 6 %, and the overall error smaller.
#[test]
fn free_space_makes_no_belief_worse() {
    let mut found = Vec::new();
    for half in ["choosing", "reporting"] {
        let path = format!("experiments/suite/{half}.toml");
        for cell in sweep_cases(Path::new(&path)).unwrap() {
            let [without, with] = [false, true].map(|free_space| {
                let sets = ["grid=15", "gp.normals=false"].map(String::from);
                let sets = [&sets[..], &[format!("gp.free_space={free_space}")]].concat();
                let experiment = Experiment::load_cell(Path::new(&path), &cell, &sets).unwrap();
                logs(experiment, &["sobol"], 3)[0]
            });
            println!("{}: {:.3}", cell.label, (with - without).exp());
            found.push((cell.label, with - without));
        }
    }
    let mean = found.iter().map(|(_, log)| log).sum::<f64>() / found.len() as f64;
    println!("all: {:.3}", mean.exp());
    assert!(found.iter().all(|(_, log)| *log < 0.06) && mean < -0.02, "{mean}: {found:?}");
}

/// The runs of a sweep are compared in tables, a page and a CSV file; existing runs give the same
/// result.
#[test]
fn a_sweep_is_compared_when_it_is_run() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let text = "name = \"two\"\nscene = \"toy\"\nplanners = [\"active\", \"random\", \"sobol\", \
                \"oracle\"]\ntrials = 3\ngrid = 41\nseed = 1\ntouches = 8\ninitial_touches = 3\n[sweep]\n\
                \"gp.noise_sd_m\" = [0.01, 0.05]\n";
    let scene = fs::canonicalize("scenes/toy.toml").unwrap();
    let text = text.replace("\"toy\"", &format!("{:?}", scene.to_str().unwrap()));
    let file = at("two.toml");
    fs::write(&file, &text).unwrap();
    let out = at("out");
    let run = || {
        let output = palpate(Path::new("."), &["--quiet", "run", &file, "--out", &out]);
        let said = [output.stdout, output.stderr].map(|it| String::from_utf8(it).unwrap()).concat();
        let compared = said.find("object ").map_or(said.clone(), |at| said[at..].to_owned());
        (output.status.code(), compared)
    };
    let (code, said) = run();
    assert!(code == Some(0) && said.contains("gap closed"), "{said}");
    let page = fs::read_to_string(folder.path().join("out/suite.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("oracle") && page.contains("better on"));
    let csv = fs::read_to_string(folder.path().join("out/suite.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 4, "{csv}");
    let (again, repeated) = run();
    assert_eq!((again, repeated), (Some(0), said));
    assert_eq!(fs::read_to_string(folder.path().join("out/suite.csv")).unwrap(), csv);
}
