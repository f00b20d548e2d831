//! What a run found, in words and numbers taken from its rows.

use super::axes::MM;
use super::replay::digits;
use crate::experiment::store::Run;
use crate::experiment::summary;
use crate::experiment::summary::CurvePoint;
use crate::report::table::with_error;

/// The mean of Eq. 5 that counts as found, as where the paper says "almost 1".
const R_FOUND: f64 = 0.99;
/// The planner that the others are measured against, if it ran.
const BASELINE: &str = "random";

/// Sentences, the most important first.
pub fn sentences(run: &Run) -> Vec<String> {
    let planners = &run.experiment.planners;
    let curves: Vec<(&str, Vec<CurvePoint>)> = planners
        .iter()
        .map(|name| (name.as_str(), summary::curve(&run.experiment, &run.rows, name)))
        .filter(|(_, points)| !points.is_empty())
        .collect();
    let mut sentences = Vec::new();
    let total = run.experiment.trials as usize * planners.len();
    if run.rows.len() < total {
        sentences.push(format!("Only {} of {total} trials are finished.", run.rows.len()));
    }
    if curves.is_empty() {
        sentences
            .push("No trial got as far as its first fit, so there is nothing to say yet.".into());
        return sentences;
    }
    sentences.extend(scores(run, &curves));
    let constant = constant_score(run)
        .map_or(String::new(), |score| format!(" (a constant height scores {score:.3})"));
    let goal = format!("a mean R of {R_FOUND}{constant}");
    sentences.push(needed(run, &curves, &goal, |point| point.r_mean >= R_FOUND));
    sentences.extend(against_baseline(run, &curves));
    sentences.push(honesty(&curves));
    sentences
}

/// Eq. 5 of a constant with the heights' sign: |Σf| / sqrt(n · Σf²); none of no heights.
pub fn constant_score(run: &Run) -> Option<f64> {
    let heights = || run.truth.heights_m.iter().flatten();
    let (sum, squares) = heights().fold((0.0, 0.0), |(sum, squares), f| (sum + f, squares + f * f));
    let score = f64::abs(sum) / (heights().count() as f64 * squares).sqrt();
    score.is_finite().then_some(score)
}

/// Scores at the last drawn touch count that any planner reached.
fn scores(run: &Run, curves: &[(&str, Vec<CurvePoint>)]) -> Option<String> {
    let at =
        |points: &[CurvePoint], count: u32| points.iter().find(|p| p.touches == count).cloned();
    let counts = run.experiment.drawn_touch_counts();
    let count = counts
        .into_iter()
        .rev()
        .find(|&count| curves.iter().any(|(_, points)| at(points, count).is_some()))?;
    let told: Vec<String> = curves
        .iter()
        .filter_map(|(name, points)| {
            let point = at(points, count)?;
            let r = with_error(point.r_mean, point.r_se, 4);
            let rmse = digits(MM.per_m * point.rmse_median_m);
            let edge = point.edge_rmse_median_m.map_or(String::new(), |edge_m| {
                format!(", {} mm in the outer tenth of the zone", digits(MM.per_m * edge_m))
            });
            let centred = with_error(point.centred_r_mean, point.centred_r_se, 4);
            Some(format!("{name} {r} (centred {centred}, median RMSE {rmse} mm{edge})"))
        })
        .collect();
    Some(format!("After {count} touches the mean R (Eq. 5) is: {}.", told.join("; ")))
}

/// After how many touches each planner meets a goal, and keeps meeting it.
fn needed(
    run: &Run,
    curves: &[(&str, Vec<CurvePoint>)],
    goal: &str,
    is_met: impl Fn(&CurvePoint) -> bool,
) -> String {
    let told: Vec<String> = curves
        .iter()
        .map(|(name, points)| match points.iter().rev().take_while(|point| is_met(point)).last() {
            Some(point) => format!("{name} {}", point.touches),
            None => format!("{name} not within {}", run.experiment.touches),
        })
        .collect();
    format!("Touches needed for {goal}: {}.", told.join(", "))
}

/// How soon the others are as near the truth as the baseline is at its end.
fn against_baseline(run: &Run, curves: &[(&str, Vec<CurvePoint>)]) -> Option<String> {
    let (baseline, others): (Vec<_>, Vec<_>) =
        curves.iter().cloned().partition(|(name, _)| *name == BASELINE);
    let last = baseline.first()?.1.last()?;
    let goal = format!(
        "the median RMSE that {BASELINE} has after {} touches ({} mm)",
        last.touches,
        digits(MM.per_m * last.rmse_median_m)
    );
    let is_met = |point: &CurvePoint| point.rmse_median_m <= last.rmse_median_m;
    (!others.is_empty()).then(|| needed(run, &others, &goal, is_met))
}

/// Shares of the truth that a 95 % band may hold and still count as honest; chosen.
const HONEST: std::ops::RangeInclusive<f64> = 0.9..=0.98;

/// Whether the beliefs know how far they are off after the last touch.
fn honesty(curves: &[(&str, Vec<CurvePoint>)]) -> String {
    let shares = curves.iter().filter_map(|(name, points)| {
        let share = points.last()?.coverage_mean?;
        let verdict = match share {
            share if HONEST.contains(&share) => "",
            share if share < *HONEST.start() => " (too sure)",
            _ => " (too unsure)",
        };
        Some(format!("{name} {:.0} %{verdict}", 100.0 * share))
    });
    let shares: Vec<String> = shares.collect();
    format!("Of the truth the 95 % band of the last belief holds: {}.", shares.join(", "))
}
