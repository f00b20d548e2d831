//! Held-out touches, which need no ground truth: after a trial's last touch the belief predicts
//! further touches.

use crate::experiment::Experiment;
use crate::row::{TouchRow, TrialRow, VerificationRow};
use nalgebra::Point3;
use palpate_explore::belief::{Belief, HeightField, SurfaceBelief};
use palpate_explore::episode::Episode;
use palpate_explore::evidence::End;
use palpate_explore::planner::sample::target_from_fractions;
use palpate_explore::task::Target;
use palpate_gp::math::seed;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Makes the verification touches of a trial and the touches that repeat earlier ones, and writes
/// them to its row.
///
/// Their targets depend on the experiment's seed and the trial, not on the planner.
///
/// # Errors
/// The fault that ended them.
pub(super) fn verify(
    experiment: &Experiment,
    episode: &mut Episode,
    row: &mut TrialRow,
) -> Result<(), String> {
    let TrialRow { trial, touches, verification: rows, .. } = row;
    let mut stream = seed::stream(experiment.seed, (*trial).into(), "verification");
    let targets = new_targets(episode.belief(), experiment.verification_touches, &mut stream);
    let targets = targets.into_iter().map(|target| (target, None));
    let again = repeated(touches, experiment.repeat_touches);
    let again = again.into_iter().map(|at| (touches[at].target.clone(), Some(at)));
    for (target, again) in targets.chain(again) {
        let predicted = episode.belief().predict(&target);
        let Some((predicted, action)) = predicted.zip(episode.action(&target).ok()) else { break };
        let outcome = episode.probe().execute(&action);
        let outcome =
            outcome.map_err(|fault| format!("verification touch {}: {fault}", rows.len() + 1))?;
        let belief = episode.belief();
        let p_wc = outcome.contact().map(|contact| contact.p_wc);
        let error = p_wc.and_then(|p_wc| belief.distance_m(&p_wc, None));
        let first = again.and_then(|at| touches[at].contact());
        let before = error.zip(first.and_then(|first| belief.distance_m(&first, None)));
        rows.push(VerificationRow {
            target,
            repeats: again.map(|at| at as u32 + 1),
            predicted_m: predicted.mean_m,
            predicted_sd_m: predicted.sd_m,
            contact: p_wc.map(|p_wc| p_wc.coords.into()),
            overload: outcome.end == End::Overload,
            error_m: error.map(|error| error.mean_m),
            sd_m: error.map(|error| error.sd_m),
            band_m: p_wc.and_then(|p_wc| band_m(belief.height_field()?, &p_wc)),
            difference_m: before.map(|(now, before)| now.mean_m - before.mean_m),
        });
    }
    Ok(())
}

/// Ends of the 95 % band at the place of a point of `W`, relative to the mean; `None` before the
/// first fit.
fn band_m(field: &HeightField, p_w: &Point3<f64>) -> Option<[f64; 2]> {
    let place = field.zone().place(p_w);
    let mean_m = SurfaceBelief::predict(field, &place.clone().into())?.mean_m;
    let [ends_m] = field.bands_m(&[place])?[..] else { return None };
    Some(ends_m.map(|end_m| end_m - mean_m))
}

/// Returns `count` targets of a Halton sequence over the unit square, shifted by `random` (Cranley
/// and Patterson 1976).
fn new_targets(belief: &Belief, count: u32, random: &mut ChaCha8Rng) -> Vec<Target> {
    let (mut i, mut shifts) = (0, Vec::new());
    let mut next = |dimension: usize| {
        i += 1;
        shifts.resize_with(dimension, || random.random::<f64>());
        let axes = [2, 3].into_iter().zip(&shifts);
        axes.map(|(base, shift)| (radical_inverse(i, base) + shift).fract()).collect()
    };
    (0..count).map(|_| target_from_fractions(belief.surface(), &mut next)).collect()
}

/// Radical inverse of `i` in `base`: its digits mirrored at the radix point.
fn radical_inverse(mut i: u32, base: u32) -> f64 {
    let (mut inverse, mut digit) = (0.0, 1.0);
    while i > 0 {
        digit /= f64::from(base);
        inverse += f64::from(i % base) * digit;
        i /= base;
    }
    inverse
}

/// Returns `count` touches with contact, evenly spaced from the first to the last; repeats them in
/// turn if there are fewer.
fn repeated(touches: &[TouchRow], count: u32) -> Vec<usize> {
    let met: Vec<usize> = (0..touches.len()).filter(|&i| touches[i].contact().is_some()).collect();
    let count = count as usize;
    match met.len() {
        0 => Vec::new(),
        met_count if met_count < count => met.into_iter().cycle().take(count).collect(),
        met_count => (0..count).map(|i| met[i * met_count / count]).collect(),
    }
}
