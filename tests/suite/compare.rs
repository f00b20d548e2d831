//! Tests of the comparison of planners over several runs.

use crate::common::program::palpate;
use palpate::experiment::statistics::equal_error::IntervalEstimate;
use palpate::study::compare::{
    Entrant, ObjectResult, interquartile_mean, interquartile_mean_interval, profile,
    win_probability,
};
use proptest::prelude::*;
use std::fs;
use std::path::Path;

fn contender(scores: &[f64]) -> Entrant {
    let result = ObjectResult { scores: scores.to_vec(), ..ObjectResult::default() };
    Entrant { name: "it".into(), results: vec![result] }
}

#[test]
fn the_interquartile_mean_is_the_textbooks() {
    // scipy.stats.trim_mean(x, 0.25)
    assert_eq!(interquartile_mean(&[100.0, 2.0, 3.0, -50.0]), Some(2.5));
    assert_eq!(interquartile_mean(&[1.0, 2.0, 3.0, 4.0, 5.0]), Some(3.0));
    assert_eq!(interquartile_mean(&[7.0]), Some(7.0));
    assert_eq!(interquartile_mean(&[]), None);
    assert_eq!(interquartile_mean_interval(&[&[1.0, 1.0], &[]], 0), None);
    let equal = interquartile_mean_interval(&[&[2.0; 9], &[2.0; 4]], 0).unwrap();
    assert_eq!((equal.value, equal.interval), (2.0, Some([2.0, 2.0])));
}

proptest! {
    /// Comparisons are antisymmetric, a shift is recovered, and a profile increases to one.
    #[test]
    fn comparisons_are_consistent(
        a in prop::collection::vec(0.1..9.0_f64, 1..30),
        b in prop::collection::vec(0.1..9.0_f64, 1..30),
    ) {
        let (one, other) = (contender(&a), contender(&b));
        let both = win_probability(&one, &other).unwrap() + win_probability(&other, &one).unwrap();
        prop_assert!((both - 1.0).abs() < 1e-12);
        prop_assert_eq!(win_probability(&one, &one), Some(0.5));
        let IntervalEstimate { value: mean, interval } = interquartile_mean_interval(&[&a, &b], 3).unwrap();
        let [low, high] = interval.unwrap();
        prop_assert!(low <= high && (0.1..=9.0).contains(&mean));
        let shares: Vec<f64> = (0..=90).map(|i| profile(&one, f64::from(i) * 0.1)).collect();
        prop_assert!(shares.is_sorted() && shares[0] == 0.0 && shares[90] == 1.0);
    }
}

/// Compares two runs of one experiment and one of another from the command line.
#[test]
fn runs_are_compared_from_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let run = |name: &str, sets: &[&str]| {
        let out = at(name);
        let mut arguments = vec!["--quiet", "run", "toy", "--no-report", "--out", &out];
        let sets = [&["trials=6", "touches=10", "planners=[\"active\",\"random\"]"], sets].concat();
        sets.iter().for_each(|set| arguments.extend(["--set", *set]));
        assert!(palpate(Path::new("."), &arguments).status.success());
    };
    run("one", &[]);
    run("two", &["gp.noise_sd_m=0.05"]);
    run("other", &["name=\"other\""]);
    run("apart", &["seed=7"]);
    let compare = |arguments: &[&str]| {
        let output = palpate(Path::new("."), &[&["compare"], arguments].concat());
        let said = [output.stdout, output.stderr].map(|it| String::from_utf8(it).unwrap()).concat();
        (output.status.code(), said)
    };
    let svg = at("profiles.svg");
    let out = at("both");
    let (code, said) = compare(&[&at("one"), &at("other"), "--svg", &svg, "--out", &out]);
    assert_eq!(code, Some(0), "{said}");
    let of_random = said.lines().filter(|line| line.starts_with("random"));
    let [means, over_all] = of_random.collect::<Vec<_>>()[..] else { panic!("{said}") };
    assert!(means.matches("1.00 [1.00, 1.00]").count() == 3, "{said}");
    assert!(over_all.ends_with("0.50") && over_all.contains("1.00 [1.00, 1.00]"), "{said}");
    assert!(fs::read_to_string(&svg).unwrap().starts_with("<svg"));
    let page = fs::read_to_string(folder.path().join("both/suite.html")).unwrap();
    assert!(page.contains("better than random") && page.contains("<svg"));
    let csv = fs::read_to_string(folder.path().join("both/suite.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 2, "{csv}");
    let (code, said) = compare(&[&at("one"), &at("two")]);
    assert!(code == Some(0) && said.contains(&format!("active ({})", at("two"))), "{said}");
    let (code, said) = compare(&[&at("one"), &at("apart")]);
    assert!(code == Some(2) && said.contains("do not pair"), "{said}");
    let (code, said) = compare(&[&at("one"), "--against", "sobol"]);
    assert!(
        code == Some(2) && said.contains("no trials of the reference planner \"sobol\""),
        "{said}"
    );
}
