//! The planners against their baselines in every measure, as tables of the page and as a file.

use super::{Cell, Table, Verdict, titled, write_csv};
use crate::experiment::measure::{Direction, MEASURES, Measure, in_files};
use crate::experiment::statistics::comparison::Comparison;
use crate::experiment::store::Run;
use crate::report::number::{digits, with_interval};
use schemars::JsonSchema;
use serde::Serialize;
use std::path::Path;

/// A table for each baseline: a line for each measure, a column for each other planner.
pub fn tables(run: &Run, found: &[Comparison]) -> Vec<Table> {
    let table = |baseline: &str| {
        let of_baseline: Vec<&Comparison> =
            found.iter().filter(|comparison| comparison.baseline == baseline).collect();
        let others: Vec<&String> = (run.experiment.planners.iter())
            .filter(|name| of_baseline.iter().any(|comparison| comparison.planner == **name))
            .collect();
        let line = |measure: &Measure| -> Option<Vec<Cell>> {
            let of = |planner: &str| {
                let is_it = |comparison: &&&Comparison| {
                    comparison.planner == planner && comparison.measure.id == measure.id
                };
                of_baseline.iter().find(is_it)
            };
            let cells = others
                .iter()
                .map(|planner| of(planner).map_or("-".to_owned().into(), |it| cell(it)));
            others
                .iter()
                .any(|planner| of(planner).is_some())
                .then(|| std::iter::once(titled(measure).into()).chain(cells).collect())
        };
        Table {
            header: std::iter::once(format!("minus {baseline}"))
                .chain(others.iter().map(|planner| planner.to_string()))
                .collect(),
            lines: MEASURES.iter().filter_map(line).collect(),
        }
    };
    let baselines = run.experiment.baselines().into_iter();
    baselines.map(table).filter(|table| !table.lines.is_empty()).collect()
}

/// What the columns are.
pub fn note(run: &Run) -> String {
    let more: Vec<&str> = in_files(&run.rows)
        .filter(|measure| measure.direction == Direction::More)
        .map(|measure| measure.title)
        .collect();
    format!(
        "Differences after {} touches in the same trial: mean, its 95 % bootstrap interval, and \
         the share of trials in which the planner is better; better is more for {}, less for all \
         else. Bold, with the word beside it: the interval excludes 0, so the difference is \
         established.",
        run.experiment.touches,
        more.join(", ")
    )
}

/// A record of `comparison.csv`.
#[derive(Serialize, JsonSchema)]
pub struct ComparisonRecord<'a> {
    /// Which planner.
    pub planner: &'a str,
    /// Against which.
    pub baseline: &'a str,
    /// In which measure.
    pub measure: &'a str,
    /// Trials that both finished.
    pub trials: usize,
    /// Mean of the planner's value minus the baseline's, in the same trial.
    pub difference: f64,
    /// Lower end of its 95 % bootstrap interval.
    pub difference_low: Option<f64>,
    /// Upper end.
    pub difference_high: Option<f64>,
    /// Share of the trials in which the planner is better; a tie is half.
    pub won: f64,
}

/// Writes `comparison.csv`: a line per planner, baseline and measure after the last touch.
///
/// # Errors
/// If it cannot be written.
pub fn write(found: &[Comparison], folder: &Path) -> anyhow::Result<()> {
    let records =
        found.iter().map(|Comparison { planner, baseline, measure, paired }| ComparisonRecord {
            planner,
            baseline,
            measure: measure.id,
            trials: paired.trials,
            difference: paired.mean,
            difference_low: paired.interval.map(|[low, _]| low),
            difference_high: paired.interval.map(|[_, high]| high),
            won: paired.won,
        });
    write_csv(&folder.join("comparison.csv"), records)
}

/// Whether the planner is better or worse for certain.
pub fn verdict(comparison: &Comparison) -> Option<Verdict> {
    Verdict::of(comparison.paired.interval, 0.0, comparison.measure.direction)
}

fn cell(comparison: &Comparison) -> Cell {
    let shown = |value: f64| {
        let value = comparison.measure.unit.per_si * value;
        let sign = if value < 0.0 { "\u{2212}" } else { "" };
        format!("{sign}{}", digits(value.abs()))
    };
    let paired = &comparison.paired;
    let mean = with_interval(paired.mean, paired.interval, &shown);
    let words = format!("{mean}, {:.0} %", 100.0 * paired.won);
    Cell { words, verdict: verdict(comparison) }
}
