//! `docs/hard-cases.md`: every case with its severities, periods or steps, and outcomes.

use super::case::{Case, Outcome, TimeAxis, Verdict};
use super::{GROUPS, cases};
use rayon::prelude::*;
use std::path::PathBuf;

/// Path of the page.
pub fn path() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "docs", "hard-cases.md"].iter().collect()
}

const HEAD: &str = "# Hard cases

Written by `make test PART=hard-cases`, which runs every case of `tests/suite/hard` at every severity and, where time
matters, at every control period or time step. [physics.md](physics.md#where-the-simulation-breaks) says what helps.

The column *tested* gives the easiest and the hardest severity. The column *outcomes* lists the severities that did not hold everywhere, with a letter for each period or step:

| letter | outcome |
|---|---|
| `h` | held: the law of the case was kept |
| `f` | fault: it ended with a fault that gives time and state, or was refused at the start |
| `w` | wrong, without a fault, for the known reason that its line gives |
| `U` | unexplained; there must be none |

";

/// Runs all cases at all severities, periods and steps, and writes the page; returns a line for
/// each unexplained outcome.
pub fn write() -> Vec<String> {
    let mut text = HEAD.to_owned();
    for axis in [TimeAxis::Period, TimeAxis::Step] {
        let values: Vec<String> = axis.values_s().iter().map(|s| short(1e3 * s)).collect();
        let count = values.len();
        text += &format!(
            "* {count} letters: {}s of {} ms. The nominal one is {} ms.\n",
            axis.name(),
            values.join(", "),
            short(1e3 * axis.nominal_s())
        );
    }
    text += "* One letter: the case depends on neither.\n\n";
    let mut tables = String::new();
    let (mut count, mut totals, mut unexplained) = (0, [0; 4], Vec::new());
    let mut ran = verdicts().into_iter();
    for (title, cases) in GROUPS {
        tables += &format!("\n## {title}\n\n");
        tables += "|case|severity|tested|must hold to|holds to|outcomes|beyond|\n|---|---|---|---|---|---|---|\n";
        for case in *cases {
            let verdicts: Vec<Verdict> = ran.by_ref().take(runs(case).count()).collect();
            tables += &line(case, &verdicts);
            count += 1;
            for verdict in &verdicts {
                totals[rank(verdict)] += 1;
                if !verdict.explained {
                    let at = short(case.severities[verdict.rank]);
                    unexplained.push(format!(
                        "{} at {at} {}, {} ms: {:?}",
                        case.name,
                        case.severity,
                        short(1e3 * verdict.axis_s),
                        verdict.outcome
                    ));
                }
            }
        }
    }
    let [held, faulted, wrong, unknown] = totals;
    text += &format!(
        "{count} cases, {} runs: {held} held, {faulted} ended with a fault beyond what must hold, {wrong} were wrong for a \
         known reason, {unknown} are unexplained.\n",
        totals.iter().sum::<u32>()
    );
    text += &tables;
    text += &margins();
    std::fs::write(path(), text).unwrap();
    unexplained
}

/// Severities of a case, by rank, and values of its time parameter.
fn runs(case: &Case) -> impl Iterator<Item = (usize, f64)> {
    let ranks = 0..case.severities.len();
    ranks.flat_map(|rank| case.axis.values_s().iter().map(move |&axis_s| (rank, axis_s)))
}

/// Runs all cases in sequence.
fn verdicts() -> Vec<Verdict> {
    let all = cases().flat_map(|case| runs(case).map(move |(rank, axis_s)| (case, rank, axis_s)));
    let all: Vec<_> = all.collect();
    all.into_par_iter().map(|(case, rank, axis_s)| case.run(rank, axis_s)).collect()
}

const LETTERS: [&str; 4] = ["h", "f", "w", "U"];

fn rank(verdict: &Verdict) -> usize {
    match (verdict.explained, &verdict.outcome) {
        (false, _) => 3,
        (true, Outcome::Stable) => 0,
        (true, Outcome::Faulted(_)) => 1,
        (true, Outcome::Wrong(_)) => 2,
    }
}

/// Formats a case as a line of its table.
fn line(case: &Case, verdicts: &[Verdict]) -> String {
    let at = |rank: usize| verdicts.iter().filter(move |verdict| verdict.rank == rank);
    let ranks = 0..case.severities.len();
    let is_held = |rank: &usize| at(*rank).all(|verdict| verdict.outcome == Outcome::Stable);
    let held = ranks.clone().take_while(is_held).count();
    let outcomes: Vec<String> = ranks
        .filter(|rank| !is_held(rank))
        .map(|rank| {
            let letters: String = at(rank).map(|verdict| LETTERS[self::rank(verdict)]).collect();
            format!("{} `{letters}`", short(case.severities[rank]))
        })
        .collect();
    let to =
        |count: usize| count.checked_sub(1).map_or("–".into(), |i| short(case.severities[i]));
    let first = verdicts.iter().find(|verdict| verdict.outcome != Outcome::Stable);
    let mut beyond = first.map_or(String::new(), |verdict| match &verdict.outcome {
        Outcome::Stable => String::new(),
        Outcome::Faulted(words) | Outcome::Wrong(words) => cut(words),
    });
    if verdicts.iter().any(|verdict| rank(verdict) == 2) {
        beyond += &format!(" ({})", case.known);
    }
    format!(
        "|**{}**: {}|{}|{}–{}|{}|{}|{}|{}|\n",
        case.name,
        case.why,
        case.severity,
        short(case.severities[0]),
        short(case.severities[case.severities.len() - 1]),
        to(case.holds),
        to(held),
        outcomes.join(", "),
        beyond.replace('|', "\\|").replace('\n', " ")
    )
}

/// Margins of the nominal scene's stiffness at its time step.
#[cfg(feature = "mujoco")]
fn margins() -> String {
    use super::stiff_press::{TOLERANCE, stiffness_margin};
    let step_s = palpate::sim::solver::SolverSettings::default().step_s;
    let mut text = format!(
        "\n## Margin of stiffness\n\nThe PA-10 with the default skin at a time step of {} ms, force at rest within {} % of a refined \
         run:\n\n",
        1e3 * step_s,
        100.0 * TOLERANCE
    );
    for (steps, divided) in [
        ("steps as given", false),
        ("steps divided where the skin needs it, as those of a scene are", true),
    ] {
        let (times, beyond) = stiffness_margin(step_s, divided);
        let beyond = beyond.map_or("no stiffer skin was tried".into(), |(beyond, why)| {
            format!("at {beyond} times {why}")
        });
        text += &format!("* {steps}: {times} times stiffer; {beyond}\n");
    }
    text
}

#[cfg(not(feature = "mujoco"))]
fn margins() -> String {
    String::new()
}

/// Returns the start of a message, because some contain a whole state.
fn cut(words: &str) -> String {
    const MOST: usize = 30;
    // A fault's state follows "with".
    let words = words.split(" with ").next().unwrap_or(words);
    match words.chars().count() > MOST {
        true => words.chars().take(MOST).chain(['…']).collect(),
        false => words.into(),
    }
}

/// Formats a number with few characters.
pub fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-3..1e5).contains(&size) => value.to_string(),
        _ => format!("{value:e}"),
    }
}
