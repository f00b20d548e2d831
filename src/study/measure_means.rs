//! Means of measures over trials and objects after each budget of touches.

use super::compare::estimate;
use crate::experiment::measure::{Aggregate, Measure};
use crate::experiment::row::TrialRow;
use crate::experiment::statistics::equal_error::IntervalEstimate;
use crate::experiment::statistics::{mean, median};
use palpate_gp::math::normal::BAND_95;
use serde::Serialize;
use std::collections::BTreeMap;

/// Seed of all bootstraps.
const SEED: u64 = 0;

/// Means of measures after each budget, by the measure's name in files. A measure whose statistic
/// is the median has medians over trials.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MeasureMeans {
    /// Means over objects of means over trials, in SI units.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub measures: BTreeMap<&'static str, Vec<Option<f64>>>,
    /// Their 95 % intervals: of Wilson (1927) if all values are 0 or 1, else of a bootstrap over
    /// the trials within each object.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub measure_intervals: BTreeMap<&'static str, Vec<Option<[f64; 2]>>>,
}

impl MeasureMeans {
    /// Computes the means from the rows of each object.
    pub fn new(measures: &[&'static Measure], rows: &[Vec<&TrialRow>], budgets: &[u32]) -> Self {
        let mut means = Self::default();
        for measure in measures {
            let after = |budget: &u32| {
                let values = |rows: &Vec<&TrialRow>| -> Vec<f64> {
                    rows.iter().filter_map(|row| measure.value(row, *budget)).collect()
                };
                let strata: Vec<Vec<f64>> = rows.iter().map(values).collect();
                pooled(strata, measure.aggregate)
            };
            let found: Vec<Option<IntervalEstimate>> = budgets.iter().map(after).collect();
            let values = found.iter().map(|it| it.map(|it| it.value)).collect();
            let intervals = found.iter().map(|it| it.and_then(|it| it.interval)).collect();
            means.measures.insert(measure.id, values);
            means.measure_intervals.insert(measure.id, intervals);
        }
        means
    }

    /// Returns the mean of a measure after the budget number `index`.
    pub fn get(&self, measure: &str, index: usize) -> Option<IntervalEstimate> {
        let value = (*self.measures.get(measure)?.get(index)?)?;
        let interval = self.measure_intervals.get(measure).and_then(|it| *it.get(index)?);
        Some(IntervalEstimate { value, interval })
    }
}

/// Mean over the strata with values of their means, or medians; `None` without a value.
fn pooled(mut strata: Vec<Vec<f64>>, aggregate: Aggregate) -> Option<IntervalEstimate> {
    strata.retain(|values| !values.is_empty());
    if strata.is_empty() {
        return None;
    }
    let of = |values: &[f64]| match aggregate.has_mean() {
        true => mean(values),
        false => median(values).unwrap_or(f64::NAN),
    };
    let value = mean(&strata.iter().map(|values| of(values)).collect::<Vec<_>>());
    let count = strata.iter().map(Vec::len).sum::<usize>();
    let interval = if strata.iter().flatten().all(|value| [0.0, 1.0].contains(value)) {
        Some(wilson_95(value, count))
    } else if count == strata.len() {
        None
    } else {
        let sizes: Vec<usize> = strata.iter().map(Vec::len).collect();
        let drawn = |picks: &[Vec<usize>]| {
            let of_picked = |(values, picks): (&Vec<f64>, &Vec<usize>)| {
                of(&picks.iter().map(|pick| values[*pick]).collect::<Vec<_>>())
            };
            mean(&strata.iter().zip(picks).map(of_picked).collect::<Vec<_>>())
        };
        estimate(&sizes, SEED, "measures", drawn).interval
    };
    Some(IntervalEstimate { value, interval })
}

/// Returns the 95 % score interval of a share of `count` trials (Wilson 1927, Journal of the
/// American Statistical Association 22).
pub fn wilson_95(share: f64, count: usize) -> [f64; 2] {
    let (n, z) = (count as f64, BAND_95);
    let middle = share + z * z / (2.0 * n);
    let half = z * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
    [middle - half, middle + half].map(|end| (end / (1.0 + z * z / n)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Newcombe 1998, Statistics in Medicine 17, table I: 81 of 263 and 0 of 20.
    #[test]
    fn the_interval_of_a_share_is_the_published_one() {
        let near = |share: f64, count: usize, low: f64, high: f64| {
            let found = wilson_95(share, count);
            assert!((found[0] - low).abs() < 1e-4 && (found[1] - high).abs() < 1e-4, "{found:?}");
        };
        near(81.0 / 263.0, 263, 0.2553, 0.3662);
        near(0.0, 20, 0.0, 0.1611);
    }

    #[test]
    fn objects_count_alike_and_a_single_trial_has_no_interval() {
        let mean = |strata: &[&[f64]]| {
            pooled(strata.iter().map(|it| it.to_vec()).collect(), Aggregate::Mean)
        };
        let found = mean(&[&[2.0, 4.0, 3.0, 3.0], &[5.0], &[]]).unwrap();
        assert_eq!(found.value, 4.0);
        assert!(found.interval.is_some_and(|[low, high]| low < 4.0 && 4.0 < high));
        assert_eq!(mean(&[&[2.0], &[4.0]]).unwrap().interval, None);
        assert_eq!(mean(&[&[]]), None);
        let median = pooled(vec![vec![1.0, 2.0, 9.0]], Aggregate::Median).unwrap();
        assert_eq!(median.value, 2.0);
    }
}
