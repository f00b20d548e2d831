//! Curves over touches as a table with intervals, the content of `summary.csv`.

use crate::experiment::Experiment;
use crate::measure::{Measure, measures_with_columns};
use crate::row::TrialRow;
use crate::statistics::BootstrapSamples;
use crate::statistics::comparison::paired;
use crate::statistics::summary;
use crate::statistics::summary::CurvePoint;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

/// Returns the columns of a run's records. A measure has its mean with the standard error, or its
/// median with the 95 % bootstrap interval. An error also has the difference from each baseline in
/// the same trial (mean, 95 % bootstrap interval, share of trials with a smaller error).
pub fn columns(experiment: &Experiment, rows: &[TrialRow]) -> Vec<String> {
    let of_measure = |measure: &'static Measure| {
        let baselines = experiment.baselines().into_iter().filter(|_| measure.is_error);
        let differences = baselines.flat_map(|baseline| {
            let column = |end: &str| measure.column(&format!("minus_{baseline}{end}"));
            let won = format!("{}_won_against_{baseline}", measure.stem());
            [column(""), column("_low"), column("_high"), won]
        });
        measure.columns().into_iter().chain(differences.collect::<Vec<_>>())
    };
    measures_with_columns(rows).flat_map(of_measure).collect()
}

/// Returns a point for each planner and each touch count that `is_wanted`, with its values in the
/// [`columns`] of the run.
pub fn curve_table(
    experiment: &Experiment,
    rows: &[TrialRow],
    is_wanted: impl Fn(u32) -> bool,
) -> Vec<(CurvePoint, Vec<Option<f64>>)> {
    let points: Vec<CurvePoint> = (experiment.planners.iter())
        .flat_map(|planner| summary::curve(experiment, rows, planner))
        .filter(|point| is_wanted(point.touches))
        .collect();
    let measures: Vec<&Measure> = measures_with_columns(rows).collect();
    let values = |point: &CurvePoint| values(experiment, &measures, rows, point);
    let values: Vec<_> = points.par_iter().map(values).collect();
    points.into_iter().zip(values).collect()
}

fn values(
    experiment: &Experiment,
    measures: &[&Measure],
    rows: &[TrialRow],
    point: &CurvePoint,
) -> Vec<Option<f64>> {
    let mut values = Vec::new();
    // Samples of all trials; a measure that fewer trials have draws its own samples.
    let samples = BootstrapSamples::new(point.trials, experiment.seed);
    for &measure in measures {
        let summary = point.of(measure);
        if measure.aggregate.has_mean() {
            values.push(summary.map(|summary| summary.mean));
            values.push(summary.and_then(|summary| summary.error));
        }
        if measure.aggregate.has_median() {
            let interval = interval(experiment, &samples, rows, point, measure);
            values.push(summary.map(|summary| summary.median));
            values.extend(ends(interval));
        }
        for baseline in experiment.baselines().into_iter().filter(|_| measure.is_error) {
            let planners = [point.planner.as_str(), baseline];
            let paired = (point.planner != baseline)
                .then(|| paired(experiment, rows, planners, point.touches, measure))
                .flatten();
            values.push(paired.map(|paired| paired.mean));
            values.extend(ends(paired.and_then(|paired| paired.interval)));
            values.push(paired.map(|paired| paired.won));
        }
    }
    values
}

fn ends(interval: Option<[f64; 2]>) -> [Option<f64>; 2] {
    interval.map_or([None; 2], |ends| ends.map(Some))
}

/// 95 % bootstrap interval of the median; `None` for a single trial.
fn interval(
    experiment: &Experiment,
    samples: &BootstrapSamples,
    rows: &[TrialRow],
    point: &CurvePoint,
    measure: &Measure,
) -> Option<[f64; 2]> {
    let all: Vec<f64> = summary::fitted(rows, &point.planner, point.touches)
        .into_iter()
        .filter_map(|row| measure.value(row, point.touches))
        .collect();
    match all.len() == samples.count {
        true => samples.median_interval(&all),
        false => BootstrapSamples::new(all.len(), experiment.seed).median_interval(&all),
    }
}

/// Uncertainty of a measure's reported value: the 95 % bootstrap interval of a median, one standard
/// error on either side of a mean; `None` for a single trial.
pub fn uncertainty(
    experiment: &Experiment,
    rows: &[TrialRow],
    point: &CurvePoint,
    measure: &Measure,
) -> Option<[f64; 2]> {
    if measure.aggregate.has_median() {
        let samples = BootstrapSamples::new(point.trials, experiment.seed);
        return interval(experiment, &samples, rows, point, measure);
    }
    let summary = point.of(measure)?;
    summary.error.map(|error| [summary.mean - error, summary.mean + error])
}
