//! Findings of a run as sentences, and its verdict.

use super::table::{digits, shown, verdict};
use crate::experiment::analysis::Analysis;
use crate::experiment::measure::{
    self, CENTRED_R, CHAMFER, COVERAGE, Direction, EDGE_RMSE, Measure, R, REACHABLE_RMSE,
    RECOGNISED, REPEATABILITY, RMSE, VERIFICATION_COVERAGE, VERIFICATION_RMSE,
};
use crate::experiment::metrics::constant_r;
use crate::experiment::row::{TouchRow, planner_rows};
use crate::experiment::statistics::comparison::PairedComparison;
use crate::experiment::statistics::summary::{self, CurvePoint};
use crate::experiment::statistics::{self, curve_table};
use crate::experiment::store::Run;
use palpate_input::format::counted;

/// Mean R (Eq. 5) from which a surface counts as found, for the paper's "almost 1".
const R_FOUND: f64 = 0.99;

/// Value of a planner with its interval, in the unit of the measure.
pub type FinalValue<'a> = (&'a str, f64, Option<[f64; 2]>);

/// Returns the measure that decides between the planners, and its value and uncertainty for each of
/// them after the last touch: with hypotheses about the object the share of right ones, without a
/// ground truth the error at verification touches. `None` without a value.
pub fn final_values<'r>(run: &'r Run) -> Option<(&'static Measure, Vec<FinalValue<'r>>)> {
    let points: Vec<(&'r str, CurvePoint)> = (run.completed_planners().into_iter())
        .filter_map(|name| {
            let points = summary::curve(&run.experiment, &run.rows, name);
            Some((name, at(&points, run.experiment.touches)?.clone()))
        })
        .collect();
    let values = |measure: &Measure| -> Vec<FinalValue<'r>> {
        let value = |(name, point): &(&'r str, CurvePoint)| {
            let value = point.representative(measure)?;
            let ends = curve_table::uncertainty(&run.experiment, &run.rows, point, measure);
            let shown = |value: f64| measure.unit.per_si * value;
            Some((*name, shown(value), ends.map(|ends| ends.map(shown))))
        };
        points.iter().filter_map(value).collect()
    };
    [&RECOGNISED, run.error_measure(), &VERIFICATION_RMSE]
        .into_iter()
        .map(|measure| (measure, values(measure)))
        .find(|(_, values)| !values.is_empty())
}

/// Returns warnings for the top of the page, a sentence each.
pub fn notices(run: &Run) -> Vec<String> {
    let total = run.experiment.trials as usize * run.experiment.planners.len();
    let is_partial = run.rows.len() < total;
    let partial = format!("Only {} of {total} trials are finished.", run.rows.len());
    is_partial.then_some(partial).into_iter().chain(run.notices()).collect()
}

/// Returns the findings as sentences, the most important first.
pub fn sentences(run: &Run) -> Vec<String> {
    let curves: Vec<Curve> = (run.completed_planners().into_iter())
        .map(|name| (name, summary::curve(&run.experiment, &run.rows, name)))
        .filter(|(_, points)| !points.is_empty())
        .collect();
    if curves.is_empty() {
        return vec!["No trial has reached its first fit, so there are no results yet.".into()];
    }
    let verified = verified(run, &curves);
    let found = if run.experiment.scene.whole_object.is_some() {
        vec![shapes(run, &curves), against_baseline(run, &curves)]
    } else if run.truth.is_known() {
        let (needed, against) = (r_needed(run, &curves), against_baseline(run, &curves));
        vec![scores(run, &curves), needed, against, band_coverage(&curves)]
    } else {
        Vec::new()
    };
    verified.into_iter().chain(found.into_iter().flatten()).collect()
}

/// Returns the touch count from which each planner has found the surface, by its mean R (Eq. 5).
fn r_needed(run: &Run, curves: &[Curve]) -> Option<String> {
    let constant = constant_r(run.truth.heights_m.iter().flatten())
        .map_or(String::new(), |score| format!(" (a constant height scores {score:.3})"));
    let goal = format!("a mean R of {R_FOUND}{constant}");
    let is_found = |point: &CurvePoint| point.of(&R).is_some_and(|r| r.mean >= R_FOUND);
    needed(run, curves, &goal, is_found)
}

/// Name of a planner with its curve.
type Curve<'a> = (&'a str, Vec<CurvePoint>);

/// Returns a clause for each planner that has one, after its name; `None` if no planner has.
fn each(curves: &[Curve], words: impl Fn(&[CurvePoint]) -> Option<String>) -> Option<Vec<String>> {
    let found =
        curves.iter().filter_map(|(name, points)| Some(format!("{name} {}", words(points)?)));
    let found: Vec<String> = found.collect();
    (!found.is_empty()).then_some(found)
}

/// Returns the agreement of the last beliefs with verification and repeated touches, if there were
/// any.
fn verified(run: &Run, curves: &[Curve]) -> Option<String> {
    let words = |points: &[CurvePoint]| {
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
        (!parts.is_empty()).then(|| parts.join("; "))
    };
    let found = each(curves, words)?.join(" · ");
    Some(format!("At held-out verification touches the last belief has: {found}."))
}

/// Returns the scores at the last drawn touch count that any planner reached.
fn scores(run: &Run, curves: &[Curve]) -> Option<String> {
    let counts = run.experiment.drawn_touch_counts();
    let is_reached = |count: &u32| curves.iter().any(|(_, points)| at(points, *count).is_some());
    let count = counts.into_iter().rev().find(is_reached)?;
    let words = |points: &[CurvePoint]| {
        let point = at(points, count)?;
        let mean = |measure: &Measure| {
            let summary = point.of(measure)?;
            let error = summary.error.map(|error| format!(" ± {}", shown(measure, error)));
            Some(shown(measure, summary.mean) + &error.unwrap_or_default())
        };
        let (r, centred, rmse) = (mean(&R)?, mean(&CENTRED_R)?, median(point, &RMSE)?);
        let edge = median(point, &EDGE_RMSE)
            .map_or(String::new(), |edge| format!("{edge} mm in the outer tenth of the zone, "));
        Some(format!("{rmse} mm ({edge}mean R (Eq. 5) {r}, centred {centred})"))
    };
    let found = each(curves, words)?.join("; ");
    Some(format!("After {} the median RMSE is: {found}.", counted(count, "touch")))
}

/// Returns the accuracy of the estimated surfaces of whole objects after the last drawn touch.
fn shapes(run: &Run, curves: &[Curve]) -> Option<String> {
    let count = run.experiment.drawn_touch_counts().into_iter().next_back()?;
    let words = |points: &[CurvePoint]| {
        let point = at(points, count)?;
        let of = |id: &str| Some(point.of(measure::by_id(id)?)?.mean);
        let (share, chamfer) = (digits(100.0 * of("chamfer_share")?), median(point, &CHAMFER)?);
        let (f_1, f_3) = (100.0 * of("f_1")?, 100.0 * of("f_3")?);
        Some(format!(
            "{share} % of the diagonal (median {chamfer} mm; F {f_1:.0} at 1 %, {f_3:.0} at 3 %)"
        ))
    };
    let found = each(curves, words)?.join("; ");
    Some(format!("After {} the mean Chamfer distance is: {found}.", counted(count, "touch")))
}

/// Returns the point of a curve after `count` touches.
fn at(points: &[CurvePoint], count: u32) -> Option<&CurvePoint> {
    points.iter().find(|point| point.touches == count)
}

/// Returns the median of an error, in its display unit.
fn median(point: &CurvePoint, measure: &Measure) -> Option<String> {
    Some(digits(measure.unit.per_si * point.of(measure)?.median))
}

/// Returns the touch count from which each planner stays within a goal.
fn needed(
    run: &Run,
    curves: &[Curve],
    goal: &str,
    is_met: impl Fn(&CurvePoint) -> bool,
) -> Option<String> {
    let words = |points: &[CurvePoint]| match summary::goal_touches(points, &is_met) {
        Some(touches) => Some(touches.to_string()),
        None => Some(format!("not within {}", run.experiment.touches)),
    };
    Some(format!("Touches needed for {goal}: {}.", each(curves, words)?.join(", ")))
}

/// Returns the touches that the other planners need for the first baseline's final error.
fn against_baseline(run: &Run, curves: &[Curve]) -> Option<String> {
    let name = baseline(run)?;
    let error = run.error_measure();
    let compared = curves.iter().map(|(planner, points)| {
        let points = points.iter().filter(|point| point.of(error).is_some());
        (*planner, points.cloned().collect::<Vec<_>>())
    });
    let (baseline, others): (Vec<_>, Vec<_>) = compared.partition(|(planner, _)| *planner == name);
    let last = baseline.first()?.1.last()?;
    let error_m = last.of(error)?.median;
    let goal = format!(
        "the median {} that {name} has after {} ({} mm)",
        error_words(run),
        counted(last.touches, "touch"),
        median(last, error)?
    );
    let is_met = |point: &CurvePoint| point.of(error).is_some_and(|it| it.median <= error_m);
    needed(run, &others, &goal, is_met)
}

/// Fractions of the truth inside a 95 % band that count as calibrated, a heuristic: close to 95 %.
pub(super) const CALIBRATED: std::ops::RangeInclusive<f64> = 0.9..=0.98;

/// Returns the fraction of the truth inside the 95 % band of a curve's last belief.
pub(super) fn share_in_band(points: &[CurvePoint]) -> Option<f64> {
    Some(points.last()?.of(&COVERAGE)?.mean)
}

/// Returns the fractions of the truth inside the bands of the last beliefs.
fn band_coverage(curves: &[Curve]) -> Option<String> {
    let words = |points: &[CurvePoint]| Some(format!("{:.0} %", 100.0 * share_in_band(points)?));
    let shares = each(curves, words)?.join(", ");
    Some(format!("Fraction of the truth inside the 95 % band of the last belief: {shares}."))
}

/// Returns the planners that failed, with the rule by which their trials count; `None` without a
/// failure.
pub fn failures(run: &Run) -> Option<String> {
    let planner = |name: &String| {
        let rows = || planner_rows(&run.rows, name);
        let failed = rows().filter(|row| row.failure.is_some()).count();
        match (failed, rows().count()) {
            (0, _) => None,
            (failed, all) if failed == all => {
                Some(format!("{name} failed in each of {}", counted(all, "trial")))
            }
            (failed, all) => Some(format!("{name} failed in {failed} of {all} trials")),
        }
    };
    let found: Vec<String> = run.experiment.planners.iter().filter_map(planner).collect();
    let rule = "a failed trial counts with its last belief to the end, a planner without a complete \
                trial is left out";
    (!found.is_empty()).then(|| format!("{} ({rule}).", found.join("; ")))
}

/// Returns the first baseline with a complete trial.
fn baseline(run: &Run) -> Option<&str> {
    let completed = run.completed_planners();
    run.experiment.baselines().into_iter().find(|name| completed.contains(name))
}

/// Returns the error that ranks the planners in words.
fn error_words(run: &Run) -> &'static str {
    match run.error_measure() {
        error if error.id == REACHABLE_RMSE.id => "RMSE within reach",
        error => error.title,
    }
}

/// Returns which part of the surface the errors are of, if not the whole.
fn judged_part(run: &Run) -> Option<String> {
    let is_part = run.error_measure().id == REACHABLE_RMSE.id;
    let share = run.truth.unreachable_share().filter(|_| is_part)?;
    Some(format!(
        "Within reach are the places where the finger can touch the surface; {:.0} % of it is left out.",
        100.0 * share
    ))
}

/// Returns the verdict on a run as sentences, only with what its intervals establish; empty without
/// a belief. It begins with failures.
pub fn verdicts(run: &Run, analysis: &Analysis) -> Vec<String> {
    let baseline = baseline(run).unwrap_or_default();
    let trials = final_errors(run, analysis, baseline).map(|it| it.paired.trials).max();
    let compared = match trials.and_then(too_few) {
        Some(too_few) => [Some(too_few), None],
        None => [error_verdict(run, analysis, baseline), touches_verdict(run, analysis, baseline)],
    };
    let compared: Vec<String> = compared.into_iter().flatten().chain(calibration(run)).collect();
    let part = judged_part(run).filter(|_| !compared.is_empty());
    let first = failures(run).into_iter().chain(recognition(run));
    first.chain(compared).chain(part).collect()
}

/// Ratio of the trials that detect a difference with a probability of 80 % to those whose 95 %
/// interval has the difference as its half-width: ((1.96 + 0.84) / 1.96)².
const POWER: f64 = 2.04;

/// Smallest number of paired trials for a conclusion.
// heuristic: with fewer, not even equal signs of all differences are significant at 95 %, and
// bootstrap intervals are too short.
const TRIALS_MIN: usize = 6;

/// Largest number of trials that is proposed.
// heuristic: beyond it a difference is negligible.
const PROPOSED_MAX: f64 = 10_000.0;

/// Returns one sentence about the planner with the smallest error: its mean difference from the
/// first baseline in the same trials or, unless that is established, the number of trials that
/// would show it. `None` if the planners cannot be compared.
pub fn conclusion(run: &Run, analysis: &Analysis) -> Option<String> {
    let closest = smallest_error(run, analysis)?;
    let PairedComparison { planner, baseline, paired, .. } = closest;
    if let Some(too_few) = too_few(paired.trials) {
        return Some(too_few);
    }
    let error = run.error_measure();
    let [low, high] = paired.interval?;
    let shown = |value: f64| digits(error.unit.per_si * value);
    let size = |[low, high]: [f64; 2]| {
        let unit = error.unit.symbol;
        format!("{} {unit} [{}, {}]", shown(paired.mean.abs()), shown(low), shown(high))
    };
    let after = format!(
        "{} than {baseline} after {} (mean of {}, 95 % interval)",
        error_words(run),
        counted(run.experiment.touches, "touch"),
        counted(paired.trials, "trial")
    );
    Some(match better_of(closest) {
        Some(better) if better == *planner => {
            format!("{planner} is better: {} less {after}.", size([-high, -low]))
        }
        Some(_) => format!("{baseline} is best: {planner} has {} more {after}.", size([low, high])),
        None => {
            let (words, ends) = match paired.mean < 0.0 {
                true => ("less", [-high, -low]),
                false => ("more", [low, high]),
            };
            let ratio = 0.5 * (high - low) / paired.mean.abs();
            let needed = (POWER * paired.trials as f64 * ratio * ratio).ceil();
            let needed = match needed <= PROPOSED_MAX {
                true => {
                    format!("about {needed} trials (--set trials={needed}) would probably show it")
                }
                false => format!("more than {PROPOSED_MAX} trials would be needed to show one"),
            };
            let size = size(ends);
            format!("No difference is established: {planner} has {size} {words} {after}; {needed}.")
        }
    })
}

/// Returns the better of the planner with the smallest error and the first baseline; `None` if no
/// difference is established.
pub fn best<'a>(run: &'a Run, analysis: &'a Analysis<'a>) -> Option<&'a str> {
    better_of(smallest_error(run, analysis)?)
}

/// Returns the comparison with the first baseline of the planner that has the smallest error.
fn smallest_error<'a>(
    run: &'a Run,
    analysis: &'a Analysis<'a>,
) -> Option<&'a PairedComparison<'a>> {
    let found = final_errors(run, analysis, baseline(run)?);
    found.min_by(|a, b| a.paired.mean.total_cmp(&b.paired.mean))
}

/// Returns the better planner of a comparison; `None` if there are too few trials, or the interval
/// contains 0.
fn better_of<'a>(comparison: &PairedComparison<'a>) -> Option<&'a str> {
    match established(comparison)? {
        "better" => Some(comparison.planner),
        _ => Some(comparison.baseline),
    }
}

/// Returns whether the planner of a comparison is better or worse; `None` if there are too few
/// trials, or the interval contains 0.
pub fn established(comparison: &PairedComparison) -> Option<&'static str> {
    let PairedComparison { measure, paired, .. } = comparison;
    let is_enough = too_few(paired.trials).is_none();
    verdict(paired.interval, 0.0, measure.direction).filter(|_| is_enough)
}

/// Returns a sentence instead of a comparison if there are too few paired trials.
pub fn too_few(trials: usize) -> Option<String> {
    (trials < TRIALS_MIN).then(|| {
        let verb = if trials == 1 { "is" } else { "are" };
        format!(
            "{} {verb} too few to compare planners; use --set trials={TRIALS_MIN} or more.",
            counted(trials, "paired trial")
        )
    })
}

/// Returns the comparisons of the planners' errors after the last touch with those of `baseline`.
fn final_errors<'a>(
    run: &Run,
    analysis: &'a Analysis<'a>,
    baseline: &'a str,
) -> impl Iterator<Item = &'a PairedComparison<'a>> + Clone + use<'a> {
    let (id, completed) = (run.error_measure().id, run.completed_planners());
    let completed: Vec<String> = completed.into_iter().map(String::from).collect();
    let found = analysis.comparisons.iter();
    found.filter(move |it| {
        it.baseline == baseline
            && it.measure.id == id
            && completed.iter().any(|name| name == it.planner)
    })
}

/// Returns which planners have a smaller error after the last touch than the first baseline.
fn error_verdict(run: &Run, analysis: &Analysis, baseline: &str) -> Option<String> {
    let found = final_errors(run, analysis, baseline);
    let trials = found.clone().map(|it| it.paired.trials).max()?;
    let groups = found.map(|it| {
        (it.planner, verdict_group(verdict(it.paired.interval, 0.0, it.measure.direction)))
    });
    let error = error_words(run);
    let words = [
        format!("a smaller {error} than {baseline}"),
        format!("a larger {error} than {baseline}"),
        format!("no established difference in {error} from {baseline}"),
    ];
    let clauses = clauses(groups, ["has", "have"], words)?;
    let touches = counted(run.experiment.touches, "touch");
    Some(format!("After {touches}, {clauses} ({trials} trials, 95 % intervals)."))
}

/// Returns which planners need fewer touches than the first baseline for its final error.
fn touches_verdict(run: &Run, analysis: &Analysis, baseline: &str) -> Option<String> {
    let (id, completed) = (run.error_measure().id, run.completed_planners());
    let found = analysis.equal_errors.iter().filter(|it| {
        it.baseline == baseline && it.measure.id == id && completed.contains(&it.planner)
    });
    let groups = found.map(|it| {
        (it.planner, verdict_group(verdict(it.ratio.interval, 1.0, Direction::Minimise)))
    });
    let words = ["fewer touches", "more touches", "about as many (no established difference)"];
    let words = words.map(String::from);
    let clauses = clauses(groups, ["needs", "need"], words)?;
    Some(format!("To reach the final error of {baseline}, {clauses}."))
}

/// Returns in how many trials each planner names the right object after the last touch, and from
/// which touch on; `None` without hypotheses about a known object.
fn recognition(run: &Run) -> Option<String> {
    let clause = |name: &str| {
        let named = planner_rows(&run.rows, name).filter_map(|row| {
            let is_right = |touch: &TouchRow| touch.recognition.as_ref()?.is_right();
            let known = (1..).zip(&row.touches);
            let known: Vec<(u32, bool)> =
                known.filter_map(|(count, touch)| Some((count, is_right(touch)?))).collect();
            let wrong = known.iter().rposition(|(_, is_right)| !is_right);
            let from = known.get(wrong.map_or(0, |last| last + 1));
            (!known.is_empty()).then_some(from.map(|(count, _)| f64::from(*count)))
        });
        let named: Vec<Option<f64>> = named.collect();
        let right: Vec<f64> = named.iter().copied().flatten().collect();
        let from = statistics::median(&right)
            .map_or(String::new(), |from| format!(", from touch {} on (median)", from.ceil()));
        let trials = counted(named.len(), "trial");
        (!named.is_empty()).then(|| format!("{name} in {} of {trials}{from}", right.len()))
    };
    let found: Vec<String> = run.experiment.planners.iter().filter_map(|it| clause(it)).collect();
    let touches = counted(run.experiment.touches, "touch");
    let words = || format!("The right object is named after {touches}: {}.", found.join("; "));
    (!found.is_empty()).then(words)
}

/// Returns which planners have calibrated bands after the last touch.
fn calibration(run: &Run) -> Option<String> {
    let groups = run.completed_planners().into_iter().filter_map(|name| {
        let points = summary::curve(&run.experiment, &run.rows, name);
        let group = match share_in_band(&points)? {
            share if CALIBRATED.contains(&share) => 0,
            share if share < *CALIBRATED.start() => 1,
            _ => 2,
        };
        Some((name, group))
    });
    let words = [
        "calibrated (90 to 98 % of the truth in its 95 % band)",
        "overconfident (less than 90 %)",
        "underconfident (more than 98 %)",
    ];
    let clauses = clauses(groups, ["is", "are"], words.map(String::from))?;
    Some(format!("Calibration of the last belief: {clauses}."))
}

/// Returns the number of a verdict's group: better, worse, neither.
pub(super) fn verdict_group(verdict: Option<&str>) -> usize {
    verdict.map_or(2, |word| usize::from(word != "better"))
}

/// Returns a clause for each of three groups of planners that is not empty; `None` without
/// planners.
pub(super) fn clauses<'a>(
    planners: impl Iterator<Item = (&'a str, usize)>,
    [one, many]: [&str; 2],
    words: [String; 3],
) -> Option<String> {
    let mut groups = [const { Vec::new() }; 3];
    planners.for_each(|(name, group)| groups[group].push(name));
    let clause = |(names, words): (&Vec<&str>, String)| match &names[..] {
        [] => None,
        [name] => Some(format!("{name} {one} {words}")),
        [names @ .., last] => Some(format!("{} and {last} {many} {words}", names.join(", "))),
    };
    let clauses: Vec<String> = groups.iter().zip(words).filter_map(clause).collect();
    (!clauses.is_empty()).then(|| clauses.join("; "))
}
