//! The curves as a table of the page and of the terminal, and as a file.

use super::{Cell, Table, titled, write_csv_with};
use crate::experiment::measure::{MEASURES, Measure};
use crate::experiment::statistics::curve_table::{columns, curve_table};
use crate::experiment::statistics::summary;
use crate::experiment::statistics::summary::{CurvePoint, Events};
use crate::experiment::store::Run;
use crate::report::number::{shown, with_error};
use serde_json::{Map, Value, json};
use std::path::Path;

/// A column: a measure over the trials.
struct Column {
    measure: &'static Measure,
    /// Its median; otherwise its mean.
    is_median: bool,
}

impl Column {
    fn all() -> impl Iterator<Item = Self> {
        MEASURES.iter().filter(|measure| measure.is_tabled).flat_map(|measure| {
            let told = [measure.aggregate.has_mean(), measure.aggregate.has_median()];
            let columns = [false, true].map(|is_median| Self { measure, is_median });
            columns.into_iter().zip(told).filter(|(_, told)| *told).map(|(column, _)| column)
        })
    }

    fn cell(&self, point: &CurvePoint) -> Option<String> {
        let summary = point.of(self.measure)?;
        Some(match self.is_median {
            true => shown(self.measure, summary.median),
            false => with_error(self.measure, summary.mean, summary.error),
        })
    }

    fn named(&self, name: &str) -> String {
        format!("{} {name}", if self.is_median { "median" } else { "mean" })
    }

    /// Its head where lines are short: the measure as in files, with the unit it is shown in.
    fn short(&self) -> String {
        let name = self.measure.stem().replace('_', " ");
        self.named(format!("{name} {}", self.measure.unit.symbol).trim_end())
    }
}

/// A line per planner and tabled touch count; columns that nothing stands in are left out.
pub fn table(run: &Run) -> Table {
    with_heads(run, |column| column.named(&titled(column.measure)))
}

/// What the cells of [`table`] are.
pub fn note(run: &Run) -> String {
    format!("± is one standard error of the mean over {} trials.", run.experiment.trials)
}

fn with_heads(run: &Run, head: impl Fn(&Column) -> String) -> Table {
    let curves: Vec<Vec<CurvePoint>> = (run.experiment.planners.iter())
        .map(|planner| summary::curve(&run.experiment, &run.rows, planner))
        .collect();
    let counts = run.experiment.tabled_touch_counts().into_iter();
    let points: Vec<&CurvePoint> = counts
        .flat_map(|count| curves.iter().flatten().filter(move |point| point.touches == count))
        .collect();
    let columns: Vec<Column> = Column::all()
        .filter(|column| points.iter().any(|point| column.cell(point).is_some()))
        .collect();
    let start = ["touches", "planner"].map(String::from).into_iter();
    let line = |point: &&CurvePoint| {
        let start = [point.touches.to_string(), point.planner.clone()].into_iter();
        let cells = columns.iter().map(|column| column.cell(point).unwrap_or("-".into()));
        start.chain(cells).map(Cell::from).collect()
    };
    Table {
        header: start.chain(columns.iter().map(head)).collect(),
        lines: points.iter().map(line).collect(),
    }
}

/// The table for the terminal, then what else happened.
pub fn text(run: &Run) -> String {
    let Table { header, lines } = with_heads(run, Column::short);
    let words = |line: Vec<Cell>| line.into_iter().map(|cell| cell.words).collect();
    let lines: Vec<Vec<String>> = lines.into_iter().map(words).collect();
    let lines = || std::iter::once(&header).chain(&lines);
    let widths: Vec<usize> = (0..header.len())
        .map(|column| lines().map(|line| line[column].chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = format!("{}\n", run.experiment.name);
    for line in lines() {
        for (cell, width) in line.iter().zip(&widths) {
            text += &format!("{cell:>width$}  ");
        }
        text = text.trim_end().to_owned() + "\n";
    }
    happened(run).iter().for_each(|line| text += &format!("{line}\n"));
    run.notices().iter().for_each(|notice| text += &format!("note: {notice}\n"));
    text.trim_end().into()
}

/// The summary for programs: of each planner and tabled touch count the columns of `summary.csv`,
/// and what a reader should know.
pub fn json(run: &Run) -> Value {
    let counts = run.experiment.tabled_touch_counts();
    let columns = columns(&run.experiment, &run.rows);
    let lines = curve_table(&run.experiment, &run.rows, |count| counts.contains(&count));
    let lines = lines.into_iter().map(|(point, values)| {
        let values: Map<String, Value> =
            columns.iter().cloned().zip(values.into_iter().map(Value::from)).collect();
        json!({
            "planner": point.planner, "touches": point.touches, "trials": point.trials,
            "measures": values,
        })
    });
    let notices = run.notices();
    json!({
        "name": run.experiment.name,
        "trials": run.rows.len(),
        "failed": run.rows.iter().filter(|row| row.failure.is_some()).count(),
        "summary": lines.collect::<Vec<_>>(),
        "notes": notices.into_iter().chain(happened(run)).collect::<Vec<_>>(),
    })
}

/// What happened to the trials besides their errors, a line each.
pub fn happened(run: &Run) -> Vec<String> {
    let of = |planner: &String| told(planner, &summary::events(&run.rows, planner));
    let unlisted = (run.unlisted > 0).then(|| {
        format!(
            "{} trials in the folder are kept but not shown, because the experiment does not list \
             them",
            run.unlisted
        )
    });
    run.experiment.planners.iter().filter_map(of).chain(unlisted).collect()
}

/// Writes `summary.csv`: a line per planner and touch count.
///
/// # Errors
/// If it cannot be written.
pub fn write(run: &Run, folder: &Path) -> anyhow::Result<()> {
    let header = ["planner", "touches", "trials"].map(String::from).into_iter();
    let header = header.chain(columns(&run.experiment, &run.rows));
    let curves = curve_table(&run.experiment, &run.rows, |_| true);
    let records = curves
        .into_iter()
        .map(|(point, values)| (point.planner, point.touches, point.trials, values));
    write_csv_with(&folder.join("summary.csv"), header, records)
}

/// What happened to a planner's trials, in a line; none if nothing did.
fn told(planner: &str, events: &Events) -> Option<String> {
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
    (!told.is_empty()).then(|| format!("{planner}: {}", told.join("; ")))
}
