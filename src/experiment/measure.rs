//! The table of measures: what trials are judged by, and how each of them is told.
//!
//! A measure is a line of [`MEASURES`]. The columns of `summary.csv` with their intervals, the
//! lines of `comparison.csv`, the panels of the convergence figure, the tables of the page and the
//! names that a claim may use all follow from that line.

use super::metrics::Metrics;
use super::row::{TouchRow, TrialRow};
use super::shape::ShapeMetrics;
use super::verified;
use std::fmt;

/// A number of a trial after some touches, in SI units.
#[derive(Clone, Copy)]
pub struct Measure {
    /// Its name in files, unit last.
    pub id: &'static str,
    /// Its name in words.
    pub title: &'static str,
    /// What it is measured and shown in.
    pub unit: Unit,
    /// Which way is better.
    pub direction: Direction,
    /// What is told of it over many trials.
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

/// Which way is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Less of it.
    Less,
    /// More of it.
    More,
    /// Neither: a fact, in which planners are not compared.
    Neither,
}

/// What is told of many trials.
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
    /// Whether the mean is told.
    pub fn has_mean(self) -> bool {
        self != Self::Median
    }

    /// Whether the median is told.
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

const CORRELATION: Unit = Unit { suffix: "", symbol: "", per_si: 1.0, decimals: 4 };
const PLAIN: Unit = Unit { decimals: 3, ..CORRELATION };
const PERCENT: Unit = Unit { symbol: "%", per_si: 100.0, ..PLAIN };
const MM: Unit = Unit { suffix: "_m", symbol: "mm", per_si: 1e3, decimals: 3 };
const METRES: Unit = Unit { suffix: "_m", symbol: "m", per_si: 1.0, decimals: 3 };
const SECONDS: Unit = Unit { suffix: "_s", symbol: "s", per_si: 1.0, decimals: 1 };

/// The share of the truth that an honest 95 % band holds.
const HONEST: f64 = 0.95;

/// Eq. 5 of Yi et al. 2016.
pub const R: Measure =
    more("r", "R (Eq. 5)", CORRELATION, |row, n| Some(metrics(row, n)?.r)).drawn(Scale::UpToOne);
/// The same after subtracting each one's mean.
pub const CENTRED_R: Measure =
    more("centred_r", "centred R", CORRELATION, |row, n| Some(metrics(row, n)?.centred_r))
        .drawn(Scale::UpToOne);
/// Root mean square error.
pub const RMSE: Measure = less("rmse_m", "RMSE", MM, |row, n| Some(metrics(row, n)?.rmse_m))
    .told(Aggregate::Both)
    .drawn(Scale::Log)
    .error();
/// Root mean square error in the outer tenth of the zone.
pub const EDGE_RMSE: Measure =
    less("edge_rmse_m", "RMSE in the outer tenth", MM, |row, n| metrics(row, n)?.edge_rmse_m)
        .told(Aggregate::Median)
        .drawn(Scale::Log)
        .error();
/// Root mean square error where the finger cannot touch the surface.
const UNREACHABLE_RMSE: Measure =
    less("unreachable_rmse_m", "RMSE where it does not reach", MM, |row, n| {
        metrics(row, n)?.unreachable_rmse_m
    })
    .told(Aggregate::Median)
    .drawn(Scale::Undrawn)
    .untabled();
/// Chamfer distance between the believed and the true surface of a whole object.
pub const CHAMFER: Measure =
    less("chamfer_m", "Chamfer distance", MM, |row, n| shape(row, n)?.chamfer_m)
        .told(Aggregate::Both)
        .drawn(Scale::Log)
        .error()
        .of_shapes();
/// Share of the truth inside the 95 % band.
pub const COVERAGE: Measure =
    fact("coverage", "share in the 95 % band", PLAIN, |row, n| metrics(row, n)?.coverage)
        .drawn(Scale::UpToOne);

/// Root mean square error at touches that the last belief predicted and did not learn from.
pub const VERIFICATION_RMSE: Measure =
    less("verification_rmse_m", "RMSE at verification touches", MM, |row, n| {
        verified::errors(row, n)?.rmse()
    })
    .told(Aggregate::Both)
    .drawn(Scale::Undrawn);
/// Share of these inside the 95 % band.
pub const VERIFICATION_COVERAGE: Measure =
    fact("verification_coverage", "verification touches in the 95 % band", PLAIN, |row, n| {
        verified::calibration(row, n)?.told().0
    })
    .drawn(Scale::Undrawn);
/// Root mean square difference of a touch from the one it repeats.
pub const REPEATABILITY: Measure =
    less("repeatability_m", "difference of repeated touches", MM, |row, n| {
        verified::differences(row, n)?.rmse()
    })
    .told(Aggregate::Both)
    .drawn(Scale::Undrawn);

/// Every measure, in the order of columns and panels; one line to add one.
pub static MEASURES: &[Measure] = &[
    R,
    CENTRED_R,
    RMSE,
    EDGE_RMSE,
    less("reachable_rmse_m", "RMSE where the finger reaches", MM, |row, n| {
        metrics(row, n)?.reachable_rmse_m
    })
    .told(Aggregate::Median)
    .drawn(Scale::LogBeside(&UNREACHABLE_RMSE))
    .untabled()
    .error(),
    UNREACHABLE_RMSE,
    less("max_error_m", "largest error", MM, |row, n| Some(metrics(row, n)?.max_error_m))
        .told(Aggregate::Median)
        .drawn(Scale::Undrawn),
    COVERAGE,
    less("coverage_off", "share in the 95 % band, away from 0.95", PLAIN, |row, n| {
        Some((metrics(row, n)?.coverage? - HONEST).abs())
    })
    .drawn(Scale::Undrawn)
    .untabled(),
    less("nlpd", "NLPD", PLAIN, |row, n| metrics(row, n)?.nlpd).drawn(Scale::Undrawn),
    less("presence_brier", "Brier score of where there is a surface", PLAIN, |row, n| {
        Some(touch(row, n)?.outline.as_ref()?.brier)
    })
    .drawn(Scale::Undrawn),
    more("silhouette_iou", "silhouette, intersection over union", PLAIN, |row, n| {
        Some(touch(row, n)?.outline.as_ref()?.iou)
    })
    .drawn(Scale::UpToOne),
    less(
        "silhouette_wrong",
        "share of the zone on the wrong side of the silhouette",
        PLAIN,
        |row, n| Some(touch(row, n)?.outline.as_ref()?.wrong_share),
    )
    .drawn(Scale::Undrawn)
    .untabled(),
    CHAMFER,
    less("chamfer_share", "Chamfer distance, of the diagonal", PERCENT, |row, n| {
        shape(row, n)?.chamfer_share
    })
    .drawn(Scale::Undrawn)
    .of_shapes(),
    less("reachable_chamfer_m", "distance of what the finger reaches", MM, |row, n| {
        shape(row, n)?.reachable_chamfer_m
    })
    .told(Aggregate::Median)
    .drawn(Scale::Undrawn)
    .untabled()
    .of_shapes(),
    more("f_1", "F-score at 1 % of the diagonal", PLAIN, |row, n| Some(shape(row, n)?.f_1))
        .drawn(Scale::UpToOne)
        .of_shapes(),
    more("f_3", "F-score at 3 % of the diagonal", PLAIN, |row, n| Some(shape(row, n)?.f_3))
        .drawn(Scale::Undrawn)
        .of_shapes(),
    fact("volume_error", "believed volume, too much", PERCENT, |row, n| {
        shape(row, n)?.volume_error
    })
    .drawn(Scale::Undrawn)
    .of_shapes(),
    fact("area_error", "believed area, too much", PERCENT, |row, n| {
        Some(shape(row, n)?.area_error)
    })
    .drawn(Scale::Undrawn)
    .of_shapes(),
    more("iou", "insides, intersection over union", PLAIN, |row, n| shape(row, n)?.iou)
        .drawn(Scale::UpToOne)
        .of_shapes(),
    fact(
        "shape_coverage",
        "share of the surface within two standard deviations",
        PLAIN,
        |row, n| shape(row, n)?.coverage,
    )
    .drawn(Scale::UpToOne)
    .of_shapes(),
    less("path_m", "lateral travel", METRES, TrialRow::path_m),
    less("time_s", "time of the body", SECONDS, |row, n| touch(row, n)?.time_s)
        .drawn(Scale::Undrawn),
    VERIFICATION_RMSE,
    less("verification_nlpd", "NLPD at verification touches", PLAIN, |row, n| {
        verified::calibration(row, n)?.told().1
    })
    .drawn(Scale::Undrawn),
    VERIFICATION_COVERAGE,
    less("verification_missed", "verification touches without contact", PLAIN, |row, n| {
        verified::missed(row, n)
    })
    .drawn(Scale::Undrawn),
    REPEATABILITY,
    length_scale("length_scale_x_m", "length scale along x", |row, n| length_along(row, n, 0)),
    length_scale("length_scale_z_m", "length scale along z", |row, n| length_along(row, n, 1)),
];

/// The measures that have columns in files about `rows`.
pub fn in_files(rows: &[TrialRow]) -> impl Iterator<Item = &'static Measure> {
    let has_shape = rows.iter().flat_map(|row| &row.touches).any(|touch| touch.shape.is_some());
    MEASURES.iter().filter(move |measure| has_shape || !measure.is_of_shapes)
}

/// The measure of a name in files.
pub fn by_id(id: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.id == id)
}

impl Measure {
    /// The columns of what is told of it over many trials: its mean with the standard error, its
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
    const fn told(self, aggregate: Aggregate) -> Self {
        Self { aggregate, ..self }
    }

    /// Drawn like this.
    const fn drawn(self, scale: Scale) -> Self {
        Self { scale, ..self }
    }

    /// In files only.
    const fn untabled(self) -> Self {
        Self { is_tabled: false, ..self }
    }

    /// Of whole objects.
    const fn of_shapes(self) -> Self {
        Self { is_of_shapes: true, ..self }
    }

    /// As an error.
    const fn error(self) -> Self {
        Self { is_error: true, ..self }
    }
}

impl fmt::Debug for Measure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.id)
    }
}

type Value = fn(&TrialRow, u32) -> Option<f64>;

/// A measure of which less is better: its mean, drawn and tabled.
const fn less(id: &'static str, title: &'static str, unit: Unit, of: Value) -> Measure {
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
const fn more(id: &'static str, title: &'static str, unit: Unit, of: Value) -> Measure {
    Measure { direction: Direction::More, ..less(id, title, unit, of) }
}

/// The same of which neither is better.
const fn fact(id: &'static str, title: &'static str, unit: Unit, of: Value) -> Measure {
    Measure { direction: Direction::Neither, ..less(id, title, unit, of) }
}

const fn length_scale(id: &'static str, title: &'static str, of: Value) -> Measure {
    fact(id, title, MM, of).told(Aggregate::Median).drawn(Scale::Undrawn).untabled()
}

fn touch(row: &TrialRow, count: u32) -> Option<&TouchRow> {
    row.touches.get((count as usize).checked_sub(1)?)
}

fn metrics(row: &TrialRow, count: u32) -> Option<&Metrics> {
    touch(row, count)?.metrics.as_ref()
}

fn shape(row: &TrialRow, count: u32) -> Option<&ShapeMetrics> {
    touch(row, count)?.shape.as_ref()
}

fn length_along(row: &TrialRow, count: u32, axis: usize) -> Option<f64> {
    let fit = touch(row, count)?.fit.as_ref()?;
    fit.hyperparameters.length_scales.get(axis).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names end with their unit and stand once, so that every column does.
    #[test]
    fn names_are_regular() {
        for (i, measure) in MEASURES.iter().enumerate() {
            assert!(measure.id.ends_with(measure.unit.suffix), "{measure:?}");
            assert_eq!(by_id(measure.id).unwrap().title, measure.title);
            assert!(MEASURES[..i].iter().all(|other| other.id != measure.id), "{measure:?}");
        }
        assert_eq!(RMSE.column("median"), "rmse_median_m");
        assert_eq!(R.column("mean"), "r_mean");
    }
}
