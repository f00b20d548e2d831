//! Every hard case at the hardest severity that must hold.

use palpate::study::stress::{Case, Outcome, TimeAxis, cases};
use rayon::prelude::*;
use std::collections::HashSet;

/// At the hardest severity that it must hold, at the nominal period or step. What comes beyond
/// takes minutes and is the command's.
#[test]
fn every_case_holds_where_it_must() {
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

/// A case promises something, and says why it is hard and why it may be wrong where it may.
#[test]
fn the_catalogue_is_complete() {
    let names: HashSet<&str> = cases().map(|case| case.name).collect();
    assert_eq!(names.len(), cases().count());
    for case in cases() {
        let distinct: HashSet<u64> = case.severities.iter().map(|s| s.to_bits()).collect();
        assert_eq!(distinct.len(), case.severities.len(), "{}", case.name);
        assert!(case.holds <= case.severities.len(), "{}", case.name);
        assert!(!case.why.is_empty() && !case.severity.is_empty(), "{}", case.name);
        assert!(case.axis.values_s().contains(&case.axis.nominal_s()), "{}", case.name);
        let is_known_late = case.known.is_empty() || case.holds < case.severities.len();
        assert!(is_known_late, "{} excuses what it must hold", case.name);
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

/// Measured: 2000 times; at 5000, the next that is tried, the force at rest is off by 5.2 %, where
/// 5 are allowed. The bound is half of it.
#[cfg(feature = "mujoco")]
#[test]
fn a_skin_a_thousand_times_stiffer_keeps_the_force_at_rest_in_steps_as_given() {
    let margin = palpate::study::stress::stiff_press::stiffness_margin(0.002, false);
    assert!(margin.times >= 1000.0, "{margin:?}");
}
