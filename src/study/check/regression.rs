//! Regression test: repeats trials until each planner's verdict is decided.

use super::baseline::{StoredBaseline, TrialLine, settings_hash};
use super::measures::{CHECK_MEASURES, CheckMeasure, Verdict};
use super::sequence::ConfidenceSequence;
use crate::experiment::Simulation;
use crate::experiment::row::TrialRow;
use crate::experiment::runner::{self, Progress};
use palpate_input::error::InputError;
use palpate_input::format::counted;
use std::sync::atomic::{AtomicBool, Ordering};

/// Result of a regression test.
#[derive(Debug)]
pub struct CheckResult {
    /// Results of each planner of the experiment or the baseline.
    pub planners: Vec<PlannerResult>,
    /// Whether the settings equal those of the baseline.
    pub same_settings: bool,
    /// Whether the test was stopped before all verdicts were decided.
    pub is_stopped: bool,
    /// Share of the surface that the finger cannot reach, which no measure judges.
    pub unreachable_share: Option<f64>,
    /// Lines of the trials run.
    pub rows: Vec<TrialLine>,
}

/// Result of a planner.
#[derive(Debug)]
pub struct PlannerResult {
    /// Name of the planner.
    pub name: String,
    /// Verdict on the planner.
    pub verdict: Verdict,
    /// Trials paired with the baseline.
    pub trials: usize,
    /// Remark on the planner, e.g. that trials failed.
    pub remark: Option<String>,
    /// Result per measure; empty if no trial pairs, or all rows are identical.
    pub judgements: Vec<MeasureResult>,
}

impl PlannerResult {
    /// Returns a line per measure: title, change in percent with the ends of its 95 % interval if
    /// any trial pairs, and verdict. A planner without measures has one line without a title.
    pub fn lines(&self) -> Vec<(&'static str, Option<[f64; 3]>, Verdict)> {
        let line = |it: &MeasureResult| {
            let [low, high] = it.sequence.interval;
            let percent = [it.sequence.mean, low, high].map(|at| it.judged.percent(at));
            (it.judged.title, (it.sequence.count > 0).then_some(percent), it.verdict)
        };
        match self.judgements.is_empty() {
            true => vec![("", None, self.verdict)],
            false => self.judgements.iter().map(line).collect(),
        }
    }
}

impl CheckResult {
    /// Worst verdict of all planners.
    pub fn verdict(&self) -> Verdict {
        self.planners.iter().map(|planner| planner.verdict).max().unwrap_or(Verdict::Missing)
    }
}

/// Runs the experiment's planners on the baseline's trials: first a few, to test for identical
/// rows, then in batches.
///
/// # Errors
/// If the threads cannot be started.
pub fn run_check(
    simulation: &Simulation,
    baseline: &StoredBaseline,
    rules: &CheckOptions,
    threads: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<CheckResult, InputError> {
    let experiment = simulation.experiment();
    let names = &experiment.planners;
    let mut open: Vec<&str> = names.iter().map(String::as_str).collect();
    open.retain(|name| baseline.header.planners.iter().any(|known| known == name));
    let mut rows: Vec<TrialLine> = Vec::new();
    let last = experiment.trials.min(baseline.header.trials);
    let mut first = 0;
    while first < last && !open.is_empty() && !stop.load(Ordering::Relaxed) {
        let (some, batch) = (rules.first as u32, rules.batch as u32);
        let until = last.min(if first < some { some } else { (first / batch + 1) * batch });
        let planners: Vec<_> = open.iter().filter_map(|name| simulation.planner(name)).collect();
        let jobs: Vec<_> = (first..until)
            .flat_map(|trial| planners.iter().map(move |&planner| (trial, planner)))
            .collect();
        let made = runner::run_in_memory(simulation, jobs, threads, stop, progress)?;
        rows.extend(made.iter().map(|row| TrialLine::of(row, experiment)));
        // The first rows only show whether anything differs; intervals are evaluated per batch.
        let is_open = |verdict| match until < batch {
            true => verdict != Verdict::Identical,
            false => verdict == Verdict::Undecided,
        };
        open.retain(|name| is_open(planner_of(baseline, rules, &rows, name).verdict));
        first = until;
    }
    let others = baseline.header.planners.iter().filter(|name| !names.contains(name));
    let mut planners: Vec<_> =
        names.iter().chain(others).map(|name| planner_of(baseline, rules, &rows, name)).collect();
    // Random numbers of a planner's own look like a change of the planner.
    let changed = planners.iter_mut().filter(|it| it.trials > 0 && !it.judgements.is_empty());
    for result in changed.filter(|it| it.remark.is_none()) {
        let jobs = simulation.planner(&result.name).map(|planner| vec![(0, planner)]);
        let again = runner::run_in_memory(simulation, jobs.unwrap_or_default(), 1, stop, &|_| ())?;
        let again = again.iter().map(|row| TrialLine::of(row, experiment));
        result.remark = again.filter(|line| !rows.contains(line)).map(|_| UNSEEDED.into()).next();
    }
    let same_settings = baseline.header.settings == settings_hash(experiment);
    let unreachable_share = simulation.truth().unreachable_share();
    let is_stopped = stop.load(Ordering::Relaxed);
    Ok(CheckResult { planners, same_settings, is_stopped, unreachable_share, rows })
}

/// Remark on a planner whose trial depends on more than its seed.
const UNSEEDED: &str = "trial 0 differs when it is repeated; take random numbers from the `rng` \
    or `seed` of the constructor only";

/// Runs all trials of an experiment for a baseline, and the first of each planner again: a planner
/// with random numbers of its own has no baseline, nor has one that always fails. Trials not
/// started before `stop` became true are left out.
///
/// # Errors
/// If a repeated trial differs, all trials of a planner fail, a planner is not available, or
/// threads cannot be started.
pub fn baseline_rows(
    simulation: &Simulation,
    threads: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<TrialRow>, InputError> {
    let mut jobs = runner::missing_jobs(simulation, &[])?;
    let rows = runner::run_in_memory(simulation, jobs.clone(), threads, stop, progress)?;
    jobs.retain(|(trial, _)| *trial == 0);
    let text = |row: &TrialRow| serde_json::to_string(row).unwrap_or_default();
    for again in runner::run_in_memory(simulation, jobs, threads, stop, &|_| ())? {
        let first = rows.iter().find(|row| row.id() == again.id());
        if first.is_some_and(|first| text(first) != text(&again)) {
            return Err(InputError::new(format!("planner {}: {UNSEEDED}", again.planner)));
        }
    }
    for name in &simulation.experiment().planners {
        let mut own = rows.iter().filter(|row| row.planner == *name).peekable();
        let is_lost = own.peek().is_some() && own.all(|row| row.failure.is_some());
        if let Some(failed) = failures(&rows, name).filter(|_| is_lost) {
            let problem =
                format!("planner {name}: {failed}; allowed is one that completes a trial");
            return Err(InputError::new(problem));
        }
    }
    Ok(rows)
}

/// Says how many trials of a planner failed, and the first reason; `None` if none did.
pub fn failures(rows: &[TrialRow], name: &str) -> Option<String> {
    let own: Vec<_> = rows.iter().filter(|row| row.planner == name).collect();
    let reasons: Vec<_> = own.iter().filter_map(|row| row.failure.as_deref()).collect();
    failed_of(own.len(), &reasons, "")
}

/// Says how many of `count` trials failed, how the baseline has them, and the first reason.
fn failed_of(count: usize, reasons: &[&str], how: &str) -> Option<String> {
    let first = reasons.first()?;
    let failed = reasons.len();
    Some(format!("{failed} of {} failed{how}; the first: {first}", counted(count, "trial")))
}

/// Returns the baseline of all trials of an experiment that replaces `old`. Its header lists
/// planners that differ; planners of `old` that the experiment lacks are kept if `is_partial`.
///
/// # Errors
/// If planners would be kept whose settings differ.
pub fn accepted(
    simulation: &Simulation,
    rows: &[TrialRow],
    why: &str,
    old: Option<&StoredBaseline>,
    is_partial: bool,
    rules: &CheckOptions,
) -> Result<StoredBaseline, InputError> {
    let mut new = StoredBaseline::new(simulation, rows, why);
    let Some(old) = old else { return Ok(new) };
    let names = new.header.planners.clone();
    let is_kept = |name: &String| is_partial && !names.contains(name);
    let kept: Vec<_> = old.header.planners.iter().filter(|name| is_kept(name)).collect();
    if !kept.is_empty() && old.header.settings != new.header.settings {
        return Err(InputError::new(format!(
            "the settings differ, so the rows of {kept:?} in the baseline cannot be kept; check all planners \
             of the experiment, or use a new file"
        )));
    }
    new.header.differs = differences(old, &new, rules);
    new.header.planners.extend(kept.into_iter().cloned());
    new.lines.extend(old.lines.iter().filter(|line| is_kept(&line.planner)).cloned());
    Ok(new)
}

/// Returns a line for each planner in `new` that differs from `old`, with the difference.
fn differences(old: &StoredBaseline, new: &StoredBaseline, rules: &CheckOptions) -> Vec<String> {
    let (known, names) = (&old.header.planners, &new.header.planners);
    let results = names.iter().filter_map(|name| {
        if !known.contains(name) {
            return Some(format!("{name}: new"));
        }
        let planner = planner_of(old, rules, &new.lines, name);
        let first = planner.judgements.first()?;
        let (title, sequence) = (first.judged.title, &first.sequence);
        if sequence.count == 0 {
            return Some(format!("{name}: {title} is new"));
        }
        let percent = first.judged.percent(sequence.mean);
        let trials = counted(planner.trials, "trial");
        Some(format!("{name}: {title} {percent:+.2} % in {trials}"))
    });
    let gone = known.iter().filter(|name| !names.contains(name));
    results.chain(gone.map(|name| format!("{name}: removed"))).collect()
}

fn planner_of(
    baseline: &StoredBaseline,
    rules: &CheckOptions,
    rows: &[TrialLine],
    name: &str,
) -> PlannerResult {
    let pairs: Vec<(&TrialLine, &TrialLine)> = rows
        .iter()
        .filter(|row| row.planner == name)
        .filter_map(|row| Some((row, baseline.line(row.trial, name)?)))
        .collect();
    let failed_new = |was_failed: bool| -> Vec<&str> {
        let with = pairs.iter().filter(|(_, old)| old.failure.is_some() == was_failed);
        with.filter_map(|(new, _)| new.failure.as_deref()).collect()
    };
    let lost = failed_of(pairs.len(), &failed_new(false), " that passed in the baseline");
    let is_lost = lost.is_some();
    let trials = pairs.len();
    let is_identical = trials > 0 && pairs.iter().all(|(new, old)| new.row == old.row);
    let mut judgements = Vec::new();
    if trials > 0 && !is_identical {
        let differences = CHECK_MEASURES.iter().filter_map(|judged| {
            let value = |line: &TrialLine| line.values.get(judged.id).copied();
            // Measures without any value are left out.
            let is_known = pairs.iter().any(|(new, old)| value(new).or(value(old)).is_some());
            let difference = |(new, old): &(&TrialLine, &TrialLine)| {
                let is_lost = new.failure.is_some() && old.failure.is_none();
                Some(value(new)? - value(old)?).filter(|_| !is_lost)
            };
            is_known.then(|| (judged, pairs.iter().filter_map(difference).collect()))
        });
        judgements = rules.evaluate(&differences.collect::<Vec<_>>());
    }
    let verdict = match (is_identical, is_lost) {
        (true, _) => Verdict::Identical,
        (false, true) => Verdict::Missing,
        (false, false) => planner_verdict(&judgements),
    };
    let is_known = baseline.header.planners.iter().any(|known| known == name);
    let unpaired = match is_known {
        true => "only in the baseline, or none of its trials was run",
        false => "not in the baseline; add it with --accept REASON",
    };
    let remark = lost
        .or_else(|| failed_of(trials, &failed_new(true), ", as in the baseline"))
        .or_else(|| (trials == 0).then(|| unpaired.into()));
    PlannerResult { name: name.into(), verdict, trials, remark, judgements }
}

/// Result of one measure of one planner, new against old in the same trials.
#[derive(Clone, Debug)]
pub struct MeasureResult {
    /// Tested measure.
    pub judged: &'static CheckMeasure,
    /// Confidence sequence of the differences, new − old.
    pub sequence: ConfidenceSequence,
    /// Verdict on the measure.
    pub verdict: Verdict,
    /// Trials needed to detect a difference of the tolerance, estimated from the spread so far.
    pub trials_needed: Option<usize>,
}

/// Parameters of the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckOptions {
    /// Largest relative increase in error that still passes.
    pub tolerance: f64,
    /// Probability of a false alarm in a planner's first measure at any evaluation. The other
    /// measures share the same probability, corrected after Holm 1979.
    pub alpha: f64,
    /// Number of trials in the first test for identical rows.
    pub first: usize,
    /// Trials between two evaluations of an interval.
    pub batch: usize,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self { tolerance: 0.05, alpha: 0.05, first: 4, batch: 10 }
    }
}

impl CheckOptions {
    fn verdict(
        &self,
        judged: &CheckMeasure,
        sequence: &ConfidenceSequence,
        is_sure: bool,
    ) -> Verdict {
        let [low, high] = sequence.interval;
        match () {
            () if sequence.count == 0 => Verdict::Missing,
            () if sequence.is_zero => Verdict::Identical,
            () if high < 0.0 && is_sure => Verdict::Better,
            () if high < judged.allowed(self.tolerance) => Verdict::Ok,
            () if low > 0.0 && is_sure => Verdict::Worse,
            () => Verdict::Undecided,
        }
    }

    /// Evaluates a planner's measures from the differences of its trials; the first measure
    /// decides.
    pub fn evaluate(
        &self,
        differences: &[(&'static CheckMeasure, Vec<f64>)],
    ) -> Vec<MeasureResult> {
        let sequences: Vec<ConfidenceSequence> = differences
            .iter()
            .map(|(_, values)| ConfidenceSequence::new(values, self.batch, self.alpha))
            .collect();
        let sure = self.significant(&sequences);
        let all = differences.iter().zip(&sequences).zip(&sure);
        all.map(|(((judged, _), sequence), &is_sure)| MeasureResult {
            judged,
            verdict: self.verdict(judged, sequence, is_sure),
            trials_needed: sequence.sample_size(judged.allowed(self.tolerance), self.alpha),
            sequence: *sequence,
        })
        .collect()
    }

    /// Whether each measure's difference is significant: the first alone, the others with
    /// Holm's correction (Holm 1979).
    fn significant(&self, sequences: &[ConfidenceSequence]) -> Vec<bool> {
        let mut order: Vec<usize> = (1..sequences.len()).collect();
        order.sort_by(|&a, &b| sequences[a].p.total_cmp(&sequences[b].p));
        let mut sure = vec![false; sequences.len()];
        if let (Some(sure), Some(first)) = (sure.first_mut(), sequences.first()) {
            *sure = first.p <= self.alpha;
        }
        let count = order.len();
        for (rank, i) in order.into_iter().enumerate() {
            if sequences[i].p > self.alpha / (count - rank) as f64 {
                break;
            }
            sure[i] = true;
        }
        sure
    }
}

/// Returns the verdict on a planner: that of its first measure, or a worse one if any measure is
/// worse or missing.
pub fn planner_verdict(judgements: &[MeasureResult]) -> Verdict {
    let first = judgements.first().map_or(Verdict::Missing, |first| first.verdict);
    let is_bad = |judgement: &&MeasureResult| judgement.verdict >= Verdict::Worse;
    judgements.iter().find(is_bad).map_or(first, |bad| bad.verdict.max(first))
}
