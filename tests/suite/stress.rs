//! Every hard case at the hardest severity that must hold.

use palpate::study::stress::{Case, Outcome, TimeAxis, cases};
use rayon::prelude::*;
use std::collections::HashSet;

#[test]
fn every_case_holds_where_it_must_and_says_so_where_it_does_not() {
    let cases: Vec<&Case> = cases().collect();
    cases.par_iter().for_each(|case| {
        let nominal = case.holds.saturating_sub(1);
        let verdict = case.run(nominal, case.axis.nominal_s());
        let at = case.severities[nominal];
        assert!(
            verdict.explained,
            "{} at {at} {}: {:?}",
            case.name, case.severity, verdict.outcome
        );
    });
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
    let case = Case {
        name: "panic",
        why: "it panics",
        severity: "times",
        severities: &[1.0],
        holds: 1,
        known: "",
        axis: TimeAxis::Untimed,
        law: |_, _| panic!("as it should"),
    };
    let verdict = case.run(0, 0.01);
    assert!(matches!(verdict.outcome, Outcome::Wrong(_)) && !verdict.explained);
}

/// Ten times is what a skin may be off its nominal stiffness without a thought for the time step.
#[cfg(feature = "mujoco")]
#[test]
fn a_skin_ten_times_stiffer_keeps_the_force_at_rest_in_steps_as_given() {
    let margin = palpate::study::stress::stiff_press::stiffness_margin(0.002, false);
    assert!(margin.times >= 10.0, "{margin:?}");
}
