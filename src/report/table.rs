//! The summary of a run as text and as CSV.

use crate::experiment::comparison;
use crate::experiment::comparison::BASELINES;
use crate::experiment::measure::RMSE;
use crate::experiment::statistics::{Paired, median_interval};
use crate::experiment::store::Run;
use crate::experiment::summary;
use crate::experiment::summary::{CurvePoint, Events};
use anyhow::Context;
use serde::Serialize;
use std::path::Path;

/// What a line of `summary.csv` holds beside its point.
#[derive(Default, Serialize)]
struct Intervals {
    /// 95 % bootstrap interval of the median root mean square error.
    rmse_median_low_m: Option<f64>,
    rmse_median_high_m: Option<f64>,
    /// Mean difference of the root mean square error from that of `random` in the same trial, its
    /// 95 % bootstrap interval, and the share of trials in which it is smaller.
    rmse_minus_random_m: Option<f64>,
    rmse_minus_random_low_m: Option<f64>,
    rmse_minus_random_high_m: Option<f64>,
    won_against_random: Option<f64>,
    /// The same against `active`.
    rmse_minus_active_m: Option<f64>,
    rmse_minus_active_low_m: Option<f64>,
    rmse_minus_active_high_m: Option<f64>,
    won_against_active: Option<f64>,
}

impl Intervals {
    fn new(run: &Run, point: &CurvePoint) -> Self {
        let (experiment, rows) = (&run.experiment, &run.rows);
        let errors: Vec<f64> = summary::of(rows, &point.planner)
            .filter_map(|row| row.touches.get(point.touches as usize - 1)?.metrics)
            .map(|metrics| metrics.rmse_m)
            .collect();
        let median = median_interval(&errors, experiment.seed);
        let [random, active] = BASELINES.map(|baseline| {
            let planners = [point.planner.as_str(), baseline];
            comparison::paired(experiment, rows, planners, point.touches, &RMSE)
                .filter(|_| point.planner != baseline)
        });
        let end = |paired: Option<Paired>, end: usize| Some(paired?.interval?[end]);
        Self {
            rmse_median_low_m: median.map(|[low, _]| low),
            rmse_median_high_m: median.map(|[_, high]| high),
            rmse_minus_random_m: random.map(|paired| paired.mean),
            rmse_minus_random_low_m: end(random, 0),
            rmse_minus_random_high_m: end(random, 1),
            won_against_random: random.map(|paired| paired.won),
            rmse_minus_active_m: active.map(|paired| paired.mean),
            rmse_minus_active_low_m: end(active, 0),
            rmse_minus_active_high_m: end(active, 1),
            won_against_active: active.map(|paired| paired.won),
        }
    }
}

/// Writes `summary.csv`: a line per planner and touch count.
///
/// # Errors
/// If it cannot be written.
pub fn write_csv(run: &Run, folder: &Path) -> anyhow::Result<()> {
    let curve = |planner| summary::curve(&run.experiment, &run.rows, planner);
    let points = run.experiment.planners.iter().flat_map(|planner| curve(planner));
    let lines = points.map(|point| {
        let intervals = Intervals::new(run, &point);
        (point, intervals)
    });
    write_lines(&folder.join("summary.csv"), lines)
}

/// Writes lines as CSV.
///
/// # Errors
/// If they cannot be written.
pub(super) fn write_lines<T: Serialize>(
    path: &Path,
    lines: impl Iterator<Item = T>,
) -> anyhow::Result<()> {
    let place = || path.display().to_string();
    let mut writer = csv::Writer::from_path(path).with_context(place)?;
    for line in lines {
        writer.serialize(line).with_context(place)?;
    }
    writer.flush().with_context(place)
}

/// One line per planner and drawn touch count, then what else happened.
pub fn summary(run: &Run) -> String {
    let mut lines = vec![HEADER.map(String::from)];
    for count in run.experiment.drawn_touch_counts() {
        for planner in &run.experiment.planners {
            let curve = summary::curve(&run.experiment, &run.rows, planner);
            lines.extend(curve.iter().find(|point| point.touches == count).map(cells));
        }
    }
    let widths: Vec<usize> = (0..HEADER.len())
        .map(|column| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = format!("{}\n", run.experiment.name);
    for line in &lines {
        for (cell, width) in line.iter().zip(&widths) {
            text += &format!("{cell:>width$}  ");
        }
        text = text.trim_end().to_owned() + "\n";
    }
    for planner in &run.experiment.planners {
        text += &described(planner, &summary::events(&run.rows, planner));
    }
    text.trim_end().into()
}

/// Column heads of the summary, here and on the page.
pub const HEADER: [&str; 12] = [
    "touches",
    "planner",
    "R (Eq. 5)",
    "centred R",
    "mean RMSE mm",
    "median RMSE mm",
    "median edge RMSE mm",
    "median largest error mm",
    "in 95 % band",
    "NLPD",
    "path m",
    "time s",
];

/// A point as the cells of a table.
pub fn cells(point: &CurvePoint) -> [String; 12] {
    let or_dash = |text: Option<String>| text.unwrap_or("-".into());
    [
        point.touches.to_string(),
        point.planner.clone(),
        with_error(point.r_mean, point.r_se, 4),
        with_error(point.centred_r_mean, point.centred_r_se, 4),
        with_error(1e3 * point.rmse_mean_m, point.rmse_se_m.map(|error| 1e3 * error), 3),
        format!("{:.3}", 1e3 * point.rmse_median_m),
        or_dash(point.edge_rmse_median_m.map(|edge| format!("{:.3}", 1e3 * edge))),
        or_dash(point.max_error_median_m.map(|error| format!("{:.2}", 1e3 * error))),
        or_dash(point.coverage_mean.map(|coverage| format!("{coverage:.3}"))),
        or_dash(point.nlpd_mean.map(|nlpd| format!("{nlpd:.3}"))),
        format!("{:.3}", point.path_mean_m),
        or_dash(point.time_mean_s.map(|time| format!("{time:.1}"))),
    ]
}

/// A mean and its standard error, if it has one.
pub fn with_error(mean: f64, error: Option<f64>, decimals: usize) -> String {
    let error = error.map_or(String::new(), |error| format!(" ± {error:.decimals$}"));
    format!("{mean:.decimals$}{error}")
}

/// What happened to a planner's trials, in a line; empty if nothing did.
pub fn described(planner: &str, events: &Events) -> String {
    let counts = [
        (events.failures, "failed trials"),
        (events.misses, "touches met nothing"),
        (events.overloads, "touches were broken off: too much force, or no place was felt"),
        (
            events.collapsed,
            "plans went to a random place instead, because the belief was sure of the best one",
        ),
        (events.repeated, "plans went to a random place instead, because they repeated a target"),
    ];
    let told: Vec<String> = counts
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    match told.is_empty() {
        true => String::new(),
        false => format!("{planner}: {}\n", told.join("; ")),
    }
}
