//! Every hard case at the hardest severity that must hold.

use palpate::trials::stress::{Outcome, cases};
use std::collections::HashSet;

#[test]
fn every_case_holds_where_it_must_and_says_so_where_it_does_not() {
    for case in cases() {
        let nominal = case.holds.saturating_sub(1);
        let verdict = case.run(nominal, 0.01);
        let at = case.severities[nominal];
        assert!(
            verdict.explained,
            "{} at {at} {}: {:?}",
            case.name, case.severity, verdict.outcome
        );
    }
}

#[test]
fn the_catalogue_is_complete() {
    let names: HashSet<&str> = cases().map(|case| case.name).collect();
    assert_eq!(names.len(), cases().count());
    assert!(names.len() >= 40, "{}", names.len());
    for case in cases() {
        assert!(case.holds <= case.severities.len(), "{}", case.name);
        assert!(!case.why.is_empty() && !case.severity.is_empty(), "{}", case.name);
    }
}

#[test]
fn a_panic_is_a_broken_law() {
    let case = palpate::trials::stress::Case {
        name: "panic",
        why: "it panics",
        severity: "times",
        severities: &[1.0],
        holds: 1,
        known: "",
        timed: false,
        law: |_, _| panic!("as it should"),
    };
    let verdict = case.run(0, 0.01);
    assert!(matches!(verdict.outcome, Outcome::Wrong(_)) && !verdict.explained);
}
