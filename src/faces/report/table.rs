//! The summary of a run as text and as CSV.

use crate::trials::store::Run;
use crate::trials::summary::{self, Events, Point};
use anyhow::Context;
use std::path::Path;

/// Writes `summary.csv`: a line per planner and touch count.
///
/// # Errors
/// If it cannot be written.
pub fn write_csv(run: &Run, folder: &Path) -> anyhow::Result<()> {
    let path = folder.join("summary.csv");
    let mut writer = csv::Writer::from_path(&path).with_context(|| path.display().to_string())?;
    for planner in &run.experiment.planners {
        for point in summary::curve(&run.experiment, &run.rows, planner) {
            writer.serialize(point)?;
        }
    }
    writer.flush().with_context(|| path.display().to_string())
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
pub const HEADER: [&str; 7] = [
    "touches",
    "planner",
    "R (Eq. 5)",
    "centred R",
    "mean RMSE mm",
    "median RMSE mm",
    "median edge RMSE mm",
];

/// A point as the cells of a table.
pub fn cells(point: &Point) -> [String; 7] {
    [
        point.touches.to_string(),
        point.planner.clone(),
        with_error(point.r_mean, point.r_se, 4),
        with_error(point.centred_r_mean, point.centred_r_se, 4),
        with_error(1e3 * point.rmse_mean_m, point.rmse_se_m.map(|error| 1e3 * error), 3),
        format!("{:.3}", 1e3 * point.rmse_median_m),
        point.edge_rmse_median_m.map_or("-".into(), |edge| format!("{:.3}", 1e3 * edge)),
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
        (
            events.collapsed,
            "plans went to a random place instead, because the belief was sure everywhere",
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
