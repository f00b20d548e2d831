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

/// Names of measures of a whole object, each with its column, after the last budget.
const SHAPES: [(&str, &str, f64); 5] = [
    ("reachable_chamfer_share", "reachable, % of the diagonal", 100.0),
    ("f_1_mm", "F at 1 mm", 1.0),
    ("f_2_mm", "F at 2 mm", 1.0),
    ("reached_2_mm", "reached within 2 mm, %", 100.0),
    ("iou", "IoU", 1.0),
];

/// Returns the table of the estimated shapes: the Chamfer distance in percent of the diagonal after
/// each budget, and other measures after the last; `None` for a protocol of zones.
pub fn shapes(result: &BenchmarkResult) -> Option<Table> {
    result.planners.first().filter(|planner| !planner.measures.is_empty())?;
    let chamfer =
        |budget: &u32| Column::new(format!("Chamfer, %, after {budget}")).unit("%", 100.0, 2);
    let other = |(_, title, factor): &(&str, &str, f64)| {
        Column::new(*title).unit("", *factor, if *factor > 1.0 { 2 } else { 3 })
    };
    let columns = result.budgets.iter().map(chamfer).chain(SHAPES.iter().map(other));
    let mut table = Table::new(std::iter::once(Column::new("planner")).chain(columns));
    for planner in &result.planners {
        let after = |name: &str| planner.measures.get(name).cloned().unwrap_or_default();
        let last = |(name, ..): &(&str, &str, f64)| after(name).last().copied().flatten();
        let mut row: Vec<Cell> = vec![planner.name.as_str().into()];
        row.extend(after("chamfer_share").into_iter().map(Cell::from));
        row.extend(SHAPES.iter().map(last).map(Cell::from));
        table.rows.push(row);
    }
    Some(table)
}

/// Returns the measures of whole objects as CSV: for each object, planner, budget and measure the
/// mean over trials, in SI units. `None` for a protocol of zones.
pub fn csv(result: &BenchmarkResult) -> Option<String> {
    result.planners.first().filter(|planner| !planner.measures.is_empty())?;
    let mut text = String::from("object,planner,touches,measure,mean,trials\n");
    for planner in &result.planners {
        for object in &planner.objects {
            for (measure, values) in &object.measures {
                for (touches, value) in result.budgets.iter().zip(values) {
                    let value = value.map_or(String::new(), |value| value.to_string());
                    text += &format!(
                        "{},{},{touches},{measure},{value},{}\n",
                        object.object, planner.name, object.trials
                    );
                }
            }
        }
    }
    Some(text)
}

/// Returns the table as Markdown, with what is needed to compare it with another one.
pub fn markdown(result: &BenchmarkResult) -> String {
    let BenchmarkResult { protocol, protocol_sha256, palpate, commit, .. } = result;
    let quick = match result.quick {
        true => "Quick variant, a part of the protocol: to try out only, not comparable.\n\n",
        false => "",
    };
    let shapes = shapes(result).map_or(String::new(), |table| {
        let measures = "Means over trials and objects. Chamfer: mean of the mean distances true → \
                        estimated and estimated → true; reachable: mean distance of the surface that the \
                        finger can touch.";
        format!("\n{}\n{measures}\n", table.markdown())
    });
    format!(
        "Palpate benchmark, protocol {protocol} (SHA-256 {protocol_sha256}), Palpate {palpate} (commit \
         {commit}). {} objects, {} trials of each planner on each, {} initial and {} planned \
         touches.\n\n{quick}{}\n{}\n{shapes}",
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
