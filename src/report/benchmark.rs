//! Table of a benchmark of planners.

use super::table::{Cell, Column, Table};
use crate::experiment::measure::Direction;
use crate::study::benchmark::{BenchmarkResult, RelativeError};
use crate::study::check::measures::ERROR_FLOOR_M;

fn judged(error: &RelativeError) -> Cell {
    let cell = Cell::estimate(error.estimate());
    cell.with_verdict(error.error_interval, 1.0, Direction::Minimise)
}

/// Returns the table with a row for each planner, the smallest error first.
pub fn table(result: &BenchmarkResult) -> Table {
    let objects = result.objects.len();
    let first = [
        Column::new("planner"),
        Column::new("error").title(format!("error, relative to {}", result.reference)),
        Column::new("better on"),
        Column::new("worse on"),
        Column::new("gap closed").unit("%", 100.0, 0),
        Column::new("full zones").unit("%", 100.0, 0),
        Column::new("open zones").unit("%", 100.0, 0),
    ];
    let after = |budget: &u32| Column::new(format!("after {budget}"));
    let last = [Column::new("failed")];
    let mut table =
        Table::new(first.into_iter().chain(result.budgets.iter().map(after)).chain(last));
    for planner in &result.planners {
        let name = planner.name.as_str();
        let count = |count: usize| match name == result.reference {
            true => Cell::default(),
            false => Cell::from(format!("{count} of {objects}")),
        };
        let after = planner.after.iter().map(|error| Cell::from(error.error));
        let mut row = vec![
            name.into(),
            judged(&planner.error),
            count(planner.better_on),
            count(planner.worse_on),
            planner.gap_closed.into(),
            planner.gap_closed_full.into(),
            planner.gap_closed_open.into(),
        ];
        row.extend(after);
        row.push(format!("{} of {}", planner.failures, planner.trials + planner.failures).into());
        table.rows.push(row);
    }
    table
}

/// Returns the table as Markdown, with what is needed to compare it with another one.
pub fn markdown(result: &BenchmarkResult) -> String {
    let BenchmarkResult { protocol, protocol_sha256, palpate, commit, .. } = result;
    let quick = match result.quick {
        true => "Quick variant, a part of the protocol: to try out only, not comparable.\n\n",
        false => "",
    };
    format!(
        "Palpate benchmark, protocol {protocol} (SHA-256 {protocol_sha256}), Palpate {palpate} (commit \
         {commit}). {} objects, {} trials of each planner on each, {} initial and {} planned \
         touches.\n\n{quick}{}\n{}\n",
        result.objects.len(),
        result.trials,
        result.initial_touches,
        result.touches - result.initial_touches,
        table(result).markdown(),
        note(result),
    )
}

/// Returns the note that explains the columns.
fn note(result: &BenchmarkResult) -> String {
    let against = &result.reference;
    format!(
        "Error: exp(mean log error over the touches after the initial ones), relative to `{against}` in \
         the same trial; geometric mean over trials and objects, with the 95 % interval of a bootstrap \
         over trials. Less is better; better and worse on: objects whose interval excludes 1. Gap \
         closed: share of the way from `random` to `oracle`, which uses the ground truth; also over the \
         zones that their object fills, and over those that it leaves open. After N: error after N \
         touches, relative to that of `{against}`. Errors below {:.0} µm count as that. A failed trial counts \
         with its last belief to the end.",
        1e6 * ERROR_FLOOR_M
    )
}
