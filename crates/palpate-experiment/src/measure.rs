//! Measures of trials: errors, calibration and effort, and how each is reported.
//!
//! A measure is an entry of [`MEASURES`]. The entry determines the columns of `summary.csv` with
//! their intervals, the lines of `comparison.csv`, the panels of the convergence figure, the tables
//! of the page, and the names that a claim may use.

use self::Direction::{Maximise, Minimise, Undirected};
use crate::metrics::recognition::RecognitionMetrics;
use crate::metrics::shape::ShapeMetrics;
use crate::metrics::silhouette::SilhouetteMetrics;
use crate::metrics::{Metrics, coverage, nlpd, rmse};
use crate::row::{TouchRow, TrialRow, VerificationRow};
use palpate_gp::math::normal::BAND_95;
use std::fmt;

/// All measures, in the order of columns and panels. Add an entry here to add a measure.
pub static MEASURES: &[Measure] = &[
    R,
    CENTRED_R,
    RMSE,
    EDGE_RMSE,
    REACHABLE_RMSE,
    UNREACHABLE_RMSE,
    measure(Minimise, "max_error_m", "maximum error", MM)
        .from(Source::Metrics(|it| Some(it.max_error_m)))
        .aggregated(Aggregate::Median),
    COVERAGE,
    measure(Minimise, "coverage_error", "coverage error of the 95 % band", SHARE)
        .from(Source::Metrics(|it| Some((it.coverage? - CALIBRATED_COVERAGE).abs())))
        .untabled(),
    measure(Undirected, "reachable_coverage", "coverage, reachable", SHARE)
        .from(Source::Metrics(|it| it.reachable_coverage)),
    measure(Undirected, "unreachable_coverage", "coverage, unreachable", SHARE)
        .from(Source::Metrics(|it| it.unreachable_coverage)),
    measure(Minimise, "interval_score_m", "interval score of the 95 % band", MM)
        .from(Source::Metrics(|it| it.interval_score_m))
        .untabled(),
    measure(Minimise, "nlpd", "NLPD", PLAIN).from(Source::Metrics(|it| it.nlpd)),
    measure(Minimise, "presence_brier", "Brier score of surface probability", SHARE)
        .from(Source::Outline(|it| Some(it.brier))),
    measure(Maximise, "silhouette_iou", "silhouette IoU", SHARE)
        .from(Source::Outline(|it| Some(it.iou)))
        .drawn(PanelAxis::UpToOne),
    measure(Minimise, "silhouette_misclassified", "misclassified share of the zone", SHARE)
        .from(Source::Outline(|it| Some(it.misclassified_share)))
        .untabled(),
    CHAMFER,
    measure(Minimise, "chamfer_share", "Chamfer distance, share of the diagonal", PERCENT)
        .from(Source::Shape(|it| it.chamfer_share)),
    measure(Minimise, "reachable_chamfer_m", "distance, reachable surface", MM)
        .from(Source::Shape(|it| it.reachable_chamfer_m))
        .aggregated(Aggregate::Median)
        .untabled(),
    measure(
        Minimise,
        "reachable_chamfer_share",
        "distance, reachable surface, share of the diagonal",
        PERCENT,
    )
    .from(Source::Shape(|it| Some(it.reachable_chamfer_m? / it.chamfer_m? * it.chamfer_share?)))
    .untabled(),
    measure(Maximise, "f_1_mm", "F-score at 1 mm", SHARE)
        .from(Source::Shape(|it| Some(it.f_mm?[0])))
        .untabled(),
    measure(Maximise, "f_2_mm", "F-score at 2 mm", SHARE)
        .from(Source::Shape(|it| Some(it.f_mm?[1])))
        .untabled(),
    measure(Maximise, "reached_2_mm", "reachable surface within 2 mm", SHARE)
        .from(Source::Shape(|it| it.reached_2_mm))
        .untabled(),
    measure(Maximise, "f_1", "F-score at 1 % of the diagonal", SHARE)
        .from(Source::Shape(|it| Some(it.f_1)))
        .drawn(PanelAxis::UpToOne),
    measure(Maximise, "f_3", "F-score at 3 % of the diagonal", SHARE)
        .from(Source::Shape(|it| Some(it.f_3))),
    measure(Undirected, "volume_error", "volume error", PERCENT)
        .from(Source::Shape(|it| it.volume_error)),
    measure(Undirected, "area_error", "area error", PERCENT)
        .from(Source::Shape(|it| Some(it.area_error))),
    measure(Maximise, "iou", "volume IoU", SHARE)
        .from(Source::Shape(|it| it.iou))
        .drawn(PanelAxis::UpToOne),
    measure(Undirected, "shape_coverage", "coverage within two standard deviations", SHARE)
        .from(Source::Shape(|it| it.coverage))
        .drawn(PanelAxis::UpToOne),
    RECOGNISED,
    measure(Minimise, "recognition_log_score", "log score of the object", PLAIN)
        .from(Source::Recognition(RecognitionMetrics::log_score)),
    measure(Undirected, "confidence", "probability of the most likely object", SHARE)
        .from(Source::Recognition(|it| Some(it.confidence())))
        .untabled(),
    POSE_DISTANCE,
    measure(Undirected, "pose_coverage", "poses within the stated 95 % distance", SHARE)
        .from(Source::Recognition(|it| it.is_covered().map(share))),
    measure(Minimise, "position_m", "object position error", MM)
        .from(Source::Recognition(|it| Some(it.error.as_ref()?.offset?[0])))
        .aggregated(Aggregate::Median)
        .untabled(),
    // A symmetric object's angle means nothing, so that less is not better.
    measure(Undirected, "rotation_deg", "object rotation error", DEGREES)
        .from(Source::Recognition(|it| Some(it.error.as_ref()?.offset?[1])))
        .aggregated(Aggregate::Median)
        .untabled(),
    measure(Minimise, "path_m", "lateral travel", METRES)
        .from(Source::Trial(TrialRow::path_m))
        .drawn(PanelAxis::Linear),
    ROBOT_TIME,
    STOP_TOUCHES,
    RMSE_BOUND_HOLDS,
    VERIFICATION_RMSE,
    measure(Minimise, "verification_nlpd", "NLPD at verification touches", PLAIN)
        .from(Source::Trial(|row, n| nlpd(predicted(row, n)?.map(|(error, sd)| (error, sd * sd))))),
    VERIFICATION_COVERAGE,
    measure(Minimise, "verification_miss_share", "missed verification touches", SHARE)
        .from(Source::Trial(missed)),
    REPEATABILITY,
    measure(Undirected, "length_scale_x_m", "length scale along x", MM)
        .from(Source::Touch(|it| length_scale(it, 0)))
        .aggregated(Aggregate::Median)
        .untabled(),
    measure(Undirected, "length_scale_z_m", "length scale along z", MM)
        .from(Source::Touch(|it| length_scale(it, 1)))
        .aggregated(Aggregate::Median)
        .untabled(),
];

/// Share of the truth inside a calibrated 95 % band.
const CALIBRATED_COVERAGE: f64 = 0.95;

/// R of Eq. 5, Yi et al. 2016.
pub const R: Measure = measure(Maximise, "r", "R (Eq. 5)", CORRELATION)
    .from(Source::Metrics(|it| Some(it.r)))
    .drawn(PanelAxis::UpToOne);

/// R after subtracting the means.
pub const CENTRED_R: Measure = measure(Maximise, "centred_r", "centred R", CORRELATION)
    .from(Source::Metrics(|it| Some(it.centred_r)))
    .drawn(PanelAxis::UpToOne);

/// Root mean square error.
pub const RMSE: Measure = measure(Minimise, "rmse_m", "RMSE", MM)
    .from(Source::Metrics(|it| Some(it.rmse_m)))
    .aggregated(Aggregate::Both)
    .drawn(PanelAxis::Log)
    .error();

/// Root mean square error in the outer tenth of the zone.
pub const EDGE_RMSE: Measure = measure(Minimise, "edge_rmse_m", "RMSE in the outer tenth", MM)
    .from(Source::Metrics(|it| it.edge_rmse_m))
    .aggregated(Aggregate::Median)
    .drawn(PanelAxis::Log)
    .error();

/// Root mean square error where the finger can touch the surface.
pub const REACHABLE_RMSE: Measure = measure(Minimise, "reachable_rmse_m", "RMSE, reachable", MM)
    .from(Source::Metrics(|it| it.reachable_rmse_m))
    .aggregated(Aggregate::Median)
    .drawn(PanelAxis::LogBeside(&UNREACHABLE_RMSE))
    .error();

const UNREACHABLE_RMSE: Measure = measure(Minimise, "unreachable_rmse_m", "RMSE, unreachable", MM)
    .from(Source::Metrics(|it| it.unreachable_rmse_m))
    .aggregated(Aggregate::Median);

/// Number of touches of a trial that stopped by its rule.
pub const STOP_TOUCHES: Measure =
    measure(Minimise, "stop_touches", "touches until the stop", PLAIN)
        .from(Source::Trial(|row, n| {
            let touches = row.touches.len();
            (row.stopped && touches <= n as usize).then_some(touches as f64)
        }))
        .aggregated(Aggregate::Median);

/// Share of trials whose RMSE within reach is at most the bound that the belief states.
pub const RMSE_BOUND_HOLDS: Measure =
    measure(Undirected, "rmse_bound_holds", "RMSE within its bound", SHARE).from(Source::Touch(
        |it| Some(share(it.metrics.as_ref()?.reachable_rmse_m? <= it.rmse_bound_m?)),
    ));

/// Time of the simulated or real robot since the start of a trial.
pub const ROBOT_TIME: Measure =
    measure(Minimise, "time_s", "robot time", SECONDS).from(Source::Touch(|it| it.outcome.time_s));

/// Share of the truth inside the 95 % band.
pub const COVERAGE: Measure = measure(Undirected, "coverage", "coverage of the 95 % band", SHARE)
    .from(Source::Metrics(|it| it.coverage))
    .drawn(PanelAxis::UpToOne);

/// Chamfer distance between the estimated and the true surface of a whole object.
pub const CHAMFER: Measure = measure(Minimise, "chamfer_m", "Chamfer distance", MM)
    .from(Source::Shape(|it| it.chamfer_m))
    .aggregated(Aggregate::Both)
    .drawn(PanelAxis::Log)
    .error();

/// Share of trials whose most likely hypothesis is the right one.
pub const RECOGNISED: Measure = measure(Maximise, "recognised", "right object", SHARE)
    .from(Source::Recognition(|it| it.is_right().map(share)))
    .drawn(PanelAxis::UpToOne);

/// Distance of the surfaces at the true and at the estimated pose, where the object is found.
pub const POSE_DISTANCE: Measure = measure(Minimise, "pose_distance_m", "pose error (ADD-S)", MM)
    .from(Source::Recognition(|it| it.error.as_ref()?.distance_m))
    .aggregated(Aggregate::Both)
    .drawn(PanelAxis::Log);

/// Root mean square error at verification touches, which the belief predicted and was not fitted
/// to.
pub const VERIFICATION_RMSE: Measure =
    measure(Minimise, "verification_rmse_m", "RMSE at verification touches", MM)
        .from(Source::Trial(|row, n| rmse(verified(row, n)?.filter_map(|touch| touch.error_m))))
        .aggregated(Aggregate::Both);

/// Share of verification touches inside the 95 % band.
pub const VERIFICATION_COVERAGE: Measure =
    measure(Undirected, "verification_coverage", "coverage of verification touches", SHARE).from(
        Source::Trial(|row, n| {
            coverage(verified(row, n)?.filter_map(|touch| {
                let of_sd_m = |sd_m: f64| [-BAND_95 * sd_m, BAND_95 * sd_m];
                Some((touch.error_m?, touch.band_m.or(touch.sd_m.map(of_sd_m))?))
            }))
        }),
    );

/// Root mean square difference between a touch and the one it repeats.
pub const REPEATABILITY: Measure = measure(Minimise, "repeatability_m", "repeatability, RMS", MM)
    .from(Source::Trial(|row, n| {
        rmse(verification(row, n)?.iter().filter_map(|touch| touch.difference_m))
    }))
    .aggregated(Aggregate::Both);

/// 1 for true, 0 for false.
fn share(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

fn length_scale(touch: &TouchRow, axis: usize) -> Option<f64> {
    touch.fit.as_ref()?.hyperparameters.length_scales.get(axis).copied()
}

/// Verification touches of a trial, which follow its last touch; `None` after fewer touches.
fn verification(row: &TrialRow, touches: u32) -> Option<&[VerificationRow]> {
    let has_ended = row.stopped && row.ended_before(touches);
    (has_ended || row.touches.len() == touches as usize).then_some(&row.verification)
}

/// Verification touches at new places.
fn verified(row: &TrialRow, touches: u32) -> Option<impl Iterator<Item = &VerificationRow>> {
    Some(verification(row, touches)?.iter().filter(|touch| touch.repeats.is_none()))
}

/// Errors at verification touches, each with its standard deviation.
fn predicted(row: &TrialRow, touches: u32) -> Option<impl Iterator<Item = (f64, f64)>> {
    Some(verified(row, touches)?.filter_map(|touch| touch.error_m.zip(touch.sd_m)))
}

/// Share of verification touches that missed or were aborted.
fn missed(row: &TrialRow, touches: u32) -> Option<f64> {
    let (mut count, mut missed) = (0.0, 0.0);
    for touch in verified(row, touches)? {
        count += 1.0;
        missed += f64::from(u8::from(touch.contact.is_none()));
    }
    (count > 0.0).then(|| missed / count)
}

/// Measures with columns in files about `rows`.
pub fn measures_with_columns(rows: &[TrialRow]) -> impl Iterator<Item = &'static Measure> {
    let has = |part: &dyn Fn(&TouchRow) -> bool| rows.iter().flat_map(|row| &row.touches).any(part);
    let has_shape = has(&|touch| touch.shape.is_some());
    let has_hypotheses = has(&|touch| touch.recognition.is_some());
    MEASURES.iter().filter(move |measure| match measure.source {
        Source::Shape(_) => has_shape,
        Source::Recognition(_) => has_hypotheses,
        _ => true,
    })
}

/// Finds the measure by its name in files.
pub fn by_id(id: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.id == id)
}

/// A measure: a number of a trial after some touches, in SI units.
#[derive(Clone, Copy)]
pub struct Measure {
    /// Name in files, with the unit as suffix.
    pub id: &'static str,
    /// Title for readers.
    pub title: &'static str,
    /// Unit, in files and for readers.
    pub unit: MeasureUnit,
    /// Direction in which the measure improves.
    pub direction: Direction,
    /// Statistics reported over many trials.
    pub aggregate: Aggregate,
    /// Axis on which the measure is drawn over touches.
    pub scale: PanelAxis,
    /// Whether the summary on the terminal and the page lists it.
    pub in_tables: bool,
    /// Whether the measure is an error: planners are compared in it after every touch, and in the
    /// touches that they need to reduce it.
    pub is_error: bool,
    /// Part of a row from which the measure is computed.
    pub source: Source,
}

/// Part of a row that a measure is computed from. The measure has no value if the part is missing.
#[derive(Clone, Copy)]
pub enum Source {
    /// Agreement of the heights with the ground truth after a touch.
    Metrics(fn(&Metrics) -> Option<f64>),
    /// Agreement of the silhouettes after a touch.
    Outline(fn(&SilhouetteMetrics) -> Option<f64>),
    /// Agreement of the closed surfaces after a touch. Files of runs over a zone have no column for
    /// such a measure.
    Shape(fn(&ShapeMetrics) -> Option<f64>),
    /// Hypotheses about the object after a touch. Files of runs without a library have no column
    /// for such a measure.
    Recognition(fn(&RecognitionMetrics) -> Option<f64>),
    /// Row of one touch.
    Touch(fn(&TouchRow) -> Option<f64>),
    /// A trial and a number of touches.
    Trial(fn(&TrialRow, u32) -> Option<f64>),
}

/// A unit in files and for readers.
#[derive(Clone, Copy, Debug)]
pub struct MeasureUnit {
    /// Suffix of names in files.
    pub suffix: &'static str,
    /// Symbol shown to readers.
    pub symbol: &'static str,
    /// Number of these units in one SI unit.
    pub per_si: f64,
    /// Decimals shown.
    pub decimals: usize,
    /// Smallest and largest value that a row may contain, in the SI unit.
    pub range: [f64; 2],
}

/// Direction in which a measure improves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Less is better.
    Minimise,
    /// More is better.
    Maximise,
    /// No direction; planners are not compared in it.
    Undirected,
}

/// Statistics reported over many trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aggregate {
    /// Mean with its standard error.
    Mean,
    /// Median with its bootstrap interval.
    Median,
    /// Mean and median; the median where only one fits.
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

/// Axis of a measure's panel over touches.
#[derive(Clone, Copy, Debug)]
pub enum PanelAxis {
    /// Not drawn.
    Undrawn,
    /// Linear axis.
    Linear,
    /// Linear axis that includes 1, the best value.
    UpToOne,
    /// Logarithmic axis.
    Log,
    /// Logarithmic axis with another measure dotted; not drawn where that measure has no value.
    LogBeside(&'static Measure),
}

/// Largest distance of a place or an error, m.
// heuristic: a thousand times any robot's reach.
pub(super) const FAR_M: f64 = 1e6;

/// Largest value without a unit that a measure can have, apart from shares and correlations.
// heuristic: bounds the negative log density of an overconfident belief; no finite computation
// exceeded it.
const LARGE: f64 = 1e300;

const PLAIN: MeasureUnit =
    MeasureUnit { suffix: "", symbol: "", per_si: 1.0, decimals: 3, range: [-LARGE, LARGE] };
const CORRELATION: MeasureUnit =
    MeasureUnit { decimals: 4, range: [-1.000_001, 1.000_001], ..PLAIN };
const SHARE: MeasureUnit = MeasureUnit { range: [0.0, 1.000_001], ..PLAIN };
const PERCENT: MeasureUnit =
    MeasureUnit { symbol: "%", per_si: 100.0, range: [-FAR_M, FAR_M], ..PLAIN };
/// Metres.
pub const METRES: MeasureUnit =
    MeasureUnit { suffix: "_m", symbol: "m", range: [0.0, FAR_M], ..PLAIN };
const MM: MeasureUnit = MeasureUnit { symbol: "mm", per_si: 1e3, ..METRES };
const DEGREES: MeasureUnit =
    MeasureUnit { suffix: "_deg", symbol: "°", decimals: 1, range: [0.0, 180.000_001], ..PLAIN };
const SECONDS: MeasureUnit =
    MeasureUnit { suffix: "_s", symbol: "s", decimals: 1, range: [-LARGE, LARGE], ..PLAIN };

impl Measure {
    /// Returns the columns of the statistics over many trials: mean and standard error, median and
    /// interval bounds.
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

    /// Returns the column name of `statistic`, which comes before the unit.
    pub fn column(&self, statistic: &str) -> String {
        format!("{}_{statistic}{}", self.stem(), self.unit.suffix)
    }

    /// Name in files without the unit.
    pub fn stem(&self) -> &'static str {
        self.id.strip_suffix(self.unit.suffix).unwrap_or(self.id)
    }

    /// Value after some touches; `None` if the trial has no value. A trial that failed or stopped
    /// keeps its last value.
    pub fn value(&self, row: &TrialRow, touches: u32) -> Option<f64> {
        match self.source {
            Source::Trial(of) => of(row, touches),
            _ if row.ended_before(touches) => {
                row.touches.iter().rev().find_map(|touch| self.value_after_touch(touch))
            }
            _ => self.value_after_touch(row.touches.get((touches as usize).checked_sub(1)?)?),
        }
    }

    /// Value after a touch; `None` for a measure of a trial.
    pub fn value_after_touch(&self, touch: &TouchRow) -> Option<f64> {
        match self.source {
            Source::Metrics(of) => of(touch.metrics.as_ref()?),
            Source::Outline(of) => of(touch.silhouette.as_ref()?),
            Source::Shape(of) => of(touch.shape.as_ref()?),
            Source::Recognition(of) => of(touch.recognition.as_ref()?),
            Source::Touch(of) => of(touch),
            Source::Trial(_) => None,
        }
    }

    /// Whether the measure applies to whole objects only.
    pub fn is_for_whole_objects(&self) -> bool {
        matches!(self.source, Source::Shape(_))
    }

    /// Sets the source.
    const fn from(self, source: Source) -> Self {
        Self { source, ..self }
    }

    /// Sets the statistics over many trials.
    const fn aggregated(self, aggregate: Aggregate) -> Self {
        Self { aggregate, ..self }
    }

    /// Sets the axis on which the measure is drawn.
    const fn drawn(self, scale: PanelAxis) -> Self {
        Self { scale, ..self }
    }

    /// Removes the measure from the tables; it stays in files.
    const fn untabled(self) -> Self {
        Self { in_tables: false, ..self }
    }

    /// Marks the measure as an error, in which planners are compared after every touch.
    const fn error(self) -> Self {
        Self { is_error: true, ..self }
    }
}

impl fmt::Debug for Measure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.id)
    }
}

/// Returns a measure whose mean is reported and listed in tables, that is not drawn, and that has
/// no value until a source is set.
const fn measure(
    direction: Direction,
    id: &'static str,
    title: &'static str,
    unit: MeasureUnit,
) -> Measure {
    Measure {
        id,
        title,
        unit,
        direction,
        aggregate: Aggregate::Mean,
        scale: PanelAxis::Undrawn,
        in_tables: true,
        is_error: false,
        source: Source::Trial(|_, _| None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names are unique and end with their unit, so that column names are unique.
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
