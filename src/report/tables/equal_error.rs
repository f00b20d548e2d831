//! Touches to equal error, as tables of the page and as a file.

use super::{Cell, Table, Verdict, write_csv};
use crate::experiment::measure::Direction;
use crate::experiment::statistics::equal_error::{EqualError, Estimate, errors};
use crate::experiment::store::Run;
use crate::report::number::{digits, with_interval};
use schemars::JsonSchema;
use serde::Serialize;
use std::path::Path;

/// A table for each baseline: a line for each other planner, a column for each error.
pub fn tables(run: &Run, found: &[EqualError]) -> Vec<Table> {
    let most = run.experiment.touches;
    let table = |baseline: &str| {
        let of_baseline: Vec<&EqualError> =
            found.iter().filter(|equal| equal.baseline == baseline).collect();
        let shown = |error: &str| of_baseline.iter().find(|equal| equal.measure.id == error);
        let errors: Vec<_> = errors().filter_map(|error| shown(error.id)).collect();
        let head = |equal: &&&EqualError| {
            let unit = equal.measure.unit;
            format!(
                "{}: {} {}, {baseline} {}",
                equal.measure.title,
                digits(unit.per_si * equal.goal),
                unit.symbol,
                touches(equal.baseline_touches, most)
            )
        };
        let lines = run.experiment.planners.iter().filter_map(|planner| {
            let of = |error: &str| {
                let is_it =
                    |equal: &&&EqualError| equal.planner == planner && equal.measure.id == error;
                of_baseline.iter().find(is_it).map(|equal| cell(equal, most))
            };
            let cells: Vec<_> = errors.iter().map(|error| of(error.measure.id)).collect();
            cells.iter().any(Option::is_some).then(|| {
                let cells = cells.into_iter().map(|cell| cell.unwrap_or("-".to_owned().into()));
                std::iter::once(planner.clone().into()).chain(cells).collect()
            })
        });
        let lines = lines.collect();
        let first = format!("to the error of {baseline}");
        Table { header: std::iter::once(first).chain(errors.iter().map(head)).collect(), lines }
    };
    let baselines = run.experiment.baselines().into_iter();
    baselines.map(table).filter(|table| !table.lines.is_empty()).collect()
}

/// What the cells are.
pub fn note(run: &Run) -> String {
    format!(
        "Touches, initial ones included, after which a planner\u{2019}s median error stays at or \
         below the one in the column\u{2019}s head, which is the baseline\u{2019}s after {} touches; \
         behind \u{d7} their ratio to the baseline\u{2019}s own count, and that of the lateral ways \
         after the initial touches. All with the 95 % interval of a bootstrap over trials. Bold, with \
         the word beside it: the interval of the touches\u{2019} ratio excludes 1.",
        run.experiment.goal_touches()
    )
}

/// A record of `equal_error.csv`; a count or ratio is left out where the error is not reached.
#[derive(Serialize, JsonSchema)]
pub struct EqualErrorRecord<'a> {
    /// Which planner.
    pub planner: &'a str,
    /// Whose error is the goal.
    pub baseline: &'a str,
    /// Which error.
    pub measure: &'a str,
    /// Trials that both finished.
    pub trials: usize,
    /// The baseline's median error after the goal's touches.
    pub goal: f64,
    /// Touches until the baseline itself has met it; empty: never.
    pub baseline_touches: Option<f64>,
    /// Touches until the planner has.
    pub touches: Option<f64>,
    /// Lower end of its 95 % bootstrap interval.
    pub touches_low: Option<f64>,
    /// Upper end.
    pub touches_high: Option<f64>,
    /// The planner's touches over the baseline's.
    pub ratio: Option<f64>,
    /// Lower end.
    pub ratio_low: Option<f64>,
    /// Upper end.
    pub ratio_high: Option<f64>,
    /// The planner's lateral way after the initial touches over the baseline's.
    pub path_ratio: Option<f64>,
    /// Lower end.
    pub path_ratio_low: Option<f64>,
    /// Upper end.
    pub path_ratio_high: Option<f64>,
}

/// Writes `equal_error.csv`: a line per planner, baseline and error.
///
/// # Errors
/// If it cannot be written.
pub fn write(found: &[EqualError], folder: &Path) -> anyhow::Result<()> {
    let finite = |value: f64| value.is_finite().then_some(value);
    let end = |estimate: &Estimate, end: usize| finite(estimate.interval?[end]);
    let records = found.iter().map(|equal| EqualErrorRecord {
        planner: equal.planner,
        baseline: equal.baseline,
        measure: equal.measure.id,
        trials: equal.trials,
        goal: equal.goal,
        baseline_touches: finite(equal.baseline_touches),
        touches: finite(equal.touches.value),
        touches_low: end(&equal.touches, 0),
        touches_high: end(&equal.touches, 1),
        ratio: finite(equal.ratio.value),
        ratio_low: end(&equal.ratio, 0),
        ratio_high: end(&equal.ratio, 1),
        path_ratio: finite(equal.path_ratio.value),
        path_ratio_low: end(&equal.path_ratio, 0),
        path_ratio_high: end(&equal.path_ratio, 1),
    });
    write_csv(&folder.join("equal_error.csv"), records)
}

fn cell(equal: &EqualError, most: u32) -> Cell {
    let shown = |estimate: &Estimate, shown: &dyn Fn(f64) -> String| {
        with_interval(estimate.value, estimate.interval, shown)
    };
    // Without a count there is no ratio, and of its interval at most the lower end.
    if !equal.touches.value.is_finite() {
        let low = equal.touches.interval.map_or(f64::INFINITY, |[low, _]| low);
        let some = if low.is_finite() { format!(", {low:.0} at least") } else { String::new() };
        return format!("{}{some}", touches(f64::INFINITY, most)).into();
    }
    let ratio = |ratio: f64| if ratio.is_finite() { format!("{ratio:.2}") } else { "–".into() };
    let words = format!(
        "{} \u{d7} {}; way \u{d7} {}",
        shown(&equal.touches, &|count| touches(count, most)),
        shown(&equal.ratio, &ratio),
        shown(&equal.path_ratio, &ratio),
    );
    Cell { words, verdict: verdict(equal) }
}

/// Whether the planner needs fewer or more touches for certain.
pub fn verdict(equal: &EqualError) -> Option<Verdict> {
    Verdict::of(equal.ratio.interval, 1.0, Direction::Less)
}

fn touches(count: f64, most: u32) -> String {
    if count.is_finite() { format!("{count:.0}") } else { format!("over {most}") }
}
