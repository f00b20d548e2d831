//! What a run decides, in words: only what its intervals establish.

use super::findings::{HONEST, share_in_band};
use super::tables::{Verdict, comparison, equal_error};
use crate::experiment::statistics::analysis::Analysis;
use crate::experiment::statistics::summary;
use crate::experiment::store::Run;

/// Sentences; none of a run without a belief.
pub fn sentences(run: &Run, analysis: &Analysis) -> Vec<String> {
    let baselines = run.experiment.baselines();
    let baseline = baselines.first().copied().unwrap_or_default();
    nearness(run, analysis, baseline)
        .into_iter()
        .chain(effort(run, analysis, baseline))
        .chain(trust(run))
        .collect()
}

/// Who is nearer the truth after the last touch than the first baseline.
fn nearness(run: &Run, analysis: &Analysis, baseline: &str) -> Option<String> {
    let found = analysis.comparisons.iter();
    let told: Vec<(&str, Option<Verdict>)> = found
        .filter(|it| it.baseline == baseline && it.measure.id == run.experiment.error().id)
        .map(|it| (it.planner, comparison::verdict(it)))
        .collect();
    let which = sorted(&told)?;
    let words = [
        format!("nearer the truth than {baseline}"),
        format!("farther from the truth than {baseline}"),
        format!("not told apart from {baseline}"),
    ];
    let touches = run.experiment.touches;
    Some(format!("After {touches} touches {}.", clauses(&which, ["is", "are"], words)))
}

/// Who needs fewer touches than the first baseline for the error that it ends with.
fn effort(run: &Run, analysis: &Analysis, baseline: &str) -> Option<String> {
    let found = analysis.equal_errors.iter();
    let told: Vec<(&str, Option<Verdict>)> = found
        .filter(|it| it.baseline == baseline && it.measure.id == run.experiment.error().id)
        .map(|it| (it.planner, equal_error::verdict(it)))
        .collect();
    let which = sorted(&told)?;
    let words = ["fewer touches", "more touches", "about as many, as far as these trials tell"];
    let clauses = clauses(&which, ["needs", "need"], words.map(String::from));
    Some(format!("For the error that {baseline} reaches, {clauses}."))
}

/// Whose last bands hold as much of the truth as they say.
fn trust(run: &Run) -> Option<String> {
    let shares = run.experiment.planners.iter().filter_map(|name| {
        let points = summary::curve(&run.experiment, &run.rows, name);
        Some((name.as_str(), share_in_band(&points)?))
    });
    let shares: Vec<(&str, f64)> = shares.collect();
    let with = |is_it: fn(f64) -> bool| -> Vec<&str> {
        shares.iter().filter(|(_, share)| is_it(*share)).map(|(name, _)| *name).collect()
    };
    let which = [
        with(|share| HONEST.contains(&share)),
        with(|share| share < *HONEST.start()),
        with(|share| share > *HONEST.end()),
    ];
    let words = [
        "about as far off as it says",
        "too sure of itself",
        "less sure of itself than it could be",
    ];
    let clauses = clauses(&which, ["is", "is"], words.map(String::from));
    (!shares.is_empty()).then(|| format!("The last belief of {clauses}."))
}

/// Planners that are better, worse and neither; none of nobody.
fn sorted<'a>(told: &[(&'a str, Option<Verdict>)]) -> Option<[Vec<&'a str>; 3]> {
    let with = |verdict: Option<Verdict>| -> Vec<&'a str> {
        told.iter().filter(|(_, it)| *it == verdict).map(|(name, _)| *name).collect()
    };
    (!told.is_empty()).then(|| [Some(Verdict::Better), Some(Verdict::Worse), None].map(with))
}

/// What is said of each group of planners that is not empty.
fn clauses(groups: &[Vec<&str>; 3], [one, many]: [&str; 2], words: [String; 3]) -> String {
    let said = groups.iter().zip(words).filter(|(names, _)| !names.is_empty());
    let clauses: Vec<String> = said
        .map(|(names, words)| {
            let verb = if names.len() == 1 { one } else { many };
            format!("{} {verb} {words}", listed(names))
        })
        .collect();
    clauses.join("; ")
}

/// a, b and c.
fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [name] => (*name).into(),
        [names @ .., last] => format!("{} and {last}", names.join(", ")),
    }
}
