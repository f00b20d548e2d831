//! Planners over several runs, after rliable (Agarwal et al. 2021): interquartile means with
//! stratified bootstrap, probability of improvement, performance profiles.
//!
//! An object is an experiment's name. A trial's score on it is its error over the trial's span,
//! exp(mean log RMSE), in units of what a reference planner has in the same trial, so that objects
//! of different sizes count alike. Less is better, and the reference has 1.

use super::check::judged::JUDGED;
use crate::experiment::measure::outline::TENTHS;
use crate::experiment::statistics::{mean, percentiles_95, resampled_within};
use crate::experiment::store::Run;
use crate::experiment::trial::row::{TouchRow, TrialRow, of_planner};
use std::collections::HashMap;
use thiserror::Error;

/// Scores of planners on objects.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Names of the objects.
    pub objects: Vec<String>,
    /// Who is compared.
    pub contenders: Vec<Contender>,
}

/// A planner, of one run of each object where an object has several.
#[derive(Clone, Debug, PartialEq)]
pub struct Contender {
    /// Its name.
    pub name: String,
    /// Scores of its trials on each object; none on one that it did not explore.
    pub scores: Vec<Vec<f64>>,
    /// What that took on each object.
    pub spent: Vec<Option<Spent>>,
    /// What the belief said of itself on each object.
    pub said: Vec<Said>,
}

/// What a planner's trials of one object took, after the initial touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spent {
    /// Share of the touches that met nothing.
    pub missed: f64,
    /// Share of the plans that its own rule could not decide.
    pub stalled: f64,
    /// Mean lateral travel of a trial.
    pub travel_m: f64,
}

/// How honest the beliefs of a planner's trials of one object were after the last touch, each a
/// mean over the trials that know it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Said {
    /// Share of the truth in the 95 % band.
    pub coverage: Option<f64>,
    /// Brier score of where there is a surface.
    pub brier: Option<f64>,
    /// Intersection over union of the silhouettes.
    pub iou: Option<f64>,
    /// Places given a probability of a surface in each tenth, and those of them that have one.
    pub reliability: [[u32; 2]; TENTHS],
}

/// What cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum CompareError {
    /// A run lacks the planner that others are held against.
    #[error("{run}: has no trials of \"{against}\" that others could be held against (--against)")]
    NoReference {
        /// The run's folder.
        run: String,
        /// The planner.
        against: String,
    },
    /// Two runs of one name do not share their trials.
    #[error(
        "{run} and {first} are both \"{name}\", but seed, touches or grid differ: their trials do not pair"
    )]
    Unpaired {
        /// One.
        run: String,
        /// The other.
        first: String,
        /// Their experiment's name.
        name: String,
    },
}

/// Of runs with their folders' names, in units of the planner `against`.
///
/// # Errors
/// If the first run of an object lacks that planner.
pub fn compare(runs: &[(String, Run)], against: &str) -> Result<Compared, CompareError> {
    let mut objects: Vec<String> = Vec::new();
    let mut units: Vec<HashMap<u32, f64>> = Vec::new();
    let mut contenders: Vec<Contender> = Vec::new();
    let names: Vec<&str> = runs.iter().map(|(_, run)| run.experiment.name.as_str()).collect();
    for (folder, run) in runs {
        let name = &run.experiment.name;
        let index = objects.iter().position(|object| object == name);
        let pairing = |run: &Run| {
            let it = &run.experiment;
            (it.seed, it.initial_touches, it.touches, it.grid)
        };
        let first = runs.iter().find(|(_, other)| other.experiment.name == *name);
        if let Some((first, other)) = first
            && pairing(other) != pairing(run)
        {
            let (run, first, name) = (folder.clone(), first.clone(), name.clone());
            return Err(CompareError::Unpaired { run, first, name });
        }
        let index = match index {
            Some(index) => index,
            None => {
                let unit = logs(run, against);
                if unit.is_empty() {
                    let (run, against) = (folder.clone(), against.into());
                    return Err(CompareError::NoReference { run, against });
                }
                objects.push(name.clone());
                units.push(unit);
                for contender in &mut contenders {
                    contender.scores.push(Vec::new());
                    contender.spent.push(None);
                    contender.said.push(Said::default());
                }
                objects.len() - 1
            }
        };
        let is_one_of_several = names.iter().filter(|other| *other == name).count() > 1;
        for planner in &run.experiment.planners {
            let label = match is_one_of_several {
                true => format!("{planner} ({folder})"),
                false => planner.clone(),
            };
            let unit = &units[index];
            let mut scores: Vec<(u32, f64)> = logs(run, planner)
                .into_iter()
                .filter_map(|(trial, log)| Some((trial, (log - unit.get(&trial)?).exp())))
                .collect();
            scores.sort_by_key(|(trial, _)| *trial);
            let place = contenders.iter().position(|it| it.name == label).unwrap_or_else(|| {
                let scores = vec![Vec::new(); objects.len()];
                let (spent, said) =
                    (vec![None; objects.len()], vec![Said::default(); objects.len()]);
                contenders.push(Contender { name: label, scores, spent, said });
                contenders.len() - 1
            });
            contenders[place].scores[index] = scores.into_iter().map(|(_, score)| score).collect();
            contenders[place].spent[index] = spent(run, planner);
            contenders[place].said[index] = said(run, planner);
        }
    }
    Ok(Compared { objects, contenders })
}

/// Mean log RMSE of a planner's whole trials.
fn logs(run: &Run, planner: &str) -> HashMap<u32, f64> {
    let of = JUDGED[0].of;
    let whole = of_planner(&run.rows, planner).filter(|row| row.failure.is_none());
    whole.filter_map(|row| Some((row.trial, of(row, &run.experiment)?))).collect()
}

/// What a planner's whole trials took; none of none.
fn spent(run: &Run, planner: &str) -> Option<Spent> {
    let experiment = &run.experiment;
    let whole: Vec<&TrialRow> =
        of_planner(&run.rows, planner).filter(|row| row.failure.is_none()).collect();
    let planned = || {
        let initial = experiment.initial_touches as usize;
        whole.iter().flat_map(move |row| row.touches.iter().skip(initial))
    };
    let share = |count: usize| count as f64 / planned().count().max(1) as f64;
    let travels: Vec<f64> = whole.iter().filter_map(|row| row.path_m(experiment.touches)).collect();
    (!whole.is_empty()).then(|| Spent {
        missed: share(planned().filter(|touch| touch.contact.is_none() && !touch.overload).count()),
        stalled: share(planned().filter(|touch| touch.stall.is_some()).count()),
        travel_m: mean(&travels),
    })
}

/// What a planner's whole trials said of themselves at their end.
fn said(run: &Run, planner: &str) -> Said {
    let whole = || of_planner(&run.rows, planner).filter(|row| row.failure.is_none());
    let over_trials = |of: fn(&TouchRow) -> Option<f64>| {
        let values: Vec<f64> = whole().filter_map(|row| row.touches.last().and_then(of)).collect();
        (!values.is_empty()).then(|| mean(&values))
    };
    let mut reliability = [[0; 2]; TENTHS];
    let outlines = whole().filter_map(|row| row.touches.last()?.outline.as_ref());
    for counted in outlines.filter_map(|outline| outline.reliability) {
        for (sums, counts) in reliability.iter_mut().zip(counted) {
            sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        }
    }
    Said {
        coverage: over_trials(|touch| touch.metrics.as_ref()?.coverage),
        brier: over_trials(|touch| Some(touch.outline.as_ref()?.brier)),
        iou: over_trials(|touch| Some(touch.outline.as_ref()?.iou)),
        reliability,
    }
}

/// Mean of the middle half; none of nothing.
pub fn interquartile_mean(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let cut = sorted.len() / 4;
    let middle = &sorted[cut..sorted.len() - cut];
    (!middle.is_empty()).then(|| mean(middle))
}

/// The interquartile mean over all strata, with the 95 % interval of a bootstrap that draws within
/// each; none where a stratum is empty.
pub fn interquartile(strata: &[&[f64]], seed: u64) -> Option<(f64, [f64; 2])> {
    if strata.is_empty() || strata.iter().any(|stratum| stratum.is_empty()) {
        return None;
    }
    let sizes: Vec<usize> = strata.iter().map(|stratum| stratum.len()).collect();
    let mut sample = Vec::new();
    let found = resampled_within(&sizes, (seed, "compare"), |picks| {
        sample.clear();
        for (stratum, picks) in strata.iter().zip(picks) {
            sample.extend(picks.iter().map(|pick| stratum[*pick]));
        }
        interquartile_mean(&sample)
    });
    let found = found.into_iter().flatten().collect();
    Some((interquartile_mean(&strata.concat())?, percentiles_95(found)))
}

/// The probability that a trial of `one` is better than one of `other`, averaged over the objects
/// that both explored; a tie is half.
pub fn improvement(one: &Contender, other: &Contender) -> Option<f64> {
    let shares: Vec<f64> = (one.scores.iter().zip(&other.scores))
        .filter(|(a, b)| !a.is_empty() && !b.is_empty())
        .map(|(a, b)| {
            let won = |x: f64, y: f64| if x == y { 0.5 } else { f64::from(u8::from(x < y)) };
            let wins: f64 = a.iter().map(|&x| b.iter().map(|&y| won(x, y)).sum::<f64>()).sum();
            wins / (a.len() * b.len()) as f64
        })
        .collect();
    (!shares.is_empty()).then(|| mean(&shares))
}

/// The share of trials, averaged over objects, with a score of at most `score`.
pub fn profile(contender: &Contender, score: f64) -> f64 {
    let strata = contender.scores.iter().filter(|scores| !scores.is_empty());
    let shares: Vec<f64> = strata
        .map(|scores| scores.iter().filter(|it| **it <= score).count() as f64 / scores.len() as f64)
        .collect();
    mean(&shares)
}
