//! Hard cases: conditions under which the simulation breaks, and whether it reports so. Each case
//! runs at increasing severity and has a law that it must obey.
//!
//! The tests run every case at the largest severity that must be stable. `make test
//! PART=hard-cases` runs all severities at all control periods or time steps and writes
//! `docs/hard-cases.md`.
//!
//! `case` defines a case and the evaluation of its outcome. The groups of cases are: `force_law`
//! presses a finger pose by pose; `shapes`, `wall`, `arm` and `sensor` make touches as in a scene;
//! `belief` fits; with masses, `dynamic` makes touches and `stiff_press` presses along a given
//! path; `shell` and `shell_touch` do the same with a shell skin. `finger_on_wall`, `checked_touch`
//! and `solids` are shared. `data` fits beliefs to data on which other libraries fail.

mod arm;
mod belief;
mod case;
mod checked_touch;
mod data;
#[cfg(feature = "mujoco")]
mod dynamic;
mod finger_on_wall;
mod force_law;
mod page;
mod sensor;
mod shapes;
mod shell;
#[cfg(feature = "mujoco")]
mod shell_touch;
mod solids;
#[cfg(feature = "mujoco")]
mod stiff_press;
mod wall;

use case::{Case, Outcome, TimeAxis};
use rayon::prelude::*;
use std::collections::HashSet;

/// Groups of cases, each with its heading on the page.
const GROUPS: &[(&str, &[Case])] = &[
    ("A finger pressed pose by pose", force_law::CASES),
    ("Objects that are hard to touch", shapes::CASES),
    ("A skin that is a shell", shell::CASES),
    ("A wall", wall::CASES),
    ("An arm", arm::CASES),
    #[cfg(feature = "mujoco")]
    ("A stiff skin and a body with masses", stiff_press::CASES),
    #[cfg(feature = "mujoco")]
    ("Touches by a body with masses", dynamic::CASES),
    #[cfg(feature = "mujoco")]
    ("Touches by a body with masses, its skin a shell", shell_touch::CASES),
    ("Sensors and joints that fail", sensor::CASES),
    ("Beliefs", belief::CASES),
];

fn cases() -> impl Iterator<Item = &'static Case> {
    GROUPS.iter().flat_map(|(_, cases)| *cases)
}

/// Runs every case at the nominal period or step; `make test PART=hard-cases` runs the others.
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

/// A case gives its difficulty, the required severities, and the reason for allowed errors beyond.
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

/// Tests that the force at rest stays within 5 % with a skin a thousand times stiffer. The bound is
/// a fifth of the measured value.
#[cfg(feature = "mujoco")]
#[test]
fn a_skin_a_thousand_times_stiffer_keeps_the_force_at_rest_in_steps_as_given() {
    let (times, beyond) = stiff_press::stiffness_margin(0.002, false);
    assert!(times >= 1000.0, "{times}, {beyond:?}");
}

/// All severities at all periods or steps take ten minutes of processor time, so they run only with
/// `PALPATE_HARD_CASES`: the page is written, and every outcome must be explained.
#[test]
fn all_outcomes_are_explained() {
    if std::env::var_os("PALPATE_HARD_CASES").is_none() {
        return;
    }
    let unexplained = page::write();
    assert!(unexplained.is_empty(), "\n{}", unexplained.join("\n"));
}

/// The committed page has a line for each case of the catalogue with its severities.
#[cfg(feature = "mujoco")]
#[test]
fn the_page_lists_every_case() {
    let text = std::fs::read_to_string(page::path()).unwrap();
    let listed = text.lines().filter(|line| line.starts_with("|**")).count();
    assert_eq!(listed, cases().count(), "run `make test PART=hard-cases`");
    for case in cases() {
        let start = format!("|**{}**: {}|", case.name, case.why);
        let line = text.lines().find(|line| line.starts_with(&start));
        let line = line.unwrap_or_else(|| panic!("{}: run `make test PART=hard-cases`", case.name));
        let [first, last] = [0, case.severities.len() - 1].map(|i| page::short(case.severities[i]));
        assert!(line.contains(&format!("|{first}–{last}|")), "{}", case.name);
    }
}
