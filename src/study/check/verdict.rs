//! What a sample of differences says of a planner.

use super::judged::Judged;
use super::sequence::Sequence;
use serde::Serialize;

/// What is said of one measure of one planner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// No difference in any trial.
    Identical,
    /// Less of what should be little.
    Better,
    /// Not more than is tolerated.
    Ok,
    /// These trials cannot tell.
    Undecided,
    /// More of it.
    Worse,
    /// No trial has it, of which the baseline has some.
    Missing,
}

/// One measure of one planner, new against old in the same trials.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// The measure.
    pub judged: &'static Judged,
    /// What its differences, new − old, tell.
    pub sequence: Sequence,
    /// What is said of it.
    pub verdict: Verdict,
    /// How many trials would tell a difference of the tolerance, by their spread so far.
    pub wanted: Option<usize>,
}

/// How sure to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// Share of an error that may be lost.
    pub tolerance: f64,
    /// Probability of one false word about a planner's first measure, at any time; the other
    /// measures share as much, divided after Holm (1979).
    pub alpha: f64,
    /// Trials whose rows are looked at first, whether they are the same.
    pub first: usize,
    /// Trials between two looks at an interval.
    pub batch: usize,
}

impl Default for Rules {
    fn default() -> Self {
        Self { tolerance: 0.05, alpha: 0.05, first: 4, batch: 10 }
    }
}

impl Rules {
    fn verdict(&self, judged: &Judged, sequence: &Sequence, is_sure: bool) -> Verdict {
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

    /// One planner's measures from the differences of its trials; the first decides.
    pub fn judge(&self, differences: &[(&'static Judged, Vec<f64>)]) -> Vec<Judgement> {
        let sequences: Vec<Sequence> = differences
            .iter()
            .map(|(_, values)| Sequence::new(values, self.batch, self.alpha))
            .collect();
        let sure = self.sure(&sequences);
        let all = differences.iter().zip(&sequences).zip(&sure);
        all.map(|(((judged, _), sequence), &is_sure)| Judgement {
            judged,
            verdict: self.verdict(judged, sequence, is_sure),
            wanted: sequence.wanted(judged.allowed(self.tolerance), self.alpha),
            sequence: *sequence,
        })
        .collect()
    }

    /// Of which measures a difference is sure: of the first by itself, of the others after Holm.
    fn sure(&self, sequences: &[Sequence]) -> Vec<bool> {
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

/// What is said of a planner: its first measure decides, and any that is worse or missing.
pub fn of_planner(judgements: &[Judgement]) -> Verdict {
    let first = judgements.first().map_or(Verdict::Missing, |first| first.verdict);
    let is_bad = |judgement: &&Judgement| judgement.verdict >= Verdict::Worse;
    judgements.iter().find(is_bad).map_or(first, |bad| bad.verdict.max(first))
}
