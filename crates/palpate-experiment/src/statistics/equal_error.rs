//! Touches to equal error: the touches that a planner needs to reach a baseline's error.
//!
//! The goal is the baseline's median error after the goal's touches: the last touch, or
//! `report.goal_touches`. A planner reaches it at the first touch count from which its median error
//! stays at or below the goal up to the goal's touches. If there is none, it reaches it at the
//! first later count with an error at or below the goal. Goal, counts, path lengths and their
//! ratios are recomputed in every bootstrap sample of the trials, the same sample for both
//! planners; the intervals describe that distribution.

use crate::experiment::Experiment;
use crate::measure::{MEASURES, Measure, ROBOT_TIME};
use crate::row::{TrialRow, planner_rows};
use crate::statistics::comparison::pairs;
use crate::statistics::{BootstrapSamples, RankedValues, central_95};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::collections::BTreeMap;

/// Errors in which planners are compared.
pub fn errors() -> impl Iterator<Item = &'static Measure> {
    MEASURES.iter().filter(|measure| measure.is_error)
}

/// A number with its 95 % bootstrap interval, `None` for a single trial; infinite if the goal is
/// not reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntervalEstimate {
    /// Value over all trials.
    pub value: f64,
    /// Interval that contains 95 % of the bootstrap samples.
    pub interval: Option<[f64; 2]>,
}

/// Touches of a planner and of a baseline to the same error.
#[derive(Debug)]
pub struct EqualError<'a> {
    /// Name of the planner.
    pub planner: &'a str,
    /// Name of the baseline, whose error is the goal.
    pub baseline: &'a str,
    /// Compared error.
    pub measure: &'static Measure,
    /// Trials finished by both.
    pub trials: usize,
    /// Baseline's median error after `report.goal_touches` touches.
    pub goal: f64,
    /// Touches of the planner to the goal.
    pub touches: IntervalEstimate,
    /// Touches of the baseline to the goal.
    pub baseline_touches: f64,
    /// Ratio of the two touch counts.
    pub ratio: IntervalEstimate,
    /// Ratio of the median lateral path lengths from the initial touches to the goal.
    pub path_ratio: IntervalEstimate,
    /// Ratio of the median times of the robot from its start to the goal; not finite without
    /// motion.
    pub time_ratio: IntervalEstimate,
}

/// Compares every planner with every baseline in every error that both have.
pub fn equal_errors<'a>(experiment: &'a Experiment, rows: &[TrialRow]) -> Vec<EqualError<'a>> {
    let asked = pairs(experiment);
    let asked: Vec<_> = asked.flat_map(|pair| errors().map(move |error| (pair, error))).collect();
    let found = asked.into_par_iter().filter_map(|((planner, baseline), measure)| {
        equal_error(experiment, rows, [planner, baseline], measure)
    });
    found.collect()
}

/// Compares one planner with another; `None` if no trial was finished by both.
pub fn equal_error<'a>(
    experiment: &Experiment,
    rows: &[TrialRow],
    [planner, baseline]: [&'a str; 2],
    measure: &'static Measure,
) -> Option<EqualError<'a>> {
    let [ours, theirs] = [planner, baseline].map(|name| curves(experiment, rows, name, measure));
    let pairs: Vec<[&ErrorCurve<f64>; 2]> =
        ours.iter().filter_map(|(trial, curve)| Some([curve, theirs.get(trial)?])).collect();
    let compared = compared(experiment);
    let goal_touches = experiment.goal_touches();
    let goal_index = compared.partition_point(|&count| count <= goal_touches).checked_sub(1)?;
    let medians = [0, 1].map(|which| ErrorCurve::new(pairs.iter().map(|pair| pair[which])));
    let mut counts = Vec::new();
    let everyone: Vec<usize> = (0..pairs.len()).collect();
    let goal = medians[1].errors.get(goal_index)?.median(&everyone, &mut counts)?;
    // An unreached goal gives no comparison.
    let touches =
        |after: f64| compared.get(after as usize).map_or(f64::INFINITY, |n| f64::from(*n));
    let mut met = |sample: &[usize]| {
        let met = reach_goal(&medians, sample, goal_index, &mut counts);
        met.map(|(after, path_m, time_s)| [touches(after), path_m, time_s])
    };
    let found = met(&everyone);
    let samples = BootstrapSamples::new(pairs.len(), experiment.seed).each(met);
    let estimate = |of: fn([[f64; 3]; 2]) -> f64| {
        let values = samples.iter().map(|met| of(*met)).collect();
        let interval = (!samples.is_empty()).then(|| central_95(values));
        IntervalEstimate { value: of(found), interval }
    };
    Some(EqualError {
        planner,
        baseline,
        measure,
        trials: pairs.len(),
        goal,
        touches: estimate(|[ours, _]| ours[0]),
        baseline_touches: found[1][0],
        ratio: estimate(|[ours, theirs]| ours[0] / theirs[0]),
        path_ratio: estimate(|[ours, theirs]| ours[1] / theirs[1]),
        time_ratio: estimate(|[ours, theirs]| ours[2] / theirs[2]),
    })
}

/// Touch counts, from the last initial touch on, after which beliefs are compared.
fn compared(experiment: &Experiment) -> Vec<u32> {
    let counts = experiment.first_fit()..=experiment.touches;
    counts.filter(|&count| experiment.is_evaluated(count)).collect()
}

/// Values at every compared touch count: the numbers of one trial, or those of many trials as
/// ranks, from which sample medians are computed.
struct ErrorCurve<T> {
    errors: Vec<T>,
    /// Lateral path length since the last initial touch.
    paths_m: Vec<T>,
    /// Time of the robot since its start; not finite without motion.
    times_s: Vec<T>,
}

impl ErrorCurve<RankedValues> {
    fn new<'a>(curves: impl Iterator<Item = &'a ErrorCurve<f64>> + Clone) -> Self {
        let length = curves.clone().next().map_or(0, |curve| curve.errors.len());
        let ranked = |of: &dyn Fn(&ErrorCurve<f64>, usize) -> f64| {
            let at = |index| curves.clone().map(|curve| of(curve, index)).collect::<Vec<f64>>();
            (0..length).map(|index| RankedValues::new(&at(index))).collect()
        };
        Self {
            errors: ranked(&|curve, index| curve.errors[index]),
            paths_m: ranked(&|curve, index| curve.paths_m[index]),
            times_s: ranked(&|curve, index| curve.times_s[index]),
        }
    }
}

/// Returns the trials that have the error at every compared count.
fn curves(
    experiment: &Experiment,
    rows: &[TrialRow],
    planner: &str,
    measure: &Measure,
) -> BTreeMap<u32, ErrorCurve<f64>> {
    let counts = compared(experiment);
    let curve = |row: &TrialRow| -> Option<ErrorCurve<f64>> {
        let errors: Option<Vec<f64>> =
            counts.iter().map(|&count| measure.value(row, count)).collect();
        let start_m = row.path_m(experiment.initial_touches)?;
        let paths_m: Option<Vec<f64>> =
            counts.iter().map(|&count| Some(row.path_m(count)? - start_m)).collect();
        let time_s = |count: &u32| ROBOT_TIME.value(row, *count).unwrap_or(f64::NAN);
        let times_s = counts.iter().map(time_s).collect();
        Some(ErrorCurve { errors: errors?, paths_m: paths_m?, times_s })
    };
    planner_rows(rows, planner).filter_map(|row| Some((row.trial, curve(row)?))).collect()
}

/// Returns the index at which each planner reaches the second one's median error at `goal_index`,
/// the median path length to it, m, and the median time, s. The index counts compared touch counts:
/// over a zone, touches after the initial ones.
fn reach_goal(
    medians: &[ErrorCurve<RankedValues>; 2],
    sample: &[usize],
    goal_index: usize,
    counts: &mut Vec<u32>,
) -> [(f64, f64, f64); 2] {
    let goal = medians[1].errors.get(goal_index).and_then(|error| error.median(sample, counts));
    let goal = goal.unwrap_or(f64::NAN);
    medians.each_ref().map(|ErrorCurve { errors, paths_m, times_s }| {
        let mut is_met =
            |index: usize| errors[index].median(sample, counts).is_some_and(|error| error <= goal);
        let met = match is_met(goal_index) {
            true => (0..=goal_index).rev().take_while(|&index| is_met(index)).last(),
            false => (goal_index + 1..errors.len()).find(|&index| is_met(index)),
        };
        let mut at = |of: &[RankedValues]| met.and_then(|index| of[index].median(sample, counts));
        let [path_m, time_s] = [at(paths_m), at(times_s)].map(|at| at.unwrap_or(f64::INFINITY));
        (met.map_or(f64::INFINITY, |index| index as f64), path_m, time_s)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trials whose errors and path lengths are the same functions of the count, up to a factor.
    fn trials(error: impl Fn(f64) -> f64, step_m: f64) -> Vec<ErrorCurve<f64>> {
        (0..20)
            .map(|trial| ErrorCurve {
                errors: (0..41)
                    .map(|i| (1.0 + 0.01 * f64::from(trial)) * error(f64::from(i)))
                    .collect(),
                paths_m: (0..41).map(|i| step_m * f64::from(i)).collect(),
                times_s: (0..41).map(|i| 2.0 * step_m * f64::from(i)).collect(),
            })
            .collect()
    }

    fn reached(
        ours: &[ErrorCurve<f64>],
        theirs: &[ErrorCurve<f64>],
        goal_index: usize,
    ) -> [(f64, f64, f64); 2] {
        let sample: Vec<usize> = (0..ours.len()).map(|i| i / 2).collect();
        let medians = [ours, theirs].map(|curves| ErrorCurve::new(curves.iter()));
        reach_goal(&medians, &sample, goal_index, &mut Vec::new())
    }

    /// Twice the rate takes half the touches for any sample of trials.
    #[test]
    fn twice_as_fast_needs_half_the_touches() {
        let (fast, slow) = (trials(|n| (-0.2 * n).exp(), 3.0), trials(|n| (-0.1 * n).exp(), 1.0));
        let [ours, theirs] = reached(&fast, &slow, 40);
        assert_eq!((ours, theirs), ((20.0, 60.0, 120.0), (40.0, 40.0, 80.0)));
        let [slower, itself] = reached(&slow, &fast, 10);
        assert_eq!((slower.0, itself.0), (20.0, 10.0));
    }

    #[test]
    fn a_goal_is_met_where_the_error_stays_below_it() {
        let steady = trials(|_| 2.0, 1.0);
        let rising = trials(|n| if n < 30.0 { 1.0 } else { 1.0 + n }, 1.0);
        assert_eq!(reached(&rising, &steady, 40)[0].0, f64::INFINITY);
        let wavy = trials(|n| if n == 7.0 { 5.0 } else { 1.0 }, 1.0);
        assert_eq!(reached(&wavy, &steady, 40)[0].0, 8.0);
    }
}
