//! What a run found, in words and numbers taken from its rows.

use super::number::{digits, with_error};
use crate::experiment::measure;
use crate::experiment::measure::metrics::constant_r;
use crate::experiment::measure::{
    CENTRED_R, CHAMFER, COVERAGE, EDGE_RMSE, Measure, R, REPEATABILITY, RMSE,
    VERIFICATION_COVERAGE, VERIFICATION_RMSE,
};
use crate::experiment::statistics::summary;
use crate::experiment::statistics::summary::CurvePoint;
use crate::experiment::store::Run;

/// The mean of Eq. 5 that counts as found, as where the paper says "almost 1".
const R_FOUND: f64 = 0.99;

/// What a reader should know before the numbers: a sentence each.
pub fn notices(run: &Run) -> Vec<String> {
    let total = run.experiment.trials as usize * run.experiment.planners.len();
    let is_partial = run.rows.len() < total;
    let partial = format!("Only {} of {total} trials are finished.", run.rows.len());
    is_partial.then_some(partial).into_iter().chain(run.notices()).collect()
}

/// Sentences, the most important first.
pub fn sentences(run: &Run) -> Vec<String> {
    let planners = &run.experiment.planners;
    let curves: Vec<(&str, Vec<CurvePoint>)> = planners
        .iter()
        .map(|name| (name.as_str(), summary::curve(&run.experiment, &run.rows, name)))
        .filter(|(_, points)| !points.is_empty())
        .collect();
    let mut sentences = Vec::new();
    if curves.is_empty() {
        sentences
            .push("No trial got as far as its first fit, so there is nothing to say yet.".into());
        return sentences;
    }
    sentences.extend(verified(run, &curves));
    if run.experiment.scene.around.is_some() {
        sentences.extend(shapes(run, &curves));
        sentences.extend(against_baseline(run, &curves));
        return sentences;
    }
    if !run.truth.is_known() {
        return sentences;
    }
    sentences.extend(scores(run, &curves));
    let constant = constant_r(run.truth.heights_m.iter().flatten())
        .map_or(String::new(), |score| format!(" (a constant height scores {score:.3})"));
    let goal = format!("a mean R of {R_FOUND}{constant}");
    let is_found = |point: &CurvePoint| point.of(&R).is_some_and(|r| r.mean >= R_FOUND);
    sentences.push(needed(run, &curves, &goal, is_found));
    sentences.extend(against_baseline(run, &curves));
    sentences.push(honesty(&curves));
    sentences
}

/// How the last beliefs stand verification and repeated touches, where there were any.
fn verified(run: &Run, curves: &[(&str, Vec<CurvePoint>)]) -> Option<String> {
    let told = curves.iter().filter_map(|(name, points)| {
        let point = points.last().filter(|point| point.touches == run.experiment.touches)?;
        let rmse = median(point, &VERIFICATION_RMSE).map(|rmse| {
            let share = point.of(&VERIFICATION_COVERAGE).map_or(String::new(), |share| {
                format!(", {:.0} % in the 95 % band", 100.0 * share.mean)
            });
            format!("median RMSE {rmse} mm{share}")
        });
        let again = median(point, &REPEATABILITY);
        let again = again.map(|again| format!("repeated touches differ by {again} mm"));
        let parts: Vec<String> = rmse.into_iter().chain(again).collect();
        (!parts.is_empty()).then(|| format!("{name} {}", parts.join("; ")))
    });
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| {
        format!(
            "At verification touches, which the last belief predicted and did not learn from: {}.",
            told.join(" · ")
        )
    })
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
            let mean = |measure: &Measure| {
                let summary = point.of(measure)?;
                Some(with_error(measure, summary.mean, summary.error))
            };
            let (r, centred) = (mean(&R)?, mean(&CENTRED_R)?);
            let rmse = median(&point, &RMSE)?;
            let edge = median(&point, &EDGE_RMSE).map_or(String::new(), |edge| {
                format!(", {edge} mm in the outer tenth of the zone")
            });
            Some(format!("{name} {r} (centred {centred}, median RMSE {rmse} mm{edge})"))
        })
        .collect();
    (!told.is_empty())
        .then(|| format!("After {count} touches the mean R (Eq. 5) is: {}.", told.join("; ")))
}

/// How near the believed shapes of whole objects are after the last touch that is drawn.
fn shapes(run: &Run, curves: &[(&str, Vec<CurvePoint>)]) -> Option<String> {
    let count = run.experiment.drawn_touch_counts().into_iter().next_back()?;
    let told: Vec<String> = curves
        .iter()
        .filter_map(|(name, points)| {
            let point = points.iter().find(|point| point.touches == count)?;
            let of = |id: &str| Some(point.of(measure::by_id(id)?)?.mean);
            let share = digits(100.0 * of("chamfer_share")?);
            let chamfer = median(point, &CHAMFER)?;
            let (f_1, f_3) = (100.0 * of("f_1")?, 100.0 * of("f_3")?);
            Some(format!(
                "{name} {share} % of the diagonal (median {chamfer} mm; F {f_1:.0} at 1 %, {f_3:.0} at 3 %)"
            ))
        })
        .collect();
    (!told.is_empty()).then(|| {
        format!("After {count} touches the mean Chamfer distance is: {}.", told.join("; "))
    })
}

/// The median of an error, in the unit it is shown in.
fn median(point: &CurvePoint, measure: &Measure) -> Option<String> {
    Some(digits(measure.unit.per_si * point.of(measure)?.median))
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
        .map(|(name, points)| match summary::met_from(points, &is_met) {
            Some(touches) => format!("{name} {touches}"),
            None => format!("{name} not within {}", run.experiment.touches),
        })
        .collect();
    format!("Touches needed for {goal}: {}.", told.join(", "))
}

/// How soon the others are as near the truth as the first baseline is at its end.
fn against_baseline(run: &Run, curves: &[(&str, Vec<CurvePoint>)]) -> Option<String> {
    let name = *run.experiment.baselines().first()?;
    let error = run.experiment.error();
    let compared = curves.iter().map(|(planner, points)| {
        let points = points.iter().filter(|point| point.of(error).is_some());
        (*planner, points.cloned().collect::<Vec<_>>())
    });
    let (baseline, others): (Vec<_>, Vec<_>) = compared.partition(|(planner, _)| *planner == name);
    let last = baseline.first()?.1.last()?;
    let error_m = last.of(error)?.median;
    let goal = format!(
        "the median {} that {name} has after {} touches ({} mm)",
        error.title,
        last.touches,
        median(last, error)?
    );
    let is_met = |point: &CurvePoint| point.of(error).is_some_and(|it| it.median <= error_m);
    (!others.is_empty()).then(|| needed(run, &others, &goal, is_met))
}

/// Shares of the truth that a 95 % band may hold and still count as honest; chosen.
pub(super) const HONEST: std::ops::RangeInclusive<f64> = 0.9..=0.98;

/// The share of the truth that the 95 % band of a curve's last belief holds.
pub(super) fn share_in_band(points: &[CurvePoint]) -> Option<f64> {
    Some(points.last()?.of(&COVERAGE)?.mean)
}

/// Whether the beliefs know how far they are off after the last touch.
fn honesty(curves: &[(&str, Vec<CurvePoint>)]) -> String {
    let shares = curves.iter().filter_map(|(name, points)| {
        let share = share_in_band(points)?;
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
