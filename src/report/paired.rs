//! The planners against their baselines, as tables of the page and as files.

use super::replay::digits;
use super::table::write_lines;
use crate::experiment::comparison::{BASELINES, Comparison};
use crate::experiment::measure::{MEASURES, Measure};
use crate::experiment::store::Run;
use serde::Serialize;
use std::path::Path;

/// A table of the page.
pub struct Table {
    /// Column heads.
    pub header: Vec<String>,
    /// Its lines, a cell for each head.
    pub lines: Vec<Vec<String>>,
}

/// A table for each baseline that ran: a line for each measure, a column for each other planner.
pub fn tables(run: &Run, found: &[Comparison]) -> Vec<Table> {
    let table = |baseline: &str| {
        let of_baseline: Vec<&Comparison> =
            found.iter().filter(|comparison| comparison.baseline == baseline).collect();
        let others: Vec<&String> = (run.experiment.planners.iter())
            .filter(|name| of_baseline.iter().any(|comparison| comparison.planner == **name))
            .collect();
        let line = |measure: &Measure| -> Option<Vec<String>> {
            let of = |planner: &str| {
                let is_it = |comparison: &&&Comparison| {
                    comparison.planner == planner && comparison.measure.name == measure.name
                };
                of_baseline.iter().find(is_it)
            };
            let cells = others.iter().map(|planner| of(planner).map_or("-".into(), |it| cell(it)));
            others
                .iter()
                .any(|planner| of(planner).is_some())
                .then(|| std::iter::once(titled(measure)).chain(cells).collect())
        };
        Table {
            header: std::iter::once(format!("minus {baseline}"))
                .chain(others.iter().map(|planner| planner.to_string()))
                .collect(),
            lines: MEASURES.iter().filter_map(line).collect(),
        }
    };
    BASELINES.into_iter().map(table).filter(|table| !table.lines.is_empty()).collect()
}

/// What the columns are.
pub fn note(run: &Run) -> String {
    format!(
        "Differences after {} touches in the same trial: mean, its 95 % bootstrap interval, and the \
         share of trials in which the planner is better; better is more for the correlations, less \
         for all else. A difference whose interval contains 0 is not established.",
        run.experiment.touches
    )
}

/// A line of `comparison.csv`.
#[derive(Serialize)]
struct Line<'a> {
    planner: &'a str,
    baseline: &'a str,
    measure: &'a str,
    trials: usize,
    difference: f64,
    difference_low: Option<f64>,
    difference_high: Option<f64>,
    won: f64,
}

/// Writes `comparison.csv`: a line per planner, baseline and measure after the last touch.
///
/// # Errors
/// If it cannot be written.
pub fn write_csv(found: &[Comparison], folder: &Path) -> anyhow::Result<()> {
    let lines = found.iter().map(|Comparison { planner, baseline, measure, paired }| Line {
        planner,
        baseline,
        measure: measure.name,
        trials: paired.trials,
        difference: paired.mean,
        difference_low: paired.interval.map(|[low, _]| low),
        difference_high: paired.interval.map(|[_, high]| high),
        won: paired.won,
    });
    write_lines(&folder.join("comparison.csv"), lines)
}

/// A measure with its unit.
pub(super) fn titled(measure: &Measure) -> String {
    match measure.shown_in.0 {
        "" => measure.title.into(),
        unit => format!("{}, {unit}", measure.title),
    }
}

fn cell(comparison: &Comparison) -> String {
    let shown = |value: f64| {
        let value = comparison.measure.shown_in.1 * value;
        let sign = if value < 0.0 { "\u{2212}" } else { "" };
        format!("{sign}{}", digits(value.abs()))
    };
    let paired = &comparison.paired;
    let mean = with_interval(paired.mean, paired.interval, &shown);
    format!("{mean}, {:.0} %", 100.0 * paired.won)
}

/// A number and its interval, if it has one.
pub fn with_interval(
    value: f64,
    interval: Option<[f64; 2]>,
    shown: &dyn Fn(f64) -> String,
) -> String {
    let interval =
        interval.map_or(String::new(), |[low, high]| format!(" [{}, {}]", shown(low), shown(high)));
    format!("{}{interval}", shown(value))
}
