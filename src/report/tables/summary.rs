//! Curves of a run as tables for the page, the terminal and files; and the claims of a publication
//! next to the results.

use crate::experiment::Experiment;
use crate::experiment::measure::{
    self, MEASURES, Measure, RECOGNISED, STOP_TOUCHES, VERIFICATION_RMSE,
};
use crate::experiment::row::{ViewRow, planner_rows};
use crate::experiment::statistics::curve_table::{columns, curve_table};
use crate::experiment::statistics::equal_error::IntervalEstimate;
use crate::experiment::statistics::summary::{self, CurvePoint, EventCounts, representative_value};
use crate::experiment::statistics::{mean, mean_interval, median};
use crate::experiment::stop::StopSettings;
use crate::experiment::store::Run;
use crate::report::table::{Cell, Column, Table, shown, title_with_unit};
use palpate_explore::view::ViewDoubt;
use palpate_gp::math::normal::BAND_95;
use palpate_input::format::counted;
use serde_json::{Value, json};

/// Returns a table with a row for each planner and tabled touch count; columns without a value are
/// left out.
pub fn table(run: &Run) -> Table {
    table_after(run, &run.experiment.table_touch_counts())
}

/// Returns the rows of [`table`] after `counts` touches.
pub fn table_after(run: &Run, counts: &[u32]) -> Table {
    let mut aggregates: Vec<(&Measure, bool)> = (MEASURES.iter())
        .filter(|measure| measure.in_tables)
        .flat_map(|measure| [(measure, false), (measure, true)])
        .filter(|(measure, is_median)| match is_median {
            true => measure.aggregate.has_median(),
            false => measure.aggregate.has_mean(),
        })
        .collect();
    // The error that ranks the planners is the first.
    aggregates.sort_by_key(|(measure, _)| measure.id != run.error_measure().id);
    let column = |(measure, is_median): &(&Measure, bool)| {
        let kind = if *is_median { "median" } else { "mean" };
        Column::new(format!("{kind} {}", measure.stem().replace('_', " ")))
            .title(format!("{kind} {}", measure.title))
            .unit(measure.unit.symbol, measure.unit.per_si, measure.unit.decimals)
    };
    let start = ["touches", "planner"].map(Column::new).into_iter();
    let mut table = Table::new(start.chain(aggregates.iter().map(column)));
    let curves: Vec<Vec<CurvePoint>> = (run.experiment.planners.iter())
        .map(|planner| summary::curve(&run.experiment, &run.rows, planner))
        .collect();
    for count in counts {
        for point in curves.iter().flatten().filter(|point| point.touches == *count) {
            let start = [Cell::from(*count as usize), point.planner.as_str().into()];
            let value = |(measure, is_median): &(&Measure, bool)| match point.of(measure) {
                None => Cell::default(),
                Some(summary) if *is_median => summary.median.into(),
                Some(summary) => Cell::mean(summary.mean, summary.error),
            };
            table.rows.push(start.into_iter().chain(aggregates.iter().map(value)).collect());
        }
    }
    table.without_empty()
}

/// Returns the number of trials, and of the planners that finished fewer.
pub fn finished(run: &Run) -> String {
    let trials = counted(run.experiment.trials, "trial");
    let fewer = |name: &String| {
        let rows = || planner_rows(&run.rows, name);
        let complete = rows().filter(|row| row.failure.is_none()).count();
        (complete < rows().count()).then(|| format!("; {name} finished {complete}"))
    };
    let fewer: String = run.experiment.planners.iter().filter_map(fewer).collect();
    format!("{trials}{fewer}")
}

/// Returns the note that explains the cells of [`table`].
pub fn note(run: &Run) -> String {
    format!("n = {}; ± is one standard error of the mean.", finished(run))
}

/// Returns the numbers that decide between planners after each tabled touch count: the error with
/// its 95 % interval, its ratio to the smallest, and touches without contact; with hypotheses, the
/// share of trials with the right object.
pub fn brief(run: &Run) -> Table {
    let experiment = &run.experiment;
    // Without a ground truth, held-out touches show the error.
    let has = |measure: &Measure| {
        run.rows.iter().any(|row| measure.value(row, row.touches.len() as u32).is_some())
    };
    let error = match has(run.error_measure()) {
        true => run.error_measure(),
        false => &VERIFICATION_RMSE,
    };
    let heads = [
        Column::new("touches"),
        Column::new("planner"),
        Column::new(format!("mean {} {} [95 %]", error.title, error.unit.symbol)),
        Column::new("to the best").unit("", 1.0, 2),
        Column::new(RECOGNISED.title).unit("", 1.0, 2),
        Column::new("misses a trial").unit("", 1.0, 1),
    ];
    let mut table = Table::new(heads);
    for count in experiment.table_touch_counts() {
        let of = |planner: &str, measure: &Measure| -> Option<IntervalEstimate> {
            let rows = planner_rows(&run.rows, planner);
            let shown = |value| measure.unit.per_si * value;
            let values: Vec<f64> =
                rows.filter_map(|row| measure.value(row, count).map(shown)).collect();
            let interval = mean_interval(&values, experiment.seed);
            (!values.is_empty()).then(|| IntervalEstimate { value: mean(&values), interval })
        };
        let errors: Vec<_> = experiment.planners.iter().map(|name| of(name, error)).collect();
        let best = errors.iter().flatten().map(|error| error.value).reduce(f64::min);
        for (planner, error) in experiment.planners.iter().zip(&errors) {
            let rows: Vec<_> = planner_rows(&run.rows, planner)
                .filter(|row| row.touches.len() >= count as usize)
                .collect();
            if rows.is_empty() {
                continue;
            }
            let touches = rows.iter().flat_map(|row| &row.touches[..count as usize]);
            let misses = touches.filter(|touch| touch.is_miss()).count();
            let misses = (misses > 0).then_some(misses as f64 / rows.len() as f64);
            let ratio = error.as_ref().zip(best).map(|(error, best)| error.value / best);
            let recognised = of(planner, &RECOGNISED).map(|share| share.value);
            table.rows.push(vec![
                (count as usize).into(),
                planner.as_str().into(),
                Cell::estimate(*error),
                ratio.into(),
                recognised.into(),
                misses.into(),
            ]);
        }
    }
    table.without_empty()
}

/// Returns a table for the terminal, of the numbers that decide or, if `is_wide`, of all, followed
/// by the events of the trials and the notices.
pub fn text(run: &Run, is_wide: bool) -> String {
    let table = if is_wide { table(run) } else { brief(run) };
    let mut text = format!("{}\n{}", run.experiment.name, table.text());
    event_lines(run).iter().for_each(|line| text += &format!("{line}\n"));
    run.notices().iter().for_each(|notice| text += &format!("note: {notice}\n"));
    text.trim_end().into()
}

/// Returns the table of `summary.csv`, with a row for each planner and each of its touch counts for
/// which `is_wanted` is true.
pub fn file(run: &Run, is_wanted: impl Fn(u32) -> bool) -> Table {
    let names = ["planner", "touches", "trials"].map(String::from).into_iter();
    let names = names.chain(columns(&run.experiment, &run.rows));
    let records = curve_table(&run.experiment, &run.rows, is_wanted);
    let row = |(point, values): (CurvePoint, Vec<Option<f64>>)| -> Vec<Cell> {
        let start = [point.planner.into(), (point.touches as usize).into(), point.trials.into()];
        start.into_iter().chain(values.into_iter().map(Cell::from)).collect()
    };
    Table {
        columns: names.map(Column::new).collect(),
        rows: records.into_iter().map(row).collect(),
    }
}

/// Returns the summary for programs: the columns of `summary.csv` for each planner and tabled touch
/// count, and the notices.
pub fn json(run: &Run) -> Value {
    let counts = run.experiment.table_touch_counts();
    let mut rows = file(run, |count| counts.contains(&count)).json();
    let of_point = |row: &mut serde_json::Map<String, Value>| {
        let [planner, touches, trials] =
            ["planner", "touches", "trials"].map(|key| row.remove(key));
        json!({ "planner": planner, "touches": touches, "trials": trials, "measures": row })
    };
    let notices = run.notices();
    json!({
        "name": run.experiment.name,
        "trials": run.rows.len(),
        "failed": run.rows.iter().filter(|row| row.failure.is_some()).count(),
        "summary": rows.iter_mut().map(of_point).collect::<Vec<_>>(),
        "notes": notices.into_iter().chain(event_lines(run)).collect::<Vec<_>>(),
    })
}

/// Returns the claims of a publication with the results: a row for each measure of each claim.
pub fn claims(run: &Run) -> Table {
    let planners = &run.experiment.planners;
    let heads = ["paper", "reported", "touches", "measure"].map(Column::new).into_iter();
    let mut table = Table::new(heads.chain(planners.iter().map(Column::new)));
    let possible = run.experiment.first_fit()..=run.experiment.touches;
    let claims = run.experiment.report.claims.iter();
    for claim in claims.filter(|claim| possible.contains(&claim.touches)) {
        let asked = claim.measures.iter().filter_map(|id| measure::by_id(id));
        for (i, measure) in asked.enumerate() {
            let once = |words: &str| Cell::from(if i == 0 { words } else { "" });
            let kind = if measure.aggregate.has_median() { "median" } else { "mean" };
            let start = [
                once(&claim.source),
                once(&claim.text),
                counted(claim.touches, "touch").into(),
                format!("{kind} {}", title_with_unit(measure)).into(),
            ];
            let value = |planner: &String| {
                let value = representative_value(&run.rows, planner, claim.touches, measure);
                Cell::from(value.map(|value| shown(measure, value)))
            };
            table.rows.push(start.into_iter().chain(planners.iter().map(value)).collect());
        }
    }
    table
}

/// Note that explains the cells of [`claims`].
pub const CLAIMS_NOTE: &str =
    "Values reported by Yi et al. 2016, next to those of this run over the trials.";

/// Returns the events in the trials besides their errors, a line for each planner.
pub fn event_lines(run: &Run) -> Vec<String> {
    let of = |planner: &String| event_line(planner, &summary::events(&run.rows, planner));
    let unlisted = (run.unlisted > 0).then(|| {
        let verb = if run.unlisted == 1 { "is" } else { "are" };
        let trials = counted(run.unlisted, "stored trial");
        format!("{trials} {verb} not shown: the experiment does not list them")
    });
    let planners = || run.experiment.planners.iter();
    let cameras = planners().filter_map(|planner| camera_line(run, planner));
    let stops = planners().filter_map(|planner| stop_line(run, planner));
    planners().filter_map(of).chain(cameras).chain(stops).chain(unlisted).collect()
}

/// Returns how many trials of a planner stopped by their rule, and when; `None` without a rule.
fn stop_line(run: &Run, planner: &str) -> Option<String> {
    let Run { experiment: Experiment { stop, touches, .. }, rows, .. } = run;
    let is_asked = *stop != StopSettings::default();
    let ends = || planner_rows(rows, planner).map(|row| STOP_TOUCHES.value(row, *touches));
    let stopped: Vec<f64> = ends().flatten().collect();
    let after = median(&stopped).map_or(String::new(), |touches| {
        format!(", after {} (median)", counted(touches.round() as usize, "touch"))
    });
    let trials = counted(ends().count(), "trial");
    is_asked.then(|| format!("{planner}: {} of {trials} stopped by [stop]{after}", stopped.len()))
}

/// Error of a camera's pose, in prior standard deviations, beyond which something else is wrong.
// heuristic: one false alarm in thousands of trials.
const FAR_OFF: f64 = 4.5;

/// Returns the error of the camera's pose in a planner's first trial, and the number of trials in
/// which it is beyond what was expected; `None` without a view.
fn camera_line(run: &Run, planner: &str) -> Option<String> {
    let views = || planner_rows(&run.rows, planner).flat_map(|row| &row.views);
    let all = || views().filter_map(|view| view.error.as_ref());
    let first = all().next()?;
    let far_off = all().filter(|error| error.prior_sds > FAR_OFF);
    let far_off = match far_off.count() {
        0 => String::new(),
        count => format!(
            "; in {}, by more than {FAR_OFF} standard deviations of [camera.pose_error]: check its \
             pose, unit, frame and side",
            counted(count, "view")
        ),
    };
    let doubts: Vec<ViewDoubt> = all().filter_map(|error| error.doubt).collect();
    let doubted = doubts.first().map_or(String::new(), |doubt| {
        format!(
            "; {} left out, because touches contradict what is seen (in the first, {doubt}): check \
             object, pose, unit, frame and side",
            counted(doubts.len(), "view")
        )
    });
    let z: Vec<f64> = views().filter_map(ViewRow::pose_deviations).flatten().collect();
    let within = z.iter().filter(|z| z.abs() <= BAND_95).count();
    let within = match z.len() {
        0 => String::new(),
        count => format!(
            "; true errors of simulated poses are within 1.96 stated deviations in {:.0} % of {count} \
             components",
            100.0 * within as f64 / count as f64
        ),
    };
    Some(format!(
        "{planner}: in the first trial the camera is off by {first}{far_off}{doubted}{within}"
    ))
}

/// Returns the events in a planner's trials, in a line; `None` without events.
fn event_line(planner: &str, events: &EventCounts) -> Option<String> {
    let counts = [
        (events.failures, "failed trial", ""),
        (events.misses, "touch", " without contact"),
        (
            events.overloads,
            "touch",
            " aborted: limit of force, pressure or depth, or no contact location",
        ),
        (events.no_variance, "random target", " instead of planned ones: no variance is left"),
        (
            events.duplicate_target,
            "random target",
            " instead of planned ones, which had been touched before",
        ),
    ];
    let found: Vec<String> = counts
        .iter()
        .filter(|(count, ..)| *count > 0)
        .map(|(count, what, rest)| match count {
            1 => {
                let one = rest.replace("planned ones, which", "a planned one, which");
                counted(count, what) + &one.replace("planned ones", "a planned one")
            }
            _ => counted(count, what) + rest,
        })
        .collect();
    let doubts = (events.doubts.iter())
        .map(|(doubt, count)| format!("{}: {doubt}", counted(*count, "touch")));
    let found: Vec<String> = found.into_iter().chain(doubts).collect();
    (!found.is_empty()).then(|| format!("{planner}: {}", found.join("; ")))
}
