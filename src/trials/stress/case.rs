//! A hard case: what makes it hard, how hard it gets, and the law it must keep.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Control periods at which a case that depends on them is run.
pub const PERIODS_S: [f64; 6] = [0.00025, 0.001, 0.002, 0.005, 0.01, 0.02];

/// The period of a case that does not depend on it, and of every case in the tests.
pub const PERIOD_S: f64 = 0.01;

/// A hard case.
pub struct Case {
    /// One or more words.
    pub name: &'static str,
    /// Why it is hard.
    pub why: &'static str,
    /// What its severity is, with its unit.
    pub severity: &'static str,
    /// Rising.
    pub severities: &'static [f64],
    /// How many of the severities must be stable; a fault beyond is what should happen.
    pub holds: usize,
    /// Why it may be wrong beyond these without a fault; empty if it may not.
    pub known: &'static str,
    /// Whether the control period matters.
    pub timed: bool,
    /// Runs it at a severity and period.
    pub law: fn(f64, f64) -> Outcome,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The law was kept.
    Stable,
    /// It ended with a fault, which says when and in what state, or was refused at the start.
    Faulted(String),
    /// The law was broken and nothing said so.
    Wrong(String),
}

/// An outcome beside what was promised.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// Index among the case's severities.
    pub rank: usize,
    /// Control period.
    pub period_s: f64,
    /// How it ended.
    pub outcome: Outcome,
    /// Whether it had to be so, or may.
    pub explained: bool,
}

/// A case that is never wrong without a fault and does not depend on the control period.
pub(super) const fn case(
    name: &'static str,
    why: &'static str,
    severity: &'static str,
    (severities, holds): (&'static [f64], usize),
    law: fn(f64, f64) -> Outcome,
) -> Case {
    Case { name, why, severity, severities, holds, known: "", timed: false, law }
}

impl Case {
    /// The same, run at every control period.
    pub(super) const fn timed(self) -> Self {
        Self { timed: true, ..self }
    }

    /// The same, which beyond its severities may be wrong without a fault, and `why`.
    pub(super) const fn known(self, why: &'static str) -> Self {
        Self { known: why, ..self }
    }

    /// Runs one severity; a panic breaks every law.
    pub fn run(&self, rank: usize, period_s: f64) -> Verdict {
        let severity = self.severities.get(rank).copied().unwrap_or(f64::NAN);
        let outcome = catch_unwind(AssertUnwindSafe(|| (self.law)(severity, period_s)))
            .unwrap_or_else(|_| Outcome::Wrong("panicked".into()));
        let explained = match &outcome {
            Outcome::Stable => true,
            Outcome::Faulted(_) => rank >= self.holds,
            Outcome::Wrong(_) => rank >= self.holds && !self.known.is_empty(),
        };
        Verdict { rank, period_s, outcome, explained }
    }

    /// The periods it is run at.
    pub fn periods_s(&self) -> &'static [f64] {
        if self.timed { &PERIODS_S } else { &[PERIOD_S] }
    }
}

/// Stable if `condition`, else wrong with `what`.
pub(super) fn hold(condition: bool, what: impl FnOnce() -> String) -> Outcome {
    if condition { Outcome::Stable } else { Outcome::Wrong(what()) }
}

/// The first that is not stable.
pub(super) fn all(outcomes: impl IntoIterator<Item = Outcome>) -> Outcome {
    let mut outcomes = outcomes.into_iter();
    outcomes.find(|outcome| *outcome != Outcome::Stable).unwrap_or(Outcome::Stable)
}
