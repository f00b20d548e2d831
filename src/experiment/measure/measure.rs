//! A measure: its names, its unit, how it is aggregated and drawn, and how it is computed of a row.

use super::metrics::Metrics;
use super::shape::ShapeMetrics;
use crate::experiment::trial::row::{TouchRow, TrialRow};
use std::fmt;

/// A number of a trial after some touches, in SI units.
#[derive(Clone, Copy)]
pub struct Measure {
    /// Its name in files, unit last.
    pub id: &'static str,
    /// Its name in words.
    pub title: &'static str,
    /// Its unit, in files and for readers.
    pub unit: Unit,
    /// Whether less or more of it is better.
    pub direction: Direction,
    /// The statistics reported of it over many trials.
    pub aggregate: Aggregate,
    /// How it is drawn over touches.
    pub scale: Scale,
    /// Whether it stands in the summary on the terminal and on the page.
    pub is_tabled: bool,
    /// Whether it is an error, so that planners are compared in it after every touch, and in the
    /// touches that they need to bring it down.
    pub is_error: bool,
    /// Whether it is of whole objects: it has no columns in files of runs that explore a zone.
    pub is_of_shapes: bool,
    /// Its value after some touches; none where the trial has none.
    pub of: fn(&TrialRow, u32) -> Option<f64>,
}

/// A unit in files and for readers.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    /// How names in files end that are in it.
    pub suffix: &'static str,
    /// The symbol of the unit that readers are shown.
    pub symbol: &'static str,
    /// How many of that make one of the SI unit.
    pub per_si: f64,
    /// Decimals shown.
    pub decimals: usize,
}

/// Whether less or more of a measure is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Less of it.
    Less,
    /// More of it.
    More,
    /// Neither: a fact, in which planners are not compared.
    Neither,
}

/// The statistics reported of many trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aggregate {
    /// The mean with its standard error.
    Mean,
    /// The median with its bootstrap interval.
    Median,
    /// Both; where there is room for one, the median.
    Both,
}

impl Aggregate {
    /// Whether the mean is reported.
    pub fn has_mean(self) -> bool {
        self != Self::Median
    }

    /// Whether the median is reported.
    pub fn has_median(self) -> bool {
        self != Self::Mean
    }
}

/// How a measure is drawn over touches, in a panel of its own.
#[derive(Clone, Copy, Debug)]
pub enum Scale {
    /// Not at all.
    Undrawn,
    /// On a linear axis.
    Linear,
    /// On a linear axis that shows 1, the best there is.
    UpToOne,
    /// On a logarithmic axis.
    Log,
    /// The same with another measure dotted beside it; not at all where that has no value.
    LogBeside(&'static Measure),
}

pub(super) const CORRELATION: Unit = Unit { suffix: "", symbol: "", per_si: 1.0, decimals: 4 };
pub(super) const PLAIN: Unit = Unit { decimals: 3, ..CORRELATION };
pub(super) const PERCENT: Unit = Unit { symbol: "%", per_si: 100.0, ..PLAIN };
pub(super) const MM: Unit = Unit { suffix: "_m", symbol: "mm", per_si: 1e3, decimals: 3 };
/// Metres.
pub const METRES: Unit = Unit { suffix: "_m", symbol: "m", per_si: 1.0, decimals: 3 };
pub(super) const SECONDS: Unit = Unit { suffix: "_s", symbol: "s", per_si: 1.0, decimals: 1 };

impl Measure {
    /// The columns of its statistics over many trials: its mean with the standard error, its
    /// median with the ends of its interval.
    pub fn columns(&self) -> Vec<String> {
        let mut statistics = Vec::new();
        if self.aggregate.has_mean() {
            statistics.extend(["mean", "se"]);
        }
        if self.aggregate.has_median() {
            statistics.extend(["median", "median_low", "median_high"]);
        }
        statistics.into_iter().map(|statistic| self.column(statistic)).collect()
    }

    /// A column of a file that holds `statistic` of it: the statistic stands before the unit.
    pub fn column(&self, statistic: &str) -> String {
        format!("{}_{statistic}{}", self.stem(), self.unit.suffix)
    }

    /// Its name in files without the unit.
    pub fn stem(&self) -> &'static str {
        self.id.strip_suffix(self.unit.suffix).unwrap_or(self.id)
    }

    /// With these statistics told of many trials.
    pub(super) const fn told(self, aggregate: Aggregate) -> Self {
        Self { aggregate, ..self }
    }

    /// Drawn like this.
    pub(super) const fn drawn(self, scale: Scale) -> Self {
        Self { scale, ..self }
    }

    /// In files only.
    pub(super) const fn untabled(self) -> Self {
        Self { is_tabled: false, ..self }
    }

    /// Marks a measure of whole objects.
    pub(super) const fn of_shapes(self) -> Self {
        Self { is_of_shapes: true, ..self }
    }

    /// Marks an error, in which planners are compared after every touch.
    pub(super) const fn error(self) -> Self {
        Self { is_error: true, ..self }
    }
}

impl fmt::Debug for Measure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.id)
    }
}

pub(super) type Value = fn(&TrialRow, u32) -> Option<f64>;

/// A measure of which less is better: its mean, drawn and tabled.
pub(super) const fn less(id: &'static str, title: &'static str, unit: Unit, of: Value) -> Measure {
    Measure {
        id,
        title,
        unit,
        direction: Direction::Less,
        aggregate: Aggregate::Mean,
        scale: Scale::Linear,
        is_tabled: true,
        is_error: false,
        is_of_shapes: false,
        of,
    }
}

/// The same of which more is better.
pub(super) const fn more(id: &'static str, title: &'static str, unit: Unit, of: Value) -> Measure {
    Measure { direction: Direction::More, ..less(id, title, unit, of) }
}

/// The same of which neither is better.
pub(super) const fn fact(id: &'static str, title: &'static str, unit: Unit, of: Value) -> Measure {
    Measure { direction: Direction::Neither, ..less(id, title, unit, of) }
}

pub(super) const fn length_scale(id: &'static str, title: &'static str, of: Value) -> Measure {
    fact(id, title, MM, of).told(Aggregate::Median).drawn(Scale::Undrawn).untabled()
}

pub(super) fn touch(row: &TrialRow, count: u32) -> Option<&TouchRow> {
    row.touches.get((count as usize).checked_sub(1)?)
}

pub(super) fn metrics(row: &TrialRow, count: u32) -> Option<&Metrics> {
    touch(row, count)?.metrics.as_ref()
}

pub(super) fn shape(row: &TrialRow, count: u32) -> Option<&ShapeMetrics> {
    touch(row, count)?.shape.as_ref()
}

pub(super) fn length_along(row: &TrialRow, count: u32, axis: usize) -> Option<f64> {
    let fit = touch(row, count)?.fit.as_ref()?;
    fit.hyperparameters.length_scales.get(axis).copied()
}
