//! What a suite of objects says of planners: errors over all objects, objects won and lost, and how
//! much of what could be gained a planner gains.

use super::compare::{Compared, Contender};
use crate::experiment::statistics::{mean, percentiles_95, resampled_within};
use crate::experiment::trial::entrant::ORACLE;

/// Who gains nothing; who gains all that can be is the [`ORACLE`].
pub const FLOOR: &str = "random";

/// Of the bootstraps.
const SEED: u64 = 0;

/// A number with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// The interval, of a bootstrap over trials, drawn within each object.
    pub interval: [f64; 2],
}

/// What is said of a contender.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// Its error in units of the reference's on each object.
    pub each: Vec<Option<Estimate>>,
    /// The same over all.
    pub over_all: Option<Estimate>,
    /// How much of the gap it closes on each object.
    pub gaps: Vec<Option<Estimate>>,
    /// The same over all.
    pub gap: Option<Estimate>,
}

/// Of every contender, in their order.
pub fn standings(compared: &Compared) -> Vec<Standing> {
    let all: Vec<usize> = (0..compared.objects.len()).collect();
    let of = |it: &Contender| {
        let strata: Vec<&[f64]> = it.scores.iter().map(Vec::as_slice).collect();
        let gap = |objects: &[usize]| gap_closed(compared, it, objects, SEED);
        Standing {
            each: strata.iter().map(|scores| geometric(&[scores], SEED)).collect(),
            over_all: geometric(&strata, SEED),
            gaps: all.iter().map(|object| gap(&[*object])).collect(),
            gap: gap(&all),
        }
    };
    compared.contenders.iter().map(of).collect()
}

/// Geometric mean of a contender's scores over the objects, each object counted once; none where it
/// lacks one of them, or there is none.
pub fn geometric(strata: &[&[f64]], seed: u64) -> Option<Estimate> {
    if strata.is_empty() || strata.iter().any(|scores| scores.is_empty()) {
        return None;
    }
    let logs: Vec<Vec<f64>> = strata.iter().map(|scores| logs(scores)).collect();
    let of = |picks: &[Vec<usize>]| mean_of_means(&logs, picks).exp();
    Some(estimate(&counts(&logs), seed, of))
}

/// Share of the way from [`FLOOR`] to the [`ORACLE`] that a contender comes, in log error averaged
/// over objects: (floor − contender) / (floor − ceiling). Trials are drawn together, for they are
/// of the same start. None where one of the three lacks an object of `objects`, has another number
/// of trials, or no way is left to go.
pub fn gap_closed(
    compared: &Compared,
    contender: &Contender,
    objects: &[usize],
    seed: u64,
) -> Option<Estimate> {
    let named = |name: &str| compared.contenders.iter().find(|it| it.name == name);
    let of = |it: &Contender| -> Vec<Vec<f64>> {
        objects.iter().map(|object| logs(&it.scores[*object])).collect()
    };
    let [floor, own, ceiling] = [of(named(FLOOR)?), of(contender), of(named(ORACLE)?)];
    let sizes = counts(&floor);
    if sizes.contains(&0) || counts(&own) != sizes || counts(&ceiling) != sizes {
        return None;
    }
    let share = |picks: &[Vec<usize>]| {
        let [floor, own, ceiling] = [&floor, &own, &ceiling].map(|it| mean_of_means(it, picks));
        (floor - own) / (floor - ceiling)
    };
    let found = estimate(&sizes, seed, share);
    (found.value.is_finite() && found.interval.iter().all(|end| end.is_finite())).then_some(found)
}

fn logs(scores: &[f64]) -> Vec<f64> {
    scores.iter().map(|score| score.ln()).collect()
}

fn counts(strata: &[Vec<f64>]) -> Vec<usize> {
    strata.iter().map(Vec::len).collect()
}

/// Of the picked trials of each stratum, their mean; the mean of these.
fn mean_of_means(strata: &[Vec<f64>], picks: &[Vec<usize>]) -> f64 {
    let means = strata.iter().zip(picks).map(|(values, picks)| {
        picks.iter().map(|pick| values[*pick]).sum::<f64>() / picks.len() as f64
    });
    mean(&means.collect::<Vec<_>>())
}

/// `of` all trials of strata of these sizes, and its interval.
fn estimate(sizes: &[usize], seed: u64, of: impl Fn(&[Vec<usize>]) -> f64) -> Estimate {
    let all: Vec<Vec<usize>> = sizes.iter().map(|size| (0..*size).collect()).collect();
    let found = resampled_within(sizes, (seed, "suite"), &of);
    Estimate { value: of(&all), interval: percentiles_95(found) }
}
