//! Trials run again until each planner is told from what it was, or is not.

use super::baseline::{Baseline, Line, settings};
use super::judged::JUDGED;
use super::verdict::{Judgement, Rules, Verdict, of_planner};
use crate::error::Invalid;
use crate::experiment::Simulation;
use crate::experiment::runner::{self, Progress};
use std::sync::atomic::{AtomicBool, Ordering};

/// What came of it.
#[derive(Debug)]
pub struct Held {
    /// One of each planner of experiment or baseline.
    pub planners: Vec<Planner>,
    /// Whether settings are those of the baseline.
    pub same_settings: bool,
    /// Whether it was stopped before it had told everything.
    pub is_stopped: bool,
    /// The trials that were made.
    pub rows: Vec<Line>,
}

/// What is said of a planner.
#[derive(Debug)]
pub struct Planner {
    /// Its name.
    pub name: String,
    /// What is said of it.
    pub verdict: Verdict,
    /// Trials that pair with the baseline's.
    pub trials: usize,
    /// Trials that failed and did not in the baseline, with the reason of the first.
    pub failed: Option<(usize, String)>,
    /// Measure by measure; none if nothing pairs, or all is the same.
    pub judgements: Vec<Judgement>,
}

impl Held {
    /// The worst that is said.
    pub fn verdict(&self) -> Verdict {
        self.planners.iter().map(|planner| planner.verdict).max().unwrap_or(Verdict::Missing)
    }
}

/// Runs the experiment's planners on the baseline's trials: a few, whether they are the same, then
/// a batch at a time.
///
/// # Errors
/// If threads cannot be started.
pub fn hold(
    simulation: &Simulation,
    baseline: &Baseline,
    rules: &Rules,
    threads: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Held, Invalid> {
    let experiment = simulation.experiment();
    let names = &experiment.planners;
    let mut open: Vec<&str> = names.iter().map(String::as_str).collect();
    open.retain(|name| baseline.header.planners.iter().any(|known| known == name));
    let mut rows: Vec<Line> = Vec::new();
    let last = experiment.trials.min(baseline.header.trials);
    let mut first = 0;
    while first < last && !open.is_empty() && !stop.load(Ordering::Relaxed) {
        let (some, batch) = (rules.first as u32, rules.batch as u32);
        let until = last.min(if first < some { some } else { (first / batch + 1) * batch });
        let planners: Vec<_> = open.iter().filter_map(|name| simulation.planner(name)).collect();
        let jobs: Vec<_> = (first..until)
            .flat_map(|trial| planners.iter().map(move |&planner| (trial, planner)))
            .collect();
        let made = runner::rows(simulation, jobs, threads, stop, progress)?;
        rows.extend(made.iter().map(|row| Line::of(row, experiment)));
        // The first rows only tell whether anything is other: intervals are looked at by batches.
        let is_open = |verdict| match until < batch {
            true => verdict != Verdict::Identical,
            false => verdict == Verdict::Undecided,
        };
        open.retain(|name| is_open(planner_of(baseline, rules, &rows, name).verdict));
        first = until;
    }
    let others = baseline.header.planners.iter().filter(|name| !names.contains(name));
    let planners =
        names.iter().chain(others).map(|name| planner_of(baseline, rules, &rows, name)).collect();
    let same_settings = baseline.header.settings == settings(experiment);
    Ok(Held { planners, same_settings, is_stopped: stop.load(Ordering::Relaxed), rows })
}

/// Which planners differ in the baseline `new` from those in `old`, and how: a line each.
pub fn differs(old: &Baseline, new: &Baseline, rules: &Rules) -> Vec<String> {
    let (known, names) = (&old.header.planners, &new.header.planners);
    let told = names.iter().filter_map(|name| {
        if !known.contains(name) {
            return Some(format!("{name}: new"));
        }
        let planner = planner_of(old, rules, &new.lines, name);
        let first = planner.judgements.first()?;
        let percent = first.judged.percent(first.sequence.mean);
        Some(format!("{name}: {} {percent:+.2} % in {} trials", first.judged.title, planner.trials))
    });
    let gone = known.iter().filter(|name| !names.contains(name));
    told.chain(gone.map(|name| format!("{name}: gone"))).collect()
}

fn planner_of(baseline: &Baseline, rules: &Rules, rows: &[Line], name: &str) -> Planner {
    let pairs: Vec<(&Line, &Line)> = rows
        .iter()
        .filter(|row| row.planner == name)
        .filter_map(|row| Some((row, baseline.line(row.trial, name)?)))
        .collect();
    let failures: Vec<&String> = pairs
        .iter()
        .filter(|(_, old)| old.failure.is_none())
        .filter_map(|(new, _)| new.failure.as_ref())
        .collect();
    let failed = failures.first().map(|first| (failures.len(), (*first).clone()));
    let trials = pairs.len();
    let is_identical = trials > 0 && pairs.iter().all(|(new, old)| new.row == old.row);
    let mut judgements = Vec::new();
    if trials > 0 && !is_identical {
        let differences = JUDGED.iter().filter_map(|judged| {
            let value = |line: &Line| line.values.get(judged.id).copied();
            // What neither has is not judged.
            let is_known = pairs.iter().any(|(new, old)| value(new).or(value(old)).is_some());
            let difference = |(new, old): &(&Line, &Line)| Some(value(new)? - value(old)?);
            is_known.then(|| (judged, pairs.iter().filter_map(difference).collect()))
        });
        judgements = rules.judge(&differences.collect::<Vec<_>>());
    }
    let verdict = match (is_identical, &failed) {
        (true, _) => Verdict::Identical,
        (false, Some(_)) => Verdict::Missing,
        (false, None) => of_planner(&judgements),
    };
    Planner { name: name.into(), verdict, trials, failed, judgements }
}
