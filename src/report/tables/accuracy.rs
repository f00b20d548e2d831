//! Tables and sentences of an accuracy study.

use crate::experiment::statistics::PairedDifference;
use crate::report::columns::{EMPTY_CELL, aligned_rows, cell, duration, without_empty};
use crate::report::table::with_interval;
use crate::study::accuracy::comparison::{AccuracyComparison, CheapestScene};
use crate::study::accuracy::convergence::ConvergenceOrder;
use crate::study::accuracy::deviation::{ErrorStatistics, TouchShare};
use crate::study::accuracy::tolerance::{Criterion, Origin};
use crate::study::accuracy::variant::Variant;
use palpate_input::format::counted;

/// Note on the coverage of the printed intervals.
const INTERVAL_NOTE: &str = "\
intervals: 95 %, over touches, trials and timings of this build; code placement in another build can change
times by some percent";

/// Returns the table of the levels with their convergence.
pub fn levels(compared: &AccuracyComparison, orders: &[ConvergenceOrder]) -> String {
    let mut text = format!("levels; the reference is the finest:\n{}", table(compared));
    let words = ["does NOT decrease", "decreases"];
    if let Some(is_converging) = compared.is_converging() {
        let words = words[usize::from(is_converging)];
        text += &format!("\nthe force error {words} at every level towards the reference");
    }
    for order in orders {
        text += &format!(
            "\norder of convergence in the {}: {:.2} observed, {} expected",
            order.name, order.observed, order.expected
        );
    }
    text
}

/// Returns the table of the effects.
pub fn effects(compared: &AccuracyComparison) -> String {
    let within =
        compared.criterion.map_or(String::new(), |it| format!(", within {}", criterion_text(it)));
    format!(
        "effects{within}; keep every effect that is marked needed and that the real finger has:\n\
         {}{INTERVAL_NOTE}",
        table(compared)
    )
}

/// Describes a criterion.
pub fn criterion_text(criterion: Criterion) -> String {
    match criterion {
        Criterion::Touches(it) => format!("{it} of the {}", it.quantity.name()),
        Criterion::Verdict(m) => {
            format!("{:.3} mm of the difference active - random", 1e3 * m.unwrap_or(0.0))
        }
    }
}

/// Describes the cheapest level within a tolerance of touches, or the smallest error of any level;
/// `None` without levels, or for a verdict.
pub fn cheapest_level(
    levels: Option<&AccuracyComparison>,
    criterion: Criterion,
    origin: Origin,
) -> Option<String> {
    let (Some(levels), Criterion::Touches(tolerance)) = (levels, criterion) else { return None };
    let of = origin.name();
    if let Some((level, _)) = levels.cheapest(&tolerance, origin) {
        let time = duration(level.wall_s.unwrap_or(f64::NAN));
        let name = level.name;
        return Some(format!(
            "cheapest level within {tolerance} of {of}: {name}, {time} per touch"
        ));
    }
    let least = tolerance.format(levels.error_min(&tolerance, origin)?);
    Some(format!("no level within {tolerance} of {of}: the best level has 95 % within {least}"))
}

/// Describes the errors of the cheapest scene on the touches or trials that selected it and on
/// held-out ones.
pub fn cheapest(scene: &CheapestScene, criterion: Criterion, origin: Origin) -> String {
    let errors = |variant: &Variant| match criterion {
        Criterion::Touches(tolerance) => {
            let p95 = variant.p95(tolerance.quantity, origin);
            let p95 = p95.map_or("no comparable value".into(), |p95| tolerance.format(p95));
            format!("95 % of {} touches are within {p95}", variant.touches)
                + &variant.beyond.map_or(String::new(), |share| format!(", {}", beyond(&share)))
        }
        Criterion::Verdict(_) => {
            let [verdict, change] = [variant.verdict_m, variant.verdict_change_m];
            let trials = change.map_or(0, |change| change.trials);
            let [verdict, change] = [verdict, change].map(paired);
            let trials = counted(trials, "trial");
            format!("active - random is {verdict} mm in {trials}, a change of {change}")
        }
    };
    let CheapestScene { selected, held_out, is_confirmed, .. } = scene;
    let stays = if *is_confirmed { "confirmed" } else { "NOT confirmed" };
    let interval = held_out.time_ratio_interval.map(|[low, high]| [1.0 / high, 1.0 / low]);
    let speedup = held_out.time_ratio.map_or(f64::NAN, |ratio| 1.0 / ratio);
    format!(
        "on the selection set, {}\nheld out, {}: {stays} within the tolerance\n{} times as fast as the \
         reference\n{INTERVAL_NOTE}",
        errors(selected),
        errors(held_out),
        with_interval(speedup, interval, &|times| format!("{times:.2}")),
    )
}

/// Column header and the function that formats its cell.
type Column = (&'static str, fn(&Variant) -> String);

/// Columns of both tables; columns without a value are omitted.
const COLUMNS: [Column; 17] = [
    ("variant", |it| it.name.clone()),
    ("error to truth, mm: mean", |it| mean(it.off_truth_m, 1e-3, 3)),
    ("95 %", |it| cell(it.off_truth_m.map(|spread| 1e3 * spread.p95), 3)),
    ("max", |it| cell(it.off_truth_m.map(|spread| 1e3 * spread.max), 3)),
    ("error to reference, mm: mean", |it| mean(it.contact_m, 1e-3, 3)),
    ("95 %", |it| cell(it.contact_m.map(|spread| 1e3 * spread.p95), 3)),
    ("force N", |it| mean(it.force_n, 1.0, 4)),
    ("electrodes, counts", |it| mean(it.electrode_counts, 1.0, 2)),
    ("surface RMSE mm", |it| cell(it.surface_rmse_m.map(|m| 1e3 * m), 3)),
    ("time per touch", |it| it.wall_s.map_or(EMPTY_CELL.into(), duration)),
    ("real-time factor", |it| cell(it.real_time_factor(), 1)),
    ("time change", |it| {
        it.time_ratio.map_or(EMPTY_CELL.into(), |ratio| {
            with_interval(ratio, it.time_ratio_interval, &|it| {
                format!("{:+.1} %", 100.0 * (it - 1.0))
            })
        })
    }),
    (
        "finger bytes",
        |it| if it.touches > 0 { it.finger_bytes.to_string() } else { EMPTY_CELL.into() },
    ),
    ("RMSE active - random, mm", |it| paired(it.verdict_m)),
    ("change", |it| paired(it.verdict_change_m)),
    ("beyond the tolerance", |it| it.beyond.as_ref().map_or(EMPTY_CELL.into(), beyond)),
    ("relevance", |it| it.relevance.map_or(EMPTY_CELL, |relevance| relevance.words()).into()),
];

fn table(comparison: &AccuracyComparison) -> String {
    let mut lines = vec![COLUMNS.map(|(head, _)| head.to_string()).to_vec()];
    let variants = [&comparison.reference].into_iter().chain(&comparison.variants);
    lines.extend(variants.map(|it| COLUMNS.map(|(_, shown)| shown(it)).to_vec()));
    aligned_rows(&without_empty(lines))
}

fn mean(spread: Option<ErrorStatistics>, unit: f64, decimals: usize) -> String {
    cell(spread.map(|spread| spread.mean / unit), decimals)
}

fn paired(paired: Option<PairedDifference>) -> String {
    let Some(paired) = paired else { return EMPTY_CELL.into() };
    with_interval(paired.mean, paired.interval, &|m| format!("{:.3}", 1e3 * m))
}

fn beyond(share: &TouchShare) -> String {
    let [low, high] = share.interval.map(|share| 100.0 * share);
    format!("{} of {} beyond, [{low:.1}, {high:.1}] %", share.count, share.of)
}
