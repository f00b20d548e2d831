//! Comparison of the planners of a run with its baselines, in every measure and in touches to equal
//! error: tables of the page and of files.

use crate::experiment::measure::{Direction, MEASURES, Measure, measures_with_columns};
use crate::experiment::statistics::comparison::PairedComparison;
use crate::experiment::statistics::equal_error::{EqualError, IntervalEstimate, errors};
use crate::experiment::store::Run;
use crate::report::findings::too_few;
use crate::report::table::{Cell, Column, Table, digits, title_with_unit, with_interval};
use palpate_input::format::counted;

/// Returns the table of `comparison.csv`, with a row per planner, baseline and measure after the
/// last touch.
pub fn comparison_file(found: &[PairedComparison]) -> Table {
    let mut table = Table::new([
        Column::new("planner").note("Name of the planner."),
        Column::new("baseline").note("Planner that it is compared with."),
        Column::new("measure").note("Measure that is compared."),
        Column::new("trials").note("Trials that both finished."),
        Column::new("difference")
            .note("Mean of the planner's value minus the baseline's, in the same trial.")
            .interval(),
        Column::new("won")
            .note("Fraction of the trials in which the planner is better; a tie counts half."),
    ]);
    for PairedComparison { planner, baseline, measure, paired } in found {
        let difference = IntervalEstimate { value: paired.mean, interval: paired.interval };
        let names = [*planner, *baseline, measure.id].map(Cell::from);
        let numbers = [paired.trials.into(), Cell::estimate(difference), paired.won.into()];
        table.rows.push(names.into_iter().chain(numbers).collect());
    }
    table
}

/// Returns a table for each baseline: a row for each measure, a column for each other planner.
pub fn comparisons(run: &Run, found: &[PairedComparison]) -> Vec<Table> {
    let table = |baseline: &str| {
        let rows = MEASURES.iter().map(|measure| (title_with_unit(measure), measure));
        let cell = |measure: &&Measure, planner: &&String| {
            let is_it = |it: &&PairedComparison| {
                (it.baseline, it.planner, it.measure.id) == (baseline, planner, measure.id)
            };
            found.iter().find(is_it).map(difference)
        };
        Table::cross(format!("minus {baseline}"), rows, planners(run), cell)
    };
    tables(run, table)
}

/// Returns the note that explains the cells of [`comparisons`].
pub fn comparisons_note(run: &Run) -> String {
    let more: Vec<&str> = measures_with_columns(&run.rows)
        .filter(|measure| measure.direction == Direction::Maximise)
        .map(|measure| measure.title)
        .collect();
    format!(
        "Differences after {} in the same trial: mean, its 95 % bootstrap interval, and the \
         percentage of trials in which the planner is better. For {} more is better, for all others \
         less. Bold values with a verdict: the interval excludes 0.",
        counted(run.experiment.touches, "touch"),
        more.join(", ")
    )
}

fn difference(comparison: &PairedComparison) -> Cell {
    let PairedComparison { measure, paired, .. } = comparison;
    let shown = |value: f64| {
        let value = measure.unit.per_si * value;
        let size = digits(value.abs());
        let sign = if value < 0.0 && size != "0" { "\u{2212}" } else { "" };
        format!("{sign}{size}")
    };
    let mean = with_interval(paired.mean, paired.interval, &shown);
    let words = format!("{mean}, {:.0} %", 100.0 * paired.won);
    match too_few(paired.trials) {
        Some(_) => Cell::from(format!("{words}, {}", counted(paired.trials, "trial"))),
        None => Cell::from(words).with_verdict(paired.interval, 0.0, measure.direction),
    }
}

/// Returns the table of `equal_error.csv`, with a row per planner, baseline and error; a count or
/// ratio is empty if the error is not reached.
pub fn equal_error_file(found: &[EqualError]) -> Table {
    let mut table = Table::new([
        Column::new("planner").note("Name of the planner."),
        Column::new("baseline").note("Planner whose error is the goal."),
        Column::new("measure").note("Measure of the error."),
        Column::new("trials").note("Trials that both finished."),
        Column::new("goal").note("The baseline's median error after report.goal_touches touches."),
        Column::new("baseline_touches")
            .note("Touches until the baseline itself reaches the goal; empty: never."),
        Column::new("touches").note("Touches until the planner reaches the goal.").interval(),
        Column::new("ratio").note("Ratio of the planner's touches to the baseline's.").interval(),
        Column::new("path_ratio")
            .note("Ratio of the planner's lateral travel after the initial touches to the baseline's.")
            .interval(),
        Column::new("time_ratio")
            .note("Ratio of the robot's time from its start to the baseline's; empty without motion.")
            .interval(),
    ]);
    for it in found {
        let names = [it.planner, it.baseline, it.measure.id].map(Cell::from);
        let numbers = [it.trials.into(), it.goal.into(), it.baseline_touches.into()];
        let estimates = [it.touches, it.ratio, it.path_ratio, it.time_ratio].map(Cell::estimate);
        table.rows.push(names.into_iter().chain(numbers).chain(estimates).collect());
    }
    table
}

/// Returns a table for each baseline: a row for each other planner, a column for each error.
pub fn equal_errors(run: &Run, found: &[EqualError]) -> Vec<Table> {
    let most = run.experiment.touches;
    let table = |baseline: &str| {
        let of = |error: &Measure, planner: Option<&String>| {
            found.iter().find(|it| {
                (it.baseline, it.measure.id) == (baseline, error.id)
                    && planner.is_none_or(|planner| it.planner == planner)
            })
        };
        let head = |error: &'static Measure| {
            let (unit, equal) = (error.unit, of(error, None)?);
            let goal = format!("{} {}", digits(unit.per_si * equal.goal), unit.symbol);
            let own = touches(equal.baseline_touches, most);
            Some((Column::new(format!("{}: {goal}, {baseline} {own}", error.title)), error))
        };
        let rows = run.experiment.planners.iter().map(|planner| (planner.clone(), planner));
        let cell =
            |planner: &&String, error: &&Measure| Some(effort(of(error, Some(planner))?, most));
        let columns = errors().filter_map(head).collect();
        Table::cross(format!("to the error of {baseline}"), rows, columns, cell)
    };
    tables(run, table)
}

/// Returns the note that explains the cells of [`equal_errors`].
pub fn equal_errors_note(run: &Run) -> String {
    format!(
        "Touches, including the initial ones, after which a planner\u{2019}s median error stays at or \
         below the goal in the column\u{2019}s head, the baseline\u{2019}s error after {}. After \
         \u{d7}: their ratio to the baseline\u{2019}s own count; then the ratios of the lateral travel \
         after the initial touches and of the robot\u{2019}s time. All with the 95 % interval of a bootstrap over trials. Bold values \
         with a verdict: the interval of the touches\u{2019} ratio excludes 1.",
        counted(run.experiment.goal_touches(), "touch")
    )
}

fn effort(equal: &EqualError, most: u32) -> Cell {
    // Without a count there is no ratio, and of its interval at most the lower end.
    if !equal.touches.value.is_finite() {
        let low = equal.touches.interval.map_or(f64::INFINITY, |[low, _]| low);
        let some = if low.is_finite() { format!(", at least {low:.0}") } else { String::new() };
        return format!("{}{some}", touches(f64::INFINITY, most)).into();
    }
    let shown = |estimate: &IntervalEstimate, shown: &dyn Fn(f64) -> String| {
        with_interval(estimate.value, estimate.interval, shown)
    };
    let ratio = |ratio: f64| if ratio.is_finite() { format!("{ratio:.2}") } else { "–".into() };
    let mut words = format!(
        "{} \u{d7} {}; travel \u{d7} {}",
        shown(&equal.touches, &|count| touches(count, most)),
        shown(&equal.ratio, &ratio),
        shown(&equal.path_ratio, &ratio),
    );
    if equal.time_ratio.value.is_finite() {
        words += &format!("; time \u{d7} {}", shown(&equal.time_ratio, &ratio));
    }
    Cell::from(words).with_verdict(equal.ratio.interval, 1.0, Direction::Minimise)
}

fn touches(count: f64, most: u32) -> String {
    if count.is_finite() { format!("{count:.0}") } else { format!("over {most}") }
}

/// Returns the planners of a run as columns.
fn planners(run: &Run) -> Vec<(Column, &String)> {
    run.experiment.planners.iter().map(|planner| (Column::new(planner), planner)).collect()
}

/// Returns the tables of all baselines that have rows.
fn tables(run: &Run, table: impl Fn(&str) -> Table) -> Vec<Table> {
    let tables = run.experiment.baselines().into_iter().map(table);
    tables.filter(|table| !table.rows.is_empty()).collect()
}
