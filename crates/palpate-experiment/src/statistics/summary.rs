//! Curves over touches: statistics over the trials of a planner.

use crate::experiment::Experiment;
use crate::measure::{MEASURES, Measure};
use crate::row::{TouchRow, TrialRow, planner_rows};
use crate::statistics::{mean, mean_and_error, median};
use palpate_explore::evidence::End;
use palpate_explore::planner::Fallback;
use palpate_explore::robot::sensor::Doubt;
use palpate_explore::task::Zone;
use serde::Serialize;
use std::collections::BTreeMap;

/// Statistics of one planner's trials after a number of touches.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePoint {
    /// Name of the planner.
    pub planner: String,
    /// Number of touches.
    pub touches: u32,
    /// Trials with a belief after this many touches.
    pub trials: usize,
    /// Statistics of each of [`MEASURES`]; `None` for a measure that no trial has.
    values: Vec<Option<MeasureStatistics>>,
}

/// Statistics of a measure over trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasureStatistics {
    /// Mean.
    pub mean: f64,
    /// Standard error of the mean; `None` for a single trial.
    pub error: Option<f64>,
    /// Median.
    pub median: f64,
}

impl MeasureStatistics {
    fn new(values: &[f64]) -> Option<Self> {
        let median = median(values)?;
        let (mean, error) = mean_and_error(values);
        Some(Self { mean, error, median })
    }
}

impl CurvePoint {
    /// Statistics of a measure; `None` if no trial has it.
    pub fn of(&self, measure: &Measure) -> Option<&MeasureStatistics> {
        let index = MEASURES.iter().position(|other| other.id == measure.id)?;
        self.values.get(index)?.as_ref()
    }

    /// Representative value of a measure: the median if it is reported, otherwise the mean; `None`
    /// if no trial has the measure.
    pub fn representative(&self, measure: &Measure) -> Option<f64> {
        let summary = self.of(measure)?;
        Some(if measure.aggregate.has_median() { summary.median } else { summary.mean })
    }
}

/// Counts of events in one planner's trials.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct EventCounts {
    /// Trials started.
    pub trials: usize,
    /// Trials that ended early.
    pub failures: usize,
    /// Touches without contact.
    pub misses: usize,
    /// Aborted touches: force limit exceeded, or contact not located.
    pub overloads: usize,
    /// Touches by the sensor's doubt about them.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub doubts: BTreeMap<Doubt, usize>,
    /// Plans that fell back because the belief had no variance at the best place.
    pub no_variance: usize,
    /// Plans that fell back because they repeated a target.
    pub duplicate_target: usize,
}

/// Curve of one planner, from its first fit to its last touch.
pub fn curve(experiment: &Experiment, rows: &[TrialRow], planner: &str) -> Vec<CurvePoint> {
    (experiment.first_fit()..=experiment.touches)
        .filter_map(|touches| {
            let fitted = fitted(rows, planner, touches);
            let of = |measure: &Measure| -> Vec<f64> {
                fitted.iter().filter_map(|row| measure.value(row, touches)).collect()
            };
            (!fitted.is_empty()).then(|| CurvePoint {
                planner: planner.into(),
                touches,
                trials: fitted.len(),
                values: MEASURES
                    .iter()
                    .map(|measure| MeasureStatistics::new(&of(measure)))
                    .collect(),
            })
        })
        .collect()
}

/// Returns the trials of a planner that have a belief after some touches.
pub(crate) fn fitted<'a>(
    rows: &'a [TrialRow],
    planner: &'a str,
    touches: u32,
) -> Vec<&'a TrialRow> {
    let is_fitted = |row: &&TrialRow| match row.ended_before(touches) {
        true => row.touches.iter().any(|touch| touch.fit.is_some()),
        false => row.touches.get(touches as usize - 1).is_some_and(|touch| touch.fit.is_some()),
    };
    planner_rows(rows, planner).filter(is_fitted).collect()
}

/// Representative value of a measure over a planner's trials after some touches: the median if it
/// is reported, otherwise the mean; `None` if no trial has the measure.
pub fn representative_value(
    rows: &[TrialRow],
    planner: &str,
    touches: u32,
    measure: &Measure,
) -> Option<f64> {
    let values: Vec<f64> =
        planner_rows(rows, planner).filter_map(|row| measure.value(row, touches)).collect();
    match measure.aggregate.has_median() {
        true => median(&values),
        false => (!values.is_empty()).then(|| mean(&values)),
    }
}

/// Returns the touch count from which a curve meets a goal up to its end; `None` if it does not.
pub fn goal_touches(points: &[CurvePoint], is_met: impl Fn(&CurvePoint) -> bool) -> Option<u32> {
    points.iter().rev().take_while(|point| is_met(point)).last().map(|point| point.touches)
}

/// Median distance between target and contact in the zone's plane over all touches with contact;
/// `None` if there are none.
pub fn median_shift_m(zone: &Zone, rows: &[TrialRow]) -> Option<f64> {
    let shifts_m: Vec<f64> = (rows.iter().flat_map(|row| &row.touches))
        .filter_map(|touch| {
            let place = zone.place(&touch.contact()?);
            let square = |(a, b): (&f64, &f64)| (a - b).powi(2);
            Some(place.iter().zip(touch.target.place()?).map(square).sum::<f64>().sqrt())
        })
        .collect();
    median(&shifts_m)
}

/// Counts the events in one planner's trials.
pub fn events(rows: &[TrialRow], planner: &str) -> EventCounts {
    let mut events = EventCounts::default();
    for row in planner_rows(rows, planner) {
        let count = |condition: fn(&TouchRow) -> bool| {
            row.touches.iter().filter(|touch| condition(touch)).count()
        };
        events.trials += 1;
        events.failures += usize::from(row.failure.is_some());
        events.misses += count(TouchRow::is_miss);
        events.overloads += count(|touch| touch.outcome.end == End::Overload);
        for doubt in row.touches.iter().filter_map(|touch| touch.outcome.doubt) {
            *events.doubts.entry(doubt).or_default() += 1;
        }
        events.no_variance += count(|touch| touch.fallback == Some(Fallback::NoVariance));
        events.duplicate_target += count(|touch| touch.fallback == Some(Fallback::DuplicateTarget));
    }
    events
}
