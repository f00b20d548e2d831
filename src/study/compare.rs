//! Comparison of planners over several runs: errors relative to one planner, objects won and lost,
//! share of the possible gain, and performance profiles, after rliable (Agarwal et al. 2021).
//!
//! An object is an experiment's name. The score of a trial is its error over the touches, exp(mean
//! log RMSE), divided by that of the reference planner in the same trial, so that objects of
//! different sizes count equally. Smaller is better; the reference has score 1.

use super::check::measures::mean_log_error;
use crate::experiment::metrics::silhouette::TENTHS;
use crate::experiment::planner_names::ORACLE;
use crate::experiment::row::{TouchRow, TrialRow, planner_rows};
use crate::experiment::statistics::equal_error::IntervalEstimate;
use crate::experiment::statistics::{RESAMPLES, central_95, mean};
use crate::experiment::store::Run;
use palpate_gp::math::seed;
use palpate_input::error::InputError;
use rand::RngExt;
use std::borrow::Borrow;
use std::collections::HashMap;

/// Planner with zero gain; the [`ORACLE`] has the full gain.
pub const BASELINE_PLANNER: &str = "random";

/// Results of planners on objects.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SuiteComparison {
    /// Reference planner.
    pub reference: String,
    /// Names of the objects.
    pub objects: Vec<String>,
    /// Compared planners.
    pub contenders: Vec<Entrant>,
}

/// A planner, with one run per object.
#[derive(Clone, Debug, PartialEq)]
pub struct Entrant {
    /// Name of the planner.
    pub name: String,
    /// Results on each object.
    pub results: Vec<ObjectResult>,
}

/// Results of a planner's finished trials on one object; empty if it did not explore it. Efforts
/// are counted after the initial touches, beliefs are rated after the last touch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjectResult {
    /// Scores of the trials that the reference finished, too.
    pub scores: Vec<f64>,
    /// Share of touches without contact.
    pub miss_share: Option<f64>,
    /// Share of fallback plans.
    pub fallback_share: Option<f64>,
    /// Mean lateral travel per trial.
    pub travel_m: Option<f64>,
    /// Mean share of the truth in the 95 % band.
    pub coverage: Option<f64>,
    /// Mean Brier score of the probability of a surface.
    pub brier: Option<f64>,
    /// Mean intersection over union of the silhouettes.
    pub iou: Option<f64>,
    /// Test points in each tenth of the probability of a surface, and those of them with a surface.
    pub reliability: [[u32; 2]; TENTHS],
}

impl Entrant {
    /// Scores on each object.
    pub fn scores(&self) -> Vec<&[f64]> {
        self.results.iter().map(|result| result.scores.as_slice()).collect()
    }
}

/// Compares runs, each with its folder's name, relative to the planner `against`.
///
/// # Errors
/// If the first run of an object lacks that planner, or runs of one name have different trials.
pub fn compare<R: Borrow<Run>>(
    runs: &[(String, R)],
    against: &str,
) -> Result<SuiteComparison, InputError> {
    let runs: Vec<(&str, &Run)> =
        runs.iter().map(|(folder, run)| (folder.as_str(), run.borrow())).collect();
    let mut objects: Vec<String> = Vec::new();
    let mut units: Vec<HashMap<u32, f64>> = Vec::new();
    let mut contenders: Vec<Entrant> = Vec::new();
    for &(folder, run) in &runs {
        let name = &run.experiment.name;
        let of_name = || runs.iter().filter(|(_, other)| other.experiment.name == *name);
        let pairing = |run: &Run| {
            let it = &run.experiment;
            (it.seed, it.initial_touches, it.touches, it.grid)
        };
        if let Some((first, _)) = of_name().find(|(_, other)| pairing(other) != pairing(run)) {
            let problem = format!(
                "{folder} and {first} are both \"{name}\" but differ in seed, touches or grid, so their \
                 trials do not pair"
            );
            return Err(InputError::new(problem));
        }
        let known = objects.iter().position(|object| object == name);
        let index = known.unwrap_or(objects.len());
        if known.is_none() {
            let unit = logs(run, against);
            if unit.is_empty() {
                let problem =
                    format!("has no trials of the reference planner \"{against}\" (--against)");
                return Err(InputError::new(problem).at(folder));
            }
            objects.push(name.clone());
            units.push(unit);
        }
        for planner in &run.experiment.planners {
            let label = match of_name().count() {
                1 => planner.clone(),
                _ => format!("{planner} ({folder})"),
            };
            let place = contenders.iter().position(|it| it.name == label).unwrap_or_else(|| {
                contenders.push(Entrant { name: label, results: Vec::new() });
                contenders.len() - 1
            });
            let results = &mut contenders[place].results;
            results.resize(objects.len(), ObjectResult::default());
            results[index] = result(run, planner, &units[index]);
        }
    }
    for contender in &mut contenders {
        contender.results.resize(objects.len(), ObjectResult::default());
    }
    Ok(SuiteComparison { reference: against.into(), objects, contenders })
}

/// Mean log RMSE of a planner's trials; a failed one counts with its last belief to the end.
fn logs(run: &Run, planner: &str) -> HashMap<u32, f64> {
    if !run.completed_planners().contains(&planner) {
        return HashMap::new();
    }
    planner_rows(&run.rows, planner)
        .filter_map(|row| Some((row.trial, mean_log_error(row, &run.experiment)?)))
        .collect()
}

/// Results of a planner relative to `unit`, the mean log RMSE of the reference's trials.
fn result(run: &Run, planner: &str, unit: &HashMap<u32, f64>) -> ObjectResult {
    let finished: Vec<&TrialRow> =
        planner_rows(&run.rows, planner).filter(|row| row.failure.is_none()).collect();
    let mut logs: Vec<(u32, f64)> = logs(run, planner).into_iter().collect();
    logs.sort_by_key(|(trial, _)| *trial);
    let score = |(trial, log): (u32, f64)| Some((log - unit.get(&trial)?).exp());
    let some_mean = |values: Vec<f64>| (!values.is_empty()).then(|| mean(&values));
    let at_end = |of: fn(&TouchRow) -> Option<f64>| {
        some_mean(finished.iter().filter_map(|row| row.touches.last().and_then(of)).collect())
    };
    let initial = run.experiment.initial_touches as usize;
    let planned = || finished.iter().flat_map(|row| row.touches.iter().skip(initial));
    let share = |is_counted: fn(&&TouchRow) -> bool| {
        let count = planned().filter(is_counted).count();
        (!finished.is_empty()).then(|| count as f64 / planned().count().max(1) as f64)
    };
    let travels = finished.iter().filter_map(|row| row.path_m(run.experiment.touches));
    let mut reliability = [[0; 2]; TENTHS];
    let outlines = finished.iter().filter_map(|row| row.touches.last()?.silhouette.as_ref());
    for counted in outlines.filter_map(|outline| outline.reliability) {
        for (sums, counts) in reliability.iter_mut().zip(counted) {
            sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        }
    }
    ObjectResult {
        scores: logs.into_iter().filter_map(score).collect(),
        miss_share: share(|touch| touch.is_miss()),
        fallback_share: share(|touch| touch.fallback.is_some()),
        travel_m: some_mean(travels.collect()),
        coverage: at_end(|touch| touch.metrics.as_ref()?.coverage),
        brier: at_end(|touch| Some(touch.silhouette.as_ref()?.brier)),
        iou: at_end(|touch| Some(touch.silhouette.as_ref()?.iou)),
        reliability,
    }
}

/// Mean of the middle half; `None` for an empty slice.
pub fn interquartile_mean(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let cut = sorted.len() / 4;
    let middle = &sorted[cut..sorted.len() - cut];
    (!middle.is_empty()).then(|| mean(middle))
}

/// Interquartile mean over all strata, with the 95 % interval of a bootstrap within each stratum;
/// `None` if a stratum is empty.
pub fn interquartile_mean_interval(strata: &[&[f64]], seed: u64) -> Option<IntervalEstimate> {
    if strata.is_empty() || strata.iter().any(|stratum| stratum.is_empty()) {
        return None;
    }
    let sizes: Vec<usize> = strata.iter().map(|stratum| stratum.len()).collect();
    let of = |picks: &[Vec<usize>]| {
        let picked = strata.iter().zip(picks);
        let sample = picked.flat_map(|(scores, picks)| picks.iter().map(|pick| scores[*pick]));
        interquartile_mean(&sample.collect::<Vec<_>>()).unwrap_or(f64::NAN)
    };
    Some(estimate(&sizes, seed, "compare", of))
}

/// Probability that a trial of `one` is better than one of `other`, averaged over the objects that
/// both explored; a tie counts half.
pub fn win_probability(one: &Entrant, other: &Entrant) -> Option<f64> {
    let shares: Vec<f64> = (one.scores().into_iter().zip(other.scores()))
        .filter(|(a, b)| !a.is_empty() && !b.is_empty())
        .map(|(a, b)| {
            let won = |x: f64, y: f64| if x == y { 0.5 } else { f64::from(u8::from(x < y)) };
            let wins: f64 = a.iter().map(|&x| b.iter().map(|&y| won(x, y)).sum::<f64>()).sum();
            wins / (a.len() * b.len()) as f64
        })
        .collect();
    (!shares.is_empty()).then(|| mean(&shares))
}

/// Share of trials with a score of at most `score`, averaged over objects.
pub fn profile(contender: &Entrant, score: f64) -> f64 {
    let strata = contender.scores().into_iter().filter(|scores| !scores.is_empty());
    let shares: Vec<f64> = strata
        .map(|scores| scores.iter().filter(|it| **it <= score).count() as f64 / scores.len() as f64)
        .collect();
    mean(&shares)
}

/// Geometric mean of scores over objects with equal weights, with the interval of a bootstrap over
/// trials within each object; `None` if an object has no score, or there is no object.
pub fn geometric_mean(strata: &[&[f64]], seed: u64) -> Option<IntervalEstimate> {
    if strata.is_empty() || strata.iter().any(|scores| scores.is_empty()) {
        return None;
    }
    let logs: Vec<Vec<f64>> = strata.iter().map(|scores| log_scores(scores)).collect();
    let of = |picks: &[Vec<usize>]| mean_of_means(&logs, picks).exp();
    Some(estimate(&counts(&logs), seed, "suite", of))
}

/// Share of the gap from [`BASELINE_PLANNER`] to the [`ORACLE`] that a planner closes, in log error
/// averaged over objects: (floor − contender) / (floor − ceiling). Trials of the same number are
/// drawn together because they share initial touches. `None` if one of the three lacks an object of
/// `objects` or has another number of trials, or if the gap is zero.
pub fn gap_closed(
    compared: &SuiteComparison,
    contender: &Entrant,
    objects: &[usize],
    seed: u64,
) -> Option<IntervalEstimate> {
    let named = |name: &str| compared.contenders.iter().find(|it| it.name == name);
    let of = |it: &Entrant| -> Vec<Vec<f64>> {
        objects.iter().map(|object| log_scores(&it.results[*object].scores)).collect()
    };
    let [floor, own, ceiling] = [of(named(BASELINE_PLANNER)?), of(contender), of(named(ORACLE)?)];
    let sizes = counts(&floor);
    if sizes.contains(&0) || counts(&own) != sizes || counts(&ceiling) != sizes {
        return None;
    }
    let share = |picks: &[Vec<usize>]| {
        let [floor, own, ceiling] = [&floor, &own, &ceiling].map(|it| mean_of_means(it, picks));
        (floor - own) / (floor - ceiling)
    };
    let found = estimate(&sizes, seed, "suite", share);
    let ends = found.interval.iter().flatten();
    ends.chain([&found.value]).all(|number| number.is_finite()).then_some(found)
}

fn log_scores(scores: &[f64]) -> Vec<f64> {
    scores.iter().map(|score| score.ln()).collect()
}

fn counts(strata: &[Vec<f64>]) -> Vec<usize> {
    strata.iter().map(Vec::len).collect()
}

/// Mean over strata of the means of their picked trials.
fn mean_of_means(strata: &[Vec<f64>], picks: &[Vec<usize>]) -> f64 {
    let means = strata.iter().zip(picks).map(|(values, picks)| {
        picks.iter().map(|pick| values[*pick]).sum::<f64>() / picks.len() as f64
    });
    mean(&means.collect::<Vec<_>>())
}

/// Statistic of all trials of strata of these sizes, with the 95 % interval of a bootstrap within
/// each stratum; deterministic for a `seed` and `purpose`.
pub(super) fn estimate(
    sizes: &[usize],
    seed: u64,
    purpose: &str,
    of: impl Fn(&[Vec<usize>]) -> f64,
) -> IntervalEstimate {
    let mut rng = seed::stream(seed, 0, purpose);
    let mut picks: Vec<Vec<usize>> = sizes.iter().map(|size| (0..*size).collect()).collect();
    let value = of(&picks);
    let found = (0..RESAMPLES).map(|_| {
        for (picks, size) in picks.iter_mut().zip(sizes) {
            picks.fill_with(|| rng.random_range(0..*size));
        }
        of(&picks)
    });
    IntervalEstimate { value, interval: Some(central_95(found.collect())) }
}

/// Shortens the names of a sweep's objects by the name of the sweep and the key of the scenes.
pub fn name_objects(compared: &mut SuiteComparison, sweep: &str) {
    for object in &mut compared.objects {
        let label = object.strip_prefix(sweep).unwrap_or(object);
        *object = label.trim_start_matches("-scene").trim_start_matches('-').to_owned();
    }
}
