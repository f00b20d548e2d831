//! A hard case: its difficulty, its severities, and the law that it must obey.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Time parameter that is varied in addition to the severity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeAxis {
    /// No time parameter; moving bodies use [`nominal_s`](Self::nominal_s).
    Untimed,
    /// Control period.
    Period,
    /// Time step of a body with masses.
    Step,
}

impl TimeAxis {
    /// Values of the time parameter.
    pub fn values_s(self) -> &'static [f64] {
        match self {
            Self::Untimed => &[0.01],
            Self::Period => &[0.00025, 0.001, 0.002, 0.005, 0.01, 0.02],
            Self::Step => &[0.00025, 0.0005, 0.001, 0.002],
        }
    }

    /// Default value in a scene, used by every case in the tests.
    pub fn nominal_s(self) -> f64 {
        match self {
            Self::Untimed | Self::Period => 0.01,
            Self::Step => 0.002,
        }
    }

    /// Name in tables.
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
    /// Name, one or more words.
    pub name: &'static str,
    /// Reason for the difficulty.
    pub why: &'static str,
    /// Meaning of the severity, with its unit.
    pub severity: &'static str,
    /// Severities, increasing.
    pub severities: &'static [f64],
    /// Number of severities that must be stable; a fault is expected beyond.
    pub holds: usize,
    /// Reason for wrong results without a fault beyond these; empty if there must be none.
    pub known: &'static str,
    /// Time parameter that is varied.
    pub axis: TimeAxis,
    /// Runs the case at a severity and a value of the time parameter.
    pub law: fn(f64, f64) -> Outcome,
}

/// Outcome of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The law holds.
    Stable,
    /// The run ended with a fault that gives time and state, or was rejected at the start.
    Faulted(String),
    /// The law was violated without a fault.
    Wrong(String),
}

/// Outcome of a run, compared with the expected one.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// Index of the severity in the case's list.
    pub rank: usize,
    /// Value of the time parameter.
    pub axis_s: f64,
    /// Outcome of the run.
    pub outcome: Outcome,
    /// Whether the outcome is required or allowed.
    pub explained: bool,
}

/// Creates a case that is never wrong without a fault and has no time parameter.
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
    /// Runs the case at every control period.
    pub const fn timed(self) -> Self {
        Self { axis: TimeAxis::Period, ..self }
    }

    /// Runs the case at every time step.
    #[cfg(feature = "mujoco")]
    pub const fn stepped(self) -> Self {
        Self { axis: TimeAxis::Step, ..self }
    }

    /// Allows wrong results without a fault beyond the required severities, for the reason `why`.
    pub const fn known(self, why: &'static str) -> Self {
        Self { known: why, ..self }
    }

    /// Runs one severity; a panic violates every law.
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

/// Returns `Stable` if `condition` is true, otherwise `Wrong` with `what`.
pub fn require(condition: bool, what: impl FnOnce() -> String) -> Outcome {
    if condition { Outcome::Stable } else { Outcome::Wrong(what()) }
}

/// Returns the first outcome that is not stable.
pub fn all(outcomes: impl IntoIterator<Item = Outcome>) -> Outcome {
    let mut outcomes = outcomes.into_iter();
    outcomes.find(|outcome| *outcome != Outcome::Stable).unwrap_or(Outcome::Stable)
}
