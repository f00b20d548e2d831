//! A hard case: what makes it hard, how hard it gets, and the law it must keep.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// What is varied beside the severity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeAxis {
    /// Nothing; what moves does so at [`nominal_s`](Self::nominal_s).
    Untimed,
    /// The control period.
    Period,
    /// The time step of a body with masses.
    Step,
}

impl TimeAxis {
    /// Its values.
    pub fn values_s(self) -> &'static [f64] {
        match self {
            Self::Untimed => &[0.01],
            Self::Period => &[0.00025, 0.001, 0.002, 0.005, 0.01, 0.02],
            Self::Step => &[0.00025, 0.0005, 0.001, 0.002],
        }
    }

    /// The value of a scene that says nothing, and of every case in the tests.
    pub fn nominal_s(self) -> f64 {
        match self {
            Self::Untimed | Self::Period => 0.01,
            Self::Step => 0.002,
        }
    }

    /// As tables name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Untimed => "",
            Self::Period => "control period",
            Self::Step => "time step",
        }
    }
}

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
    /// What else matters.
    pub axis: TimeAxis,
    /// Runs it at a severity and a value of the axis.
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
    /// Value on the case's axis.
    pub axis_s: f64,
    /// How it ended.
    pub outcome: Outcome,
    /// Whether it had to be so, or may.
    pub explained: bool,
}

/// A case that is never wrong without a fault and depends on no time.
pub const fn case(
    name: &'static str,
    why: &'static str,
    severity: &'static str,
    (severities, holds): (&'static [f64], usize),
    law: fn(f64, f64) -> Outcome,
) -> Case {
    Case { name, why, severity, severities, holds, known: "", axis: TimeAxis::Untimed, law }
}

impl Case {
    /// The same, run at every control period.
    pub const fn timed(self) -> Self {
        Self { axis: TimeAxis::Period, ..self }
    }

    /// The same, run at every time step.
    #[cfg(feature = "mujoco")]
    pub const fn stepped(self) -> Self {
        Self { axis: TimeAxis::Step, ..self }
    }

    /// The same, which beyond its severities may be wrong without a fault, and `why`.
    pub const fn known(self, why: &'static str) -> Self {
        Self { known: why, ..self }
    }

    /// Runs one severity; a panic breaks every law.
    pub fn run(&self, rank: usize, axis_s: f64) -> Verdict {
        let severity = self.severities.get(rank).copied().unwrap_or(f64::NAN);
        let outcome = catch_unwind(AssertUnwindSafe(|| (self.law)(severity, axis_s)))
            .unwrap_or_else(|_| Outcome::Wrong("panicked".into()));
        let explained = match &outcome {
            Outcome::Stable => true,
            Outcome::Faulted(_) => rank >= self.holds,
            Outcome::Wrong(_) => rank >= self.holds && !self.known.is_empty(),
        };
        Verdict { rank, axis_s, outcome, explained }
    }
}

/// Stable if `condition` is true, else wrong with `what`.
pub fn require(condition: bool, what: impl FnOnce() -> String) -> Outcome {
    if condition { Outcome::Stable } else { Outcome::Wrong(what()) }
}

/// The first that is not stable.
pub fn all(outcomes: impl IntoIterator<Item = Outcome>) -> Outcome {
    let mut outcomes = outcomes.into_iter();
    outcomes.find(|outcome| *outcome != Outcome::Stable).unwrap_or(Outcome::Stable)
}
