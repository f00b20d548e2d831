//! Tests of runs without ground truth: verification touches, repeated touches, and scans as ground
//! truth.

use palpate::experiment::analysis::Analysis;
use palpate::experiment::measure;
use palpate::experiment::metrics::truth::Truth;
use palpate::experiment::metrics::truth::scan_truth::ScanTruth;
use palpate::experiment::row::TrialRow;
use palpate::experiment::store::Run;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::planner;
use palpate::report;
use palpate::sim::Environment;
use palpate::task::Zone;
use std::fs;
use std::sync::Arc;

fn container(sets: &[&str]) -> Experiment {
    let sets: Vec<String> =
        ["touches=10", "grid=11", "trials=2", "planners=[\"active\", \"random\"]"]
            .iter()
            .chain(sets)
            .map(|set| (*set).into())
            .collect();
    Experiment::load("experiments/container.toml".as_ref(), &sets).unwrap()
}

fn row(experiment: Experiment, planner: &str, trial: u32) -> TrialRow {
    let simulation = Simulation::new(experiment).unwrap();
    simulation.trial(planner::by_name(planner).unwrap(), trial)
}

const WITH: [&str; 2] = ["verification_touches=12", "repeat_touches=4"];

/// Verification touches do not change the belief, their places depend on the trial, and their
/// measures exist only after the last touch.
#[test]
fn verification_touches_follow_a_trial_and_change_nothing_of_it() {
    let plain = row(container(&[]), "active", 1);
    let verified = row(container(&WITH), "active", 1);
    assert_eq!(plain.touches, verified.touches);
    assert!(!serde_json::to_string(&plain).unwrap().contains("verification"));
    assert_eq!(verified.verification.len(), 16);
    let other = row(container(&WITH), "random", 1);
    let new = |row: &TrialRow| -> Vec<palpate::task::Target> {
        let new = row.verification.iter().filter(|touch| touch.repeats.is_none());
        new.map(|touch| touch.target.clone()).collect()
    };
    assert_eq!(new(&verified), new(&other));
    assert_ne!(new(&verified), new(&row(container(&WITH), "active", 0)));
    for id in
        ["verification_rmse_m", "verification_nlpd", "verification_coverage", "repeatability_m"]
    {
        let measure = measure::by_id(id).unwrap();
        assert!(measure.value(&verified, 10).is_some(), "{id}");
        assert_eq!((measure.value(&verified, 9), measure.value(&plain, 10)), (None, None), "{id}");
    }
}

/// The exact sweep is perfectly repeatable, and the error at verification touches is similar to the
/// error on the test grid.
#[test]
fn an_exact_probe_repeats_and_verifies() {
    let verified = row(container(&["verification_touches=200", "repeat_touches=6"]), "active", 0);
    let of = |id: &str| measure::by_id(id).unwrap().value(&verified, 10).unwrap();
    assert_eq!(of("repeatability_m"), 0.0);
    assert_eq!(of("verification_miss_share"), 0.0);
    let ratio = of("verification_rmse_m") / of("rmse_m");
    assert!((0.4..2.5).contains(&ratio), "{ratio}");
    // The band is wider below than above, unlike two standard deviations.
    let learned = ["verification_touches=40", "gp.band=\"objects\""];
    let learned = row(container(&learned), "active", 0);
    let bands_m: Vec<[f64; 2]> = learned.verification.iter().filter_map(|it| it.band_m).collect();
    assert_eq!(bands_m.len(), 40);
    assert!(bands_m.iter().all(|[low, high]| -low > *high), "{bands_m:?}");
    let within = learned.verification.iter().filter(|it| {
        let [low, high] = it.band_m.unwrap();
        (low..=high).contains(&it.error_m.unwrap())
    });
    let coverage = measure::by_id("verification_coverage").unwrap().value(&learned, 10).unwrap();
    assert!((within.count() as f64 / 40.0 - coverage).abs() < 1e-9);
    let again: Vec<u32> = verified.verification.iter().filter_map(|touch| touch.repeats).collect();
    assert_eq!(again.len(), 6);
    for touch in verified.verification.iter().filter(|touch| touch.repeats.is_some()) {
        let first = &verified.touches[touch.repeats.unwrap() as usize - 1];
        let contact = first.contact().map(|p_w| p_w.coords.into());
        assert_eq!((&touch.target, touch.contact), (&first.target, contact));
    }
}

/// Without a known surface all possible figures are drawn, and no errors are reported.
#[test]
fn a_run_without_truth_is_told() {
    for with in [&WITH[..], &[]] {
        let experiment = container(with);
        let environment = Arc::new(Environment::build(experiment.scene.clone()).unwrap());
        let zone = environment.task().zone().unwrap();
        let places = zone.grid(experiment.grid as usize);
        let count = places.len();
        let truth = Truth::new(zone, places, vec![None; count], vec![false; count]);
        let simulation = Simulation::with_truth(experiment, environment, truth.clone()).unwrap();
        let planners = ["active", "random"].map(|name| planner::by_name(name).unwrap());
        let rows: Vec<TrialRow> = (0..2)
            .flat_map(|trial| planners.map(|planner| simulation.trial(planner, trial)))
            .collect();
        assert!(rows.iter().all(|row| row.failure.is_none() && row.touches.len() == 10));
        assert!(rows.iter().flat_map(|row| &row.touches).all(|touch| touch.metrics.is_none()));
        let experiment = simulation.experiment().clone();
        let run = Run { experiment, truth, rows, unlisted: 0 };
        let folder = tempfile::tempdir().unwrap();
        let analysis = Analysis::new(&run);
        report::write_tables(&run, &analysis, folder.path()).unwrap();
        report::write(&run, &analysis, folder.path()).unwrap();
        let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
        assert!(page.contains("no ground truth"));
        let visible = page.split("<script").next().unwrap();
        assert!(!visible.contains("NaN") && !visible.contains("mean R (Eq. 5) is"), "{visible}");
        assert_eq!(page.contains("At held-out verification touches"), !with.is_empty());
        let text = report::tables::summary::text(&run, true);
        assert!(text.contains("no ground truth"), "{text}");
        assert_eq!(text.contains("verification rmse"), !with.is_empty(), "{text}");
        let csv = fs::read_to_string(folder.path().join("summary.csv")).unwrap();
        assert!(csv.lines().count() > 1 && !csv.contains("NaN"));
    }
}

/// The heights of a tilted plane are reproduced exactly, nothing is reported beyond the scan, and
/// leaving a contact out changes nothing.
#[test]
fn a_scan_is_a_truth() {
    let folder = tempfile::tempdir().unwrap();
    let scan = folder.path().join("cloud.csv");
    let mut text = String::from("target_x_m,target_z_m,outcome,x_m,y_m,z_m\n0,0,miss,,,\n");
    let height_m = |x: f64, z: f64| 0.01 + 0.3 * x - 0.2 * z;
    for i in 0..21 {
        for j in 0..21 {
            let (x, z) = (0.002 * f64::from(i) - 0.02, 0.002 * f64::from(j) - 0.02);
            text += &format!("{x},{z},contact,{x},{},{z}\n", height_m(x, z));
        }
    }
    fs::write(&scan, text).unwrap();
    let zone = Zone { datum_y_m: Some(0.002), ..Zone::new([-0.05, 0.02], Some([-0.02, 0.02])) };
    let truth = ScanTruth { scan: scan.clone().into(), contacts_min: 4, search_radius_m: None };
    let (truth, contacts, rmse_m) = truth.sample(&zone, 15).unwrap();
    let (mut known, mut unknown) = (0, 0);
    for (place, told_m) in truth.places.iter().zip(&truth.heights_m) {
        match told_m {
            Some(told_m) => {
                known += 1;
                assert!((told_m + 0.002 - height_m(place[0], place[1])).abs() < 1e-9);
            }
            None => unknown += 1,
        }
        assert_eq!(told_m.is_some(), place[0] > -0.0207, "{place:?}");
    }
    assert!(known > 50 && unknown > 50);
    assert_eq!(contacts, 441);
    assert!(rmse_m.unwrap() < 1e-9);
    let gone = ScanTruth {
        scan: folder.path().join("none.csv").into(),
        contacts_min: 4,
        search_radius_m: None,
    };
    assert!(gone.sample(&zone, 5).unwrap_err().to_string().contains("none.csv"));
    fs::write(&scan, "x_m,y_m\n1,2\n").unwrap();
    let bad = ScanTruth { scan: scan.into(), contacts_min: 4, search_radius_m: None };
    assert!(bad.sample(&zone, 5).unwrap_err().to_string().contains("z_m"));
}
