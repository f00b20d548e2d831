//! Tables of a benchmark of planners.

use super::table::{Cell, Column, Table};
use crate::experiment::measure::{self, Direction, Measure, MeasureUnit};
use crate::study::benchmark::{BenchmarkResult, PlannerResult, RelativeError};
use crate::study::check::measures::ERROR_FLOOR_M;
use crate::study::measure_means::MeasureMeans;
use crate::study::objects::Rival;

fn judged(error: &RelativeError) -> Cell {
    let cell = Cell::estimate(error.estimate());
    cell.with_verdict(error.error_interval, 1.0, Direction::Minimise)
}

/// Returns all tables with their captions: errors relative to the reference planner, then measures.
pub fn tables(result: &BenchmarkResult) -> Vec<(String, Table)> {
    let has_errors = !result.reference.is_empty();
    let errors = has_errors.then(|| (note(result), errors(result)));
    let objects =
        if has_errors { format!(" and {} objects", result.objects.len()) } else { String::new() };
    let all = measures(result, |planner| Some(&planner.means))
        .map(|table| (format!("Means over trials{objects}. {}", measures_note(result)), table));
    let others = measures(result, |planner| planner.reporting.as_ref()).map(|table| {
        let count = result.objects.len() - result.tuned_on.len();
        (format!("The same over the {count} objects by which no settings were chosen."), table)
    });
    errors.into_iter().chain(all).chain(others).collect()
}

/// Returns the table of errors with a row for each planner, the smallest error first.
fn errors(result: &BenchmarkResult) -> Table {
    let objects = result.objects.len();
    let first = [
        Column::new("planner"),
        Column::new("error").title(format!("error, relative to {}", result.reference)),
        Column::new("better on"),
        Column::new("worse on"),
        Column::new("gap closed").unit("%", 100.0, 0),
    ];
    // Whole objects have no zones.
    let zones = ["full zones", "open zones"].map(|name| Column::new(name).unit("%", 100.0, 0));
    let zones = zones.into_iter().filter(|_| result.measures.is_empty());
    let after = |budget: &u32| Column::new(format!("after {budget}"));
    let last = [Column::new("failed")];
    let columns = first.into_iter().chain(zones).chain(result.budgets.iter().map(after));
    let mut table = Table::new(columns.chain(last));
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
        ];
        if result.measures.is_empty() {
            row.extend([planner.gap_closed_full.into(), planner.gap_closed_open.into()]);
        }
        row.extend(after);
        row.push(failed(planner.failures, planner.trials));
        table.rows.push(row);
    }
    table
}

fn failed(failures: usize, trials: usize) -> Cell {
    format!("{failures} of {}", trials + failures).into()
}

/// Returns the table of the measures: the first after each budget, the others after the last. It
/// has a row for each planner, or for each scene of a library and each planner. `None` without
/// measures.
fn measures(
    result: &BenchmarkResult,
    of: fn(&PlannerResult) -> Option<&MeasureMeans>,
) -> Option<Table> {
    let measures: Vec<&Measure> =
        result.measures.iter().filter_map(|name| measure::by_id(name)).collect();
    let (first, others) = measures.split_first()?;
    of(result.planners.first()?)?;
    let last = result.budgets.len().checked_sub(1)?;
    let is_library = result.reference.is_empty();
    let column = |measure: &Measure, name: String, title: String| {
        let MeasureUnit { symbol, per_si, decimals, .. } = measure.unit;
        Column::new(name).title(title).unit(symbol, per_si, decimals)
    };
    let scene = is_library.then(|| Column::new("scene"));
    let budgets = result.budgets.iter().map(|budget| {
        column(first, format!("after {budget}"), format!("{} after {budget}", first.title))
    });
    let shares = ["left", "gap closed"].map(|name| Column::new(name).unit("%", 100.0, 1));
    let shares = shares.into_iter().filter(|_| !is_library);
    let others_columns =
        others.iter().map(|it| column(it, it.title.to_owned(), it.title.to_owned()));
    let ends = ["95 % sure after", "failed"].map(Column::new).into_iter().filter(|_| is_library);
    let columns = scene.into_iter().chain([Column::new("planner")]).chain(budgets);
    let columns = columns.chain(shares).chain(others_columns).chain(ends);
    let mut table = Table::new(columns);
    let cells = |means: &MeasureMeans| -> [Vec<Cell>; 2] {
        let after = |index: usize| match means.get(first.id, index) {
            found if index == last => Cell::estimate(found),
            found => Cell::from(found.map(|found| found.value)),
        };
        let others = others.iter().map(|it| Cell::estimate(means.get(it.id, last)));
        [(0..=last).map(after).collect(), others.collect()]
    };
    if is_library {
        for (i, scene) in result.objects.iter().enumerate() {
            for planner in &result.planners {
                let on_scene = &planner.objects[i];
                let mut row = vec![scene.as_str().into(), planner.name.as_str().into()];
                row.extend(cells(&on_scene.means).concat());
                row.push(on_scene.sure_after.into());
                row.push(failed(on_scene.failures, on_scene.trials));
                table.rows.push(row);
            }
        }
        return Some(table);
    }
    for planner in &result.planners {
        let is_all = of(planner)? == &planner.means;
        let shares = [planner.left, planner.mean_gap_closed].map(|it| it.filter(|_| is_all));
        let [after, others] = cells(of(planner)?);
        let mut row = vec![planner.name.as_str().into()];
        row.extend(after.into_iter().chain(shares.map(Cell::from)).chain(others));
        table.rows.push(row);
    }
    Some(table.without_empty())
}

/// Returns the note that explains the columns of the measures.
fn measures_note(result: &BenchmarkResult) -> String {
    let measures = result.measures.iter().filter_map(|name| measure::by_id(name));
    let titles: Vec<&str> = measures.clone().map(|measure| measure.title).collect();
    let (first, others) = titles.split_first().map_or(("", &[][..]), |(a, b)| (*a, b));
    let medians: Vec<&str> =
        measures.filter(|it| !it.aggregate.has_mean()).map(|it| it.title).collect();
    let medians = match medians.is_empty() {
        true => String::new(),
        false => format!(" Medians over trials: {}.", medians.join(", ")),
    };
    let last = result.budgets.last().copied().unwrap_or(0);
    let has_left = result.planners.iter().any(|planner| planner.left.is_some());
    let mut shares = String::new();
    if let Some(start) = result.budgets.first().filter(|_| has_left) {
        shares += &format!(" Left: the last mean in % of that after {start} touches.");
    }
    if result.planners.iter().any(|planner| planner.mean_gap_closed.is_some()) {
        shares += " Gap closed: share of the way of the last mean from `random` to `oracle`.";
    }
    if result.reference.is_empty() {
        shares += " 95 % sure after: median of the touches until an object has that probability.";
    }
    let others = match others.is_empty() {
        true => String::new(),
        false => format!("; after {last}: {}", others.join(", ")),
    };
    format!(
        "After N touches: {first}{others}.{medians}{shares} In brackets: 95 % interval, of Wilson for \
         shares of trials, else of a bootstrap over trials."
    )
}

/// Returns the results of other systems as a table; `None` without any.
fn rivals(result: &BenchmarkResult) -> Option<Table> {
    let mut table = Table::new(["system", "figure", "source", "differences"].map(Column::new));
    let row = |Rival { system, figure, source, differs }: &Rival| {
        [system, figure, source, differs].map(|text| Cell::from(text.as_str())).to_vec()
    };
    table.rows = result.rivals.iter().map(row).collect();
    (!table.rows.is_empty()).then_some(table)
}

/// Returns the measures as CSV: for each object, planner, budget and measure the mean over trials
/// with its 95 % interval, in SI units. `None` for a protocol without measures.
pub fn csv(result: &BenchmarkResult) -> Option<String> {
    if result.measures.is_empty() {
        return None;
    }
    let mut text = String::from("object,planner,touches,measure,mean,low,high,trials\n");
    let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    for planner in &result.planners {
        for on in &planner.objects {
            for measure in &result.measures {
                for (i, touches) in result.budgets.iter().enumerate() {
                    let found = on.means.get(measure, i);
                    let value = number(found.map(|it| it.value));
                    let ends = found.and_then(|it| it.interval);
                    let [low, high] = [0, 1].map(|i| number(ends.map(|ends| ends[i])));
                    text += &format!(
                        "{},{},{touches},{measure},{value},{low},{high},{}\n",
                        on.object, planner.name, on.trials
                    );
                }
            }
        }
    }
    Some(text)
}

/// Returns the tables as Markdown, with what is needed to compare them with others.
pub fn markdown(result: &BenchmarkResult) -> String {
    let BenchmarkResult { protocol, protocol_sha256, palpate, commit, .. } = result;
    let quick = match result.quick {
        true => "Quick variant, a part of the protocol: to try out only, not comparable.\n\n",
        false => "",
    };
    let objects = if result.reference.is_empty() { "scenes" } else { "objects" };
    let tables = tables(result).into_iter();
    let tables: Vec<String> =
        tables.map(|(note, table)| format!("{}\n{note}\n", table.markdown())).collect();
    let rivals = rivals(result).map_or(String::new(), |table| {
        format!("\nOther systems, on tasks that differ:\n\n{}", table.markdown())
    });
    format!(
        "Palpate benchmark, protocol {protocol} (SHA-256 {protocol_sha256}), Palpate {palpate} (commit \
         {commit}). {} {objects}, {} trials of each planner on each, {} initial and {} planned \
         touches.\n\n{quick}{}{rivals}",
        result.objects.len(),
        result.trials,
        result.initial_touches,
        result.touches - result.initial_touches,
        tables.join("\n"),
    )
}

/// Returns the note that explains the columns of the errors.
fn note(result: &BenchmarkResult) -> String {
    let against = &result.reference;
    let zones = match result.measures.is_empty() {
        true => "; also over the zones that their object fills, and over those that it leaves open",
        false => "",
    };
    format!(
        "Error: exp(mean log error over the touches after the initial ones), relative to `{against}` in \
         the same trial; geometric mean over trials and objects, with the 95 % interval of a bootstrap \
         over trials. Less is better; better and worse on: objects whose interval excludes 1. Gap \
         closed: share of the way from `random` to `oracle`, which uses the ground truth{zones}. After N: error after N \
         touches, relative to that of `{against}`. Errors below {:.0} µm count as that. A failed trial counts \
         with its last belief to the end.",
        1e6 * ERROR_FLOOR_M
    )
}
