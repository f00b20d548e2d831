//! Learning of the 95 % band: quantile regression over objects whose surface is known.
//!
//! Trials of each object give the features of the belief and the true height at test places after
//! several counts of touches. Each half-width minimises the pinball loss (Koenker & Bassett 1978)
//! at the probability 0.025; every object and count weighs the same. Learning without a fifth of
//! the objects shows the coverage of objects that the band has not seen.

use super::needs_zone;
use crate::experiment::planner_names::ORACLE;
use crate::experiment::sweep::sweep_cases;
use crate::experiment::trial::TrialEvent;
use crate::experiment::{Experiment, Simulation};
use anyhow::ensure;
use palpate_explore::band::{BandFeatures, COEFFICIENTS, LearnedBand, relative_width};
use palpate_gp::math::bfgs::{BfgsClimb, BfgsOptions};
use palpate_gp::math::optimize::Bounds;
use palpate_input::error::InputError;
use palpate_input::tables;
use rayon::prelude::*;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Touch counts after which beliefs are sampled, once there is a fit.
pub const COUNTS: [u32; 10] = [1, 2, 4, 7, 10, 15, 20, 30, 45, 60];

/// Smallest number of objects that a band is learned from.
// heuristic: one object of each fold, and one more.
const OBJECTS_MIN: usize = 6;

/// Step between the test places of a grid.
// heuristic: neighbouring errors are correlated, so that more places add little.
const PLACES_STEP: usize = 7;

/// Probability outside of each end of the band.
const TAIL: f64 = 0.025;

/// Probabilities at which the tail's exponent is fitted, and its candidates.
// heuristic: between the median and the band's end.
const TAILS: [f64; 3] = [0.05, 0.1, 0.25];
const EXPONENTS: std::ops::RangeInclusive<u32> = 10..=60;

/// Factor on the lower half-width, for objects that are unlike those learned from.
// heuristic: objects left out of the learning are then covered by 0.95, and with 1 by 0.92.
const UNSEEN: f64 = 1.7;

/// Number of parts of the objects of which each is left out once.
const FOLDS: usize = 5;

/// Bounds of all coefficients, and where their search begins.
const LOWER: [f64; COEFFICIENTS] = [-10.0; COEFFICIENTS];
const UPPER: [f64; COEFFICIENTS] = [10.0; COEFFICIENTS];
const START: [f64; COEFFICIENTS] = [0.7, 0.8, 0.0, 0.0, 0.0];
const OPTIONS: BfgsOptions =
    BfgsOptions { first_step: 0.01, gain: 0.0, relative_gain: 1e-9, budget: 200 };

/// Softness of the pinball loss, as a fraction of the standard deviation; a smooth loss has a
/// gradient.
// heuristic: far below a half-width.
const SOFTNESS: f64 = 0.1;

/// Weights of errors: 1 / (RMSE of object and count)^a / σ^b, so that large objects do not prevail,
/// nor the widest bands of each.
// heuristic: among five pairs with a + b = 1, the smallest interval score of objects left out.
const WEIGHT_EXPONENTS: [f64; 2] = [0.75, 0.25];

/// A test place of a belief, with the true height there.
#[derive(Clone, Debug)]
struct BandSample {
    /// Number of touches.
    count: u32,
    /// Whether the finger can touch the surface there.
    is_reachable: bool,
    /// True height above the datum, m.
    height_m: f64,
    /// Features of the belief.
    features: BandFeatures,
}

/// Samples of all trials of an object.
#[derive(Clone, Debug)]
struct ObjectSamples {
    /// Name of the object.
    object: String,
    /// Samples of its beliefs.
    samples: Vec<BandSample>,
}

/// Experiments and extent of the study.
pub struct BandSpec {
    /// Name of the experiments, which the band keeps.
    name: String,
    /// Experiments over zones of known objects, one per object.
    experiments: Vec<Experiment>,
    /// Trials per planner and object.
    trials: u32,
    /// Band that is tested; `None` to learn one.
    tested: Option<LearnedBand>,
}

/// Progress of the study.
pub enum BandProgress<'a> {
    /// A step of a preparation begins, or with `None` its last one has ended.
    Step(Option<&'a str>),
    /// A touch was made.
    Touch,
}

/// Band with its coverage.
pub struct BandResult {
    /// Learned band; `None` if one was tested.
    pub band: Option<LearnedBand>,
    /// Coverage of each object after each count of touches, by a band that was learned without the
    /// object, or by the tested one.
    pub coverage: Vec<BandCoverage>,
    /// Shares of the truth below the quantiles at [`LEVELS`] after counts of touches.
    pub reliability: Vec<(u32, [f64; LEVELS.len()])>,
}

/// Part of an experiment's file with a band.
#[derive(Serialize)]
struct BandFile<'a> {
    gp: BandTable<'a>,
}

#[derive(Serialize)]
struct BandTable<'a> {
    band: &'a LearnedBand,
}

impl BandSpec {
    /// Loads the experiment at `path` or, if it has a sweep, its cases; `trials` are those of each
    /// planner and object. With `is_test` the experiment's own band is tested.
    ///
    /// # Errors
    /// If the experiments have no zone, too few objects, no touches after a fit, or no band to
    /// test.
    pub fn load(path: &Path, sets: &[String], trials: u32, is_test: bool) -> anyhow::Result<Self> {
        let cases = sweep_cases(path)?;
        let experiments = match cases.is_empty() {
            true => vec![Experiment::load(path, sets)?],
            false => (cases.iter())
                .map(|case| Experiment::load_cell(path, case, sets))
                .collect::<Result<_, _>>()?,
        };
        for experiment in &experiments {
            needs_zone(&experiment.scene, path)?;
        }
        let name = path.display().to_string();
        ensure!(
            is_test || experiments.len() >= OBJECTS_MIN,
            "{name}: has {} objects; a band is learned from at least {OBJECTS_MIN}, listed in [sweep] scene",
            experiments.len()
        );
        let first = &experiments[0];
        let sampled = COUNTS.into_iter().find(|&count| count >= first.first_fit());
        let least = sampled.unwrap_or(COUNTS[0]);
        ensure!(
            sampled.is_some_and(|least| first.touches >= least),
            "{name}: touches = {}, of which {} are initial; allowed is at least {least}, with a fit after one of \
             the counts {COUNTS:?}",
            first.touches,
            first.first_fit(),
        );
        let tested = first.gp.band.learned().filter(|_| is_test).cloned();
        ensure!(
            !is_test || tested.is_some(),
            "{name}: gp.band has no half-widths to test; allowed is \"objects\" or a table of this command"
        );
        Ok(Self { name, experiments, trials, tested })
    }

    /// Number of touches of all trials.
    pub fn touches(&self) -> u64 {
        let of = |experiment: &Experiment| {
            planners(experiment).count() as u64 * u64::from(experiment.touches)
        };
        u64::from(self.trials) * self.experiments.iter().map(of).sum::<u64>()
    }
}

/// Planners of an experiment without the oracle.
fn planners(experiment: &Experiment) -> impl Iterator<Item = &String> {
    experiment.planners.iter().filter(|name| *name != ORACLE)
}

/// Learns the band from trials on all objects, or tests one; `None` if `stop` becomes true.
///
/// # Errors
/// If an experiment cannot be simulated, a planner is not available, or a trial ended early.
pub fn run(
    spec: BandSpec,
    stop: &AtomicBool,
    progress: &(dyn Fn(BandProgress) + Sync),
) -> anyhow::Result<Option<BandResult>> {
    let BandSpec { name, experiments, trials, tested } = spec;
    let mut objects = Vec::new();
    for experiment in experiments {
        let object = object_name(&experiment);
        let begin = |name: &str| progress(BandProgress::Step(Some(name)));
        let simulation = Simulation::new_with_progress(experiment, &begin);
        progress(BandProgress::Step(None));
        let simulation = simulation?;
        let jobs: Vec<(u32, &String)> = (0..trials)
            .flat_map(|trial| planners(simulation.experiment()).map(move |name| (trial, name)))
            .collect();
        let touched = || progress(BandProgress::Touch);
        let samples = (jobs.into_par_iter())
            .filter(|_| !stop.load(Ordering::Relaxed))
            .map(|(trial, name)| sample_trial(&simulation, name, trial, &touched))
            .collect::<Result<Vec<_>, _>>()?;
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        objects.push(ObjectSamples { object, samples: samples.concat() });
    }
    let all: Vec<&ObjectSamples> = objects.iter().collect();
    let learned_from = format!("{name}, {} objects", objects.len());
    let (band, bands) = match tested {
        Some(band) => (None, vec![band; objects.len()]),
        None => (Some(learn(&all, learned_from)), left_out_bands(&objects).unwrap_or_default()),
    };
    let covered = objects.iter().zip(&bands);
    let coverage = covered.flat_map(|(object, band)| coverage(object, band)).collect();
    Ok(Some(BandResult { band, coverage, reliability: reliability(&objects, &bands) }))
}

/// Returns the name of an experiment's object: that of its mesh, or of the experiment.
fn object_name(experiment: &Experiment) -> String {
    let mesh = experiment.scene.object.as_ref().and_then(|object| object.mesh.file_stem());
    mesh.map_or(experiment.name.clone(), |stem| stem.to_string_lossy().into_owned())
}

/// Returns a band as a part of an experiment's file, the contents of `band.toml`.
///
/// # Errors
/// If the band cannot be written as TOML.
pub fn file_text(band: &LearnedBand) -> anyhow::Result<String> {
    Ok(tables::text(&BandFile { gp: BandTable { band } })?)
}

/// Runs a trial of `planner` and returns its samples; empty without a known surface over a zone.
/// `tell` is called after each touch.
///
/// # Errors
/// If the planner is not available, or the trial ended early.
fn sample_trial(
    simulation: &Simulation,
    planner: &str,
    trial: u32,
    tell: &(dyn Fn() + Sync),
) -> Result<Vec<BandSample>, InputError> {
    let mut samples = Vec::new();
    let truth = simulation.truth();
    let known = truth.heights_m.iter().enumerate().step_by(PLACES_STEP);
    let known: Vec<(usize, f64)> = known.filter_map(|(i, height)| Some((i, (*height)?))).collect();
    let places: Vec<Vec<f64>> = known.iter().map(|(i, _)| truth.places[*i].clone()).collect();
    let failed = |reason: String| InputError::new(format!("trial {trial} of {planner}: {reason}"));
    let available = simulation.planner(planner);
    let available = available.ok_or_else(|| failed("this program has no such planner".into()))?;
    let mut probe = simulation.probe(trial).map_err(|fault| failed(fault.to_string()))?;
    let row = simulation.trial_with(&mut *probe, available, trial, &mut |event| {
        let TrialEvent::Finished(touch) = event else { return Ok(None) };
        tell();
        let Some(field) = touch.belief.height_field() else { return Ok(None) };
        let is_sampled =
            COUNTS.contains(&touch.count) && touch.count >= simulation.experiment().first_fit();
        let features = is_sampled.then(|| field.band_features(&places));
        let features = features.flatten().unwrap_or_default().into_iter().zip(&known);
        samples.extend(features.map(|(features, (i, height_m))| BandSample {
            count: touch.count,
            is_reachable: truth.is_reachable[*i],
            height_m: *height_m,
            features,
        }));
        Ok(None)
    });
    match row.failure {
        Some(reason) => Err(failed(reason)),
        None => Ok(samples),
    }
}

/// Learns the band from objects.
fn learn(objects: &[&ObjectSamples], learned_from: String) -> LearnedBand {
    let [mut below, above] = [0, 1].map(|side| half_width(objects, side));
    below[0] += UNSEEN.ln();
    let mut band = LearnedBand { learned_from: Cow::Owned(learned_from), below, above, tail: 1.0 };
    let losses = EXPONENTS.map(|twentieths| {
        let tail = f64::from(twentieths) / 20.0;
        (mean_pinball(objects, &LearnedBand { tail, ..band.clone() }), tail)
    });
    if let Some((_, tail)) = losses.min_by(|a, b| a.0.total_cmp(&b.0)) {
        band.tail = tail;
    }
    band
}

/// Regression sample of one side.
struct Row {
    features: [f64; COEFFICIENTS],
    /// Distance of the truth from the mean towards this side, m.
    away_m: f64,
    /// Largest possible distance, m.
    limit_m: f64,
    sd_m: f64,
    signal_sd: f64,
    /// Weight in the loss.
    weight: f64,
}

/// Returns the coefficients of the lower (0) or upper (1) half-width.
fn half_width(objects: &[&ObjectSamples], side: usize) -> [f64; COEFFICIENTS] {
    let rows: Vec<Row> = objects.iter().flat_map(|object| rows(object, side)).collect();
    let bounds = Bounds { lower: &LOWER, upper: &UPPER };
    let mut climb = BfgsClimb::new(bounds, &START, None, OPTIONS);
    while let Some(at) = climb.requested() {
        let (loss, gradient) = pinball(&rows, at);
        climb.observe(-loss, &gradient.map(|slope| -slope));
    }
    std::array::from_fn(|i| climb.best().x[i])
}

fn rows(object: &ObjectSamples, side: usize) -> Vec<Row> {
    let mut groups: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
    for sample in &object.samples {
        let group = groups.entry(sample.count).or_default();
        group.0 += 1.0;
        group.1 += (sample.height_m - sample.features.mean_m).powi(2);
    }
    let row = |sample: &BandSample| {
        let (count, squares) = groups[&sample.count];
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let at = &sample.features;
        let scales_m = [(squares / count).sqrt(), at.sd_m].map(|it| it.max(f64::MIN_POSITIVE));
        let powers = scales_m.iter().zip(WEIGHT_EXPONENTS).map(|(scale, power)| scale.powf(power));
        Row {
            features: at.features()[side],
            away_m: sign * (sample.height_m - at.mean_m),
            limit_m: sign * (at.limits_m[side] - at.mean_m),
            sd_m: at.sd_m,
            signal_sd: at.signal_sd,
            weight: 1.0 / (count * powers.product::<f64>()),
        }
    };
    object.samples.iter().map(row).collect()
}

/// Returns the smoothed pinball loss and its gradient.
fn pinball(rows: &[Row], coefficients: &[f64]) -> (f64, [f64; COEFFICIENTS]) {
    type Sum = (f64, [f64; COEFFICIENTS]);
    const ZERO: Sum = (0.0, [0.0; COEFFICIENTS]);
    let add = |(loss, mut gradient): Sum, row: &Row| -> Sum {
        let width_m = row.signal_sd * relative_width(coefficients, &row.features);
        let quantile_m = width_m.min(row.limit_m);
        let soft_m = SOFTNESS * row.sd_m;
        let steps = (row.away_m - quantile_m) / soft_m;
        let is_beyond = 1.0 / (1.0 + (-steps).exp());
        // The integral of the soft step is the soft positive part.
        let positive_m = soft_m * if steps > 30.0 { steps } else { steps.exp().ln_1p() };
        if width_m < row.limit_m {
            let slope = row.weight * (TAIL - is_beyond) * width_m;
            gradient.iter_mut().zip(&row.features).for_each(|(sum, it)| *sum += slope * it);
        }
        (loss + row.weight * (TAIL * quantile_m + positive_m), gradient)
    };
    let sum = |a: Sum, b: Sum| (a.0 + b.0, std::array::from_fn(|i| a.1[i] + b.1[i]));
    // Chunks of one size, so that the sum does not depend on the number of threads.
    let parts: Vec<Sum> = rows.par_chunks(4096).map(|rows| rows.iter().fold(ZERO, add)).collect();
    parts.into_iter().fold(ZERO, sum)
}

/// Mean pinball loss of a band at [`TAILS`] on both sides, every object and count the same.
fn mean_pinball(objects: &[&ObjectSamples], band: &LearnedBand) -> f64 {
    let losses = objects.par_iter().map(|object| {
        let weights: Vec<f64> = rows(object, 0).iter().map(|row| row.weight).collect();
        let loss = |(sample, weight): (&BandSample, &f64)| {
            let each = TAILS.iter().flat_map(|p| [*p, 1.0 - p]).map(|p| {
                let off_m = sample.height_m - band.quantile_m(&sample.features, p);
                off_m * if off_m < 0.0 { p - 1.0 } else { p }
            });
            weight * each.sum::<f64>()
        };
        object.samples.iter().zip(&weights).map(loss).sum::<f64>()
    });
    losses.collect::<Vec<f64>>().into_iter().sum()
}

/// Coverage of an object's surface by a 95 % band after a count of touches.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BandCoverage {
    /// Name of the object.
    pub object: String,
    /// Number of touches.
    pub touches: u32,
    /// Share of the surface within the band.
    pub coverage: f64,
    /// Share of the reachable surface within the band; `None` without one.
    pub reachable_coverage: Option<f64>,
    /// Mean interval score, m.
    pub interval_score_m: f64,
}

/// Returns the coverage of each object by `band` after each count.
fn coverage(object: &ObjectSamples, band: &LearnedBand) -> Vec<BandCoverage> {
    let of_count = |&touches: &u32| {
        let samples = object.samples.iter().filter(|sample| sample.count == touches);
        let (mut all, mut inside, mut reached, mut reached_inside, mut score_m) = (0, 0, 0, 0, 0.0);
        for BandSample { height_m, is_reachable, features, .. } in samples {
            let [low_m, high_m] = [TAIL, 1.0 - TAIL].map(|p| band.quantile_m(features, p));
            let is_inside = (low_m..=high_m).contains(height_m);
            let outside_m = (low_m - height_m).max(0.0) + (height_m - high_m).max(0.0);
            score_m += high_m - low_m + outside_m / TAIL;
            (all, inside) = (all + 1, inside + i32::from(is_inside));
            if *is_reachable {
                (reached, reached_inside) = (reached + 1, reached_inside + i32::from(is_inside));
            }
        }
        let share = |part: i32, of: i32| (of > 0).then(|| f64::from(part) / f64::from(of));
        Some(BandCoverage {
            object: object.object.clone(),
            touches,
            coverage: share(inside, all)?,
            reachable_coverage: share(reached_inside, reached),
            interval_score_m: score_m / f64::from(all),
        })
    };
    COUNTS.iter().filter_map(of_count).collect()
}

/// Returns the band learned without each object's fold, one per object; `None` with fewer than two
/// objects.
fn left_out_bands(objects: &[ObjectSamples]) -> Option<Vec<LearnedBand>> {
    let folds = FOLDS.min(objects.len());
    let without = |fold: usize| {
        let kept = objects.iter().enumerate().filter(|(i, _)| i % folds != fold);
        learn(&kept.map(|(_, object)| object).collect::<Vec<_>>(), String::new())
    };
    let bands: Vec<LearnedBand> = match folds {
        0 | 1 => return None,
        _ => (0..folds).map(without).collect(),
    };
    Some((0..objects.len()).map(|i| bands[i % folds].clone()).collect())
}

/// Probabilities of a reliability diagram.
pub const LEVELS: [f64; 11] = [0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.975, 0.99];

/// Returns, for each count of touches, the share of the truth below the quantile at each of
/// [`LEVELS`], every object the same. `bands` has one band for each object.
fn reliability(
    objects: &[ObjectSamples],
    bands: &[LearnedBand],
) -> Vec<(u32, [f64; LEVELS.len()])> {
    let of_object = |count: u32, object: &ObjectSamples, band: &LearnedBand| {
        let mut shares = [0.0; LEVELS.len()];
        let mut all = 0.0;
        for sample in object.samples.iter().filter(|sample| sample.count == count) {
            all += 1.0;
            for (share, p) in shares.iter_mut().zip(LEVELS) {
                let is_below = sample.height_m <= band.quantile_m(&sample.features, p);
                *share += f64::from(u8::from(is_below));
            }
        }
        (all > 0.0).then(|| shares.map(|share| share / all))
    };
    let of_count = |&count: &u32| {
        let each: Vec<[f64; LEVELS.len()]> = (objects.par_iter().zip(bands))
            .filter_map(|(object, band)| of_object(count, object, band))
            .collect();
        let number = each.len() as f64;
        (number > 0.0).then(|| {
            let mean = |i: usize| each.iter().map(|shares| shares[i]).sum::<f64>() / number;
            (count, std::array::from_fn(mean))
        })
    };
    COUNTS.iter().filter_map(of_count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_gp::math::seed;
    use rand::RngExt;

    /// Heights drawn from a known band give its coefficients back, and 95 % of them lie in it.
    #[test]
    fn a_known_band_is_learned() {
        let mut rng = seed::stream(1, 0, "band");
        let known = LearnedBand {
            learned_from: "".into(),
            below: [0.7, 0.5, -0.3, 0.2, 0.3],
            above: [0.8, 0.7, -0.2, 0.5, 0.15],
            tail: 1.3,
        };
        let mut sample = |i: usize| {
            let signal_sd = 0.02;
            let features = BandFeatures {
                mean_m: 0.02 * rng.random::<f64>(),
                sd_m: signal_sd * (-5.0 * rng.random::<f64>()).exp(),
                signal_sd,
                rise_m: 2.0 * signal_sd * rng.random::<f64>(),
                contacts_m: [-0.01, 0.03],
                contacts: [7, 15, 30, 60][i % 4],
                limits_m: [-1.0, 1.0],
            };
            let height_m = known.quantile_m(&features, rng.random());
            let count = features.contacts as u32;
            BandSample { count, is_reachable: true, height_m, features }
        };
        let object = ObjectSamples {
            object: "known".into(),
            samples: (0..40_000).map(&mut sample).collect(),
        };
        let found = learn(&[&object], String::new());
        let below = [found.below[0] - UNSEEN.ln(), found.below[1], found.below[2]];
        let pairs = below.iter().zip(&known.below).chain(found.above.iter().zip(&known.above));
        for (found, known) in pairs {
            assert!((found - known).abs() < 0.1, "{found} {known}");
        }
        for at in coverage(&object, &known) {
            assert!((at.coverage - 0.95).abs() < 0.01, "{at:?}");
        }
        for (_, shares) in reliability(std::slice::from_ref(&object), &[known]) {
            assert!(shares.iter().zip(LEVELS).all(|(share, p)| (share - p).abs() < 0.02));
        }
    }
}
