//! The table of measures: the numbers by which trials are compared, and how each is reported.
//!
//! A measure is an entry of [`MEASURES`]. The columns of `summary.csv` with their intervals, the
//! lines of `comparison.csv`, the panels of the convergence figure, the tables of the page and the
//! names that a claim may use all follow from that entry.

pub mod metrics;
pub mod outline;
pub mod shape;

use self::Direction::{Less, More, Neither};
use self::metrics::{Metrics, calibration, rmse};
use self::outline::Outline;
use self::shape::ShapeMetrics;
use crate::experiment::trial::row::{TouchRow, TrialRow, VerificationRow};
use std::fmt;

/// Every measure, in the order of columns and panels; to add one, give it an entry here.
pub static MEASURES: &[Measure] = &[
    R,
    CENTRED_R,
    RMSE,
    EDGE_RMSE,
    measure(Less, "reachable_rmse_m", "RMSE where the finger reaches", MM)
        .from(Source::Metrics(|it| it.reachable_rmse_m))
        .aggregated(Aggregate::Median)
        .drawn(Scale::LogBeside(&UNREACHABLE_RMSE))
        .untabled()
        .error(),
    UNREACHABLE_RMSE,
    measure(Less, "max_error_m", "largest error", MM)
        .from(Source::Metrics(|it| Some(it.max_error_m)))
        .aggregated(Aggregate::Median),
    COVERAGE,
    measure(Less, "coverage_off", "share in the 95 % band, away from 0.95", SHARE)
        .from(Source::Metrics(|it| Some((it.coverage? - HONEST).abs())))
        .untabled(),
    measure(Less, "nlpd", "NLPD", PLAIN).from(Source::Metrics(|it| it.nlpd)),
    measure(Less, "presence_brier", "Brier score of where there is a surface", SHARE)
        .from(Source::Outline(|it| Some(it.brier))),
    measure(More, "silhouette_iou", "silhouette, intersection over union", SHARE)
        .from(Source::Outline(|it| Some(it.iou)))
        .drawn(Scale::UpToOne),
    measure(
        Less,
        "silhouette_wrong",
        "share of the zone on the wrong side of the silhouette",
        SHARE,
    )
    .from(Source::Outline(|it| Some(it.wrong_share)))
    .untabled(),
    CHAMFER,
    measure(Less, "chamfer_share", "Chamfer distance, of the diagonal", PERCENT)
        .from(Source::Shape(|it| it.chamfer_share)),
    measure(Less, "reachable_chamfer_m", "distance of what the finger reaches", MM)
        .from(Source::Shape(|it| it.reachable_chamfer_m))
        .aggregated(Aggregate::Median)
        .untabled(),
    measure(More, "f_1", "F-score at 1 % of the diagonal", SHARE)
        .from(Source::Shape(|it| Some(it.f_1)))
        .drawn(Scale::UpToOne),
    measure(More, "f_3", "F-score at 3 % of the diagonal", SHARE)
        .from(Source::Shape(|it| Some(it.f_3))),
    measure(Neither, "volume_error", "believed volume, too much", PERCENT)
        .from(Source::Shape(|it| it.volume_error)),
    measure(Neither, "area_error", "believed area, too much", PERCENT)
        .from(Source::Shape(|it| Some(it.area_error))),
    measure(More, "iou", "insides, intersection over union", SHARE)
        .from(Source::Shape(|it| it.iou))
        .drawn(Scale::UpToOne),
    measure(
        Neither,
        "shape_coverage",
        "share of the surface within two standard deviations",
        SHARE,
    )
    .from(Source::Shape(|it| it.coverage))
    .drawn(Scale::UpToOne),
    measure(Less, "path_m", "lateral travel", METRES)
        .from(Source::Trial(TrialRow::path_m))
        .drawn(Scale::Linear),
    measure(Less, "time_s", "time of the body", SECONDS).from(Source::Touch(|it| it.time_s)),
    VERIFICATION_RMSE,
    measure(Less, "verification_nlpd", "NLPD at verification touches", PLAIN)
        .from(Source::Trial(|row, n| predicted(row, n)?.1)),
    VERIFICATION_COVERAGE,
    measure(Less, "verification_missed", "verification touches without contact", SHARE)
        .from(Source::Trial(missed)),
    REPEATABILITY,
    measure(Neither, "length_scale_x_m", "length scale along x", MM)
        .from(Source::Touch(|it| length_scale(it, 0)))
        .aggregated(Aggregate::Median)
        .untabled(),
    measure(Neither, "length_scale_z_m", "length scale along z", MM)
        .from(Source::Touch(|it| length_scale(it, 1)))
        .aggregated(Aggregate::Median)
        .untabled(),
];

/// The share of the truth that an honest 95 % band holds.
const HONEST: f64 = 0.95;

/// Eq. 5 of Yi et al. 2016.
pub const R: Measure = measure(More, "r", "R (Eq. 5)", CORRELATION)
    .from(Source::Metrics(|it| Some(it.r)))
    .drawn(Scale::UpToOne);

/// The same after subtracting each one's mean.
pub const CENTRED_R: Measure = measure(More, "centred_r", "centred R", CORRELATION)
    .from(Source::Metrics(|it| Some(it.centred_r)))
    .drawn(Scale::UpToOne);

/// Root mean square error.
pub const RMSE: Measure = measure(Less, "rmse_m", "RMSE", MM)
    .from(Source::Metrics(|it| Some(it.rmse_m)))
    .aggregated(Aggregate::Both)
    .drawn(Scale::Log)
    .error();

/// Root mean square error in the outer tenth of the zone.
pub const EDGE_RMSE: Measure = measure(Less, "edge_rmse_m", "RMSE in the outer tenth", MM)
    .from(Source::Metrics(|it| it.edge_rmse_m))
    .aggregated(Aggregate::Median)
    .drawn(Scale::Log)
    .error();

const UNREACHABLE_RMSE: Measure =
    measure(Less, "unreachable_rmse_m", "RMSE where it does not reach", MM)
        .from(Source::Metrics(|it| it.unreachable_rmse_m))
        .aggregated(Aggregate::Median)
        .untabled();

/// Share of the truth inside the 95 % band.
pub const COVERAGE: Measure = measure(Neither, "coverage", "share in the 95 % band", SHARE)
    .from(Source::Metrics(|it| it.coverage))
    .drawn(Scale::UpToOne);

/// Chamfer distance between the believed and the true surface of a whole object.
pub const CHAMFER: Measure = measure(Less, "chamfer_m", "Chamfer distance", MM)
    .from(Source::Shape(|it| it.chamfer_m))
    .aggregated(Aggregate::Both)
    .drawn(Scale::Log)
    .error();

/// Root mean square error at touches that the last belief predicted and did not learn from.
pub const VERIFICATION_RMSE: Measure =
    measure(Less, "verification_rmse_m", "RMSE at verification touches", MM)
        .from(Source::Trial(|row, n| rmse(verified(row, n)?.filter_map(|touch| touch.error_m))))
        .aggregated(Aggregate::Both);

/// Share of verification touches inside the 95 % band.
pub const VERIFICATION_COVERAGE: Measure =
    measure(Neither, "verification_coverage", "verification touches in the 95 % band", SHARE)
        .from(Source::Trial(|row, n| predicted(row, n)?.0));

/// Root mean square difference of a touch from the one it repeats.
pub const REPEATABILITY: Measure =
    measure(Less, "repeatability_m", "difference of repeated touches", MM)
        .from(Source::Trial(|row, n| {
            rmse(verification(row, n)?.iter().filter_map(|touch| touch.difference_m))
        }))
        .aggregated(Aggregate::Both);

fn length_scale(touch: &TouchRow, axis: usize) -> Option<f64> {
    touch.fit.as_ref()?.hyperparameters.length_scales.get(axis).copied()
}

/// The touches after the last of a trial; `None` unless that is number `touches`.
fn verification(row: &TrialRow, touches: u32) -> Option<&[VerificationRow]> {
    (row.touches.len() == touches as usize).then_some(&row.verification)
}

/// Those at new places.
fn verified(row: &TrialRow, touches: u32) -> Option<impl Iterator<Item = &VerificationRow>> {
    Some(verification(row, touches)?.iter().filter(|touch| touch.again.is_none()))
}

/// Coverage and NLPD of the errors at verification touches.
fn predicted(row: &TrialRow, touches: u32) -> Option<(Option<f64>, Option<f64>)> {
    let errors = verified(row, touches)?.filter_map(|touch| touch.error_m.zip(touch.sd_m));
    Some(calibration(errors.map(|(error, sd)| (error, sd * sd))))
}

/// The share of verification touches that met nothing or were broken off.
fn missed(row: &TrialRow, touches: u32) -> Option<f64> {
    let (mut count, mut missed) = (0.0, 0.0);
    for touch in verified(row, touches)? {
        count += 1.0;
        missed += f64::from(u8::from(touch.contact.is_none()));
    }
    (count > 0.0).then(|| missed / count)
}

/// The measures that have columns in files about `rows`.
pub fn in_files(rows: &[TrialRow]) -> impl Iterator<Item = &'static Measure> {
    let has_shape = rows.iter().flat_map(|row| &row.touches).any(|touch| touch.shape.is_some());
    MEASURES.iter().filter(move |measure| has_shape || !measure.is_of_shapes())
}

/// The measure of a name in files.
pub fn by_id(id: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.id == id)
}

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
    /// What it is computed from.
    pub source: Source,
}

/// The part of a row that a measure is computed from; a measure has no value where that is missing.
#[derive(Clone, Copy)]
pub enum Source {
    /// The agreement of heights with the truth after a touch.
    Metrics(fn(&Metrics) -> Option<f64>),
    /// The agreement of silhouettes after a touch.
    Outline(fn(&Outline) -> Option<f64>),
    /// The agreement of closed surfaces after a touch: such a measure has no columns in files of
    /// runs that explore a zone.
    Shape(fn(&ShapeMetrics) -> Option<f64>),
    /// A touch.
    Touch(fn(&TouchRow) -> Option<f64>),
    /// A trial and a count of touches.
    Trial(fn(&TrialRow, u32) -> Option<f64>),
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
    /// The smallest and the largest value that a row may have, in the SI unit.
    pub range: [f64; 2],
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

/// Farthest that a place or an error can be, m.
// heuristic: no robot reaches a thousandth of it.
pub(super) const FAR_M: f64 = 1e6;

/// Largest number without a unit that a measure can come to, apart from shares and correlations.
// heuristic: the negative log density of a belief that is far too sure of itself; no larger one has
// been computed from finite numbers.
const LARGE: f64 = 1e300;

const PLAIN: Unit =
    Unit { suffix: "", symbol: "", per_si: 1.0, decimals: 3, range: [-LARGE, LARGE] };
const CORRELATION: Unit = Unit { decimals: 4, range: [-1.000_001, 1.000_001], ..PLAIN };
const SHARE: Unit = Unit { range: [0.0, 1.000_001], ..PLAIN };
const PERCENT: Unit = Unit { symbol: "%", per_si: 100.0, range: [-FAR_M, FAR_M], ..PLAIN };
/// Metres.
pub const METRES: Unit = Unit { suffix: "_m", symbol: "m", range: [0.0, FAR_M], ..PLAIN };
const MM: Unit = Unit { symbol: "mm", per_si: 1e3, ..METRES };
const SECONDS: Unit =
    Unit { suffix: "_s", symbol: "s", decimals: 1, range: [-LARGE, LARGE], ..PLAIN };

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

    /// Its value after some touches; `None` where the trial has none.
    pub fn of(&self, row: &TrialRow, touches: u32) -> Option<f64> {
        match self.source {
            Source::Trial(of) => of(row, touches),
            _ => self.of_touch(row.touches.get((touches as usize).checked_sub(1)?)?),
        }
    }

    /// Its value after a touch; `None` of a measure of a trial.
    pub fn of_touch(&self, touch: &TouchRow) -> Option<f64> {
        match self.source {
            Source::Metrics(of) => of(touch.metrics.as_ref()?),
            Source::Outline(of) => of(touch.outline.as_ref()?),
            Source::Shape(of) => of(touch.shape.as_ref()?),
            Source::Touch(of) => of(touch),
            Source::Trial(_) => None,
        }
    }

    /// Whether it is of whole objects.
    pub fn is_of_shapes(&self) -> bool {
        matches!(self.source, Source::Shape(_))
    }

    /// Computed from this.
    const fn from(self, source: Source) -> Self {
        Self { source, ..self }
    }

    /// With these statistics over many trials.
    const fn aggregated(self, aggregate: Aggregate) -> Self {
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

    /// Marks an error, in which planners are compared after every touch.
    const fn error(self) -> Self {
        Self { is_error: true, ..self }
    }
}

impl fmt::Debug for Measure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.id)
    }
}

/// A measure whose mean is reported and tabled, and which is not drawn; `None` of every trial.
const fn measure(
    direction: Direction,
    id: &'static str,
    title: &'static str,
    unit: Unit,
) -> Measure {
    Measure {
        id,
        title,
        unit,
        direction,
        aggregate: Aggregate::Mean,
        scale: Scale::Undrawn,
        is_tabled: true,
        is_error: false,
        source: Source::Trial(|_, _| None),
    }
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
