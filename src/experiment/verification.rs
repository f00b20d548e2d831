//! Touches that need no truth: after a trial's last touch the belief says what it expects, and is
//! held against what the finger then meets.

use super::experiment::Experiment;
use super::row::TouchRow;
use super::verification_row::VerificationRow;
use crate::explore::belief::HeightField;
use crate::explore::probe::{Probe, Touch};
use crate::gp::posterior::Scratch;
use crate::math::seed;
use crate::task::{Task, Zone};
use nalgebra::Point3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Makes the verification touches of `trial`, then those that repeat an earlier one; what was made
/// of them, and why there are no more, if a fault ended them.
///
/// Their places depend on the experiment's seed and the trial, not on the planner.
pub fn verify(
    experiment: &Experiment,
    task: &Task,
    belief: &HeightField,
    probe: &mut dyn Probe,
    (touches, trial): (&[TouchRow], u32),
) -> (Vec<VerificationRow>, Option<String>) {
    let mut rows = Vec::new();
    let mut stream = seed::stream(experiment.seed, trial.into(), "verification");
    let zone = task.zone();
    let places = new_places(zone, experiment.verification_touches, &mut stream);
    let places = places.into_iter().map(|target| (target, None));
    let again = repeated(touches, experiment.repeat_touches);
    let again = again.into_iter().map(|at| (touches[at].target.clone(), Some(at)));
    for (target, again) in places.chain(again) {
        let Some(mut row) = predicted(belief, target) else { break };
        let touch = match probe.touch(&task.approach(&row.target)) {
            Ok(touch) => touch,
            Err(fault) => {
                let failure = format!("verification touch {}: {fault}", rows.len() + 1);
                return (rows, Some(failure));
            }
        };
        row.again = again.map(|at| at as u32 + 1);
        row.overload = touch == Touch::Overload;
        if let Touch::Contact(contact) = &touch {
            let first = again.and_then(|at| touches[at].contact).map(Point3::from);
            meet(&mut row, zone, belief, (&contact.p_wc, first.as_ref()));
        }
        rows.push(row);
    }
    (rows, None)
}

/// What the belief expects at a place, with the deviation of a touch; none before its first fit.
fn expected(belief: &HeightField, place: &[f64]) -> Option<(f64, f64)> {
    let surface = belief.surface()?;
    let mut scratch = Scratch::default();
    let noise_sd = surface.hyperparameters().noise_sd;
    let variance = surface.variance(place, &mut scratch) + noise_sd * noise_sd;
    Some((surface.mean(place, &mut scratch), variance.max(0.0).sqrt()))
}

fn predicted(belief: &HeightField, target: Vec<f64>) -> Option<VerificationRow> {
    let (predicted_m, predicted_sd_m) = expected(belief, &target)?;
    Some(VerificationRow {
        target,
        again: None,
        predicted_m,
        predicted_sd_m,
        contact: None,
        overload: false,
        error_m: None,
        sd_m: None,
        difference_m: None,
    })
}

/// Writes what was met into `row`; `first` is the contact that it repeats.
fn meet(
    row: &mut VerificationRow,
    zone: &Zone,
    belief: &HeightField,
    (p_wc, first): (&Point3<f64>, Option<&Point3<f64>>),
) {
    let rise = |p_w: &Point3<f64>| {
        let (mean_m, sd_m) = expected(belief, &zone.place(p_w))?;
        Some((zone.height_m(p_w) - mean_m, sd_m))
    };
    row.contact = Some(p_wc.coords.into());
    let error = rise(p_wc);
    row.error_m = error.map(|(error_m, _)| error_m);
    row.sd_m = error.map(|(_, sd_m)| sd_m);
    let before = first.and_then(rise);
    row.difference_m = error.zip(before).map(|((now_m, _), (before_m, _))| now_m - before_m);
}

/// `count` places of a Halton sequence over the zone, shifted by `random` (Cranley and Patterson
/// 1976).
fn new_places(zone: &Zone, count: u32, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let shifts: Vec<f64> = (0..zone.dimension()).map(|_| random.random()).collect();
    let place = |i: u32| {
        let axes = [2, 3].into_iter().zip(&shifts);
        let fractions: Vec<f64> =
            axes.map(|(base, shift)| (radical_inverse(i, base) + shift).fract()).collect();
        zone.at(&fractions)
    };
    (1..=count).map(place).collect()
}

/// The digits of `i` in `base`, mirrored behind the point.
fn radical_inverse(mut i: u32, base: u32) -> f64 {
    let (mut inverse, mut digit) = (0.0, 1.0);
    while i > 0 {
        digit /= f64::from(base);
        inverse += f64::from(i % base) * digit;
        i /= base;
    }
    inverse
}

/// `count` of the touches that met something, evenly from the first to the last; all of them, one
/// after the other, if there are fewer.
fn repeated(touches: &[TouchRow], count: u32) -> Vec<usize> {
    let met: Vec<usize> = (0..touches.len()).filter(|&i| touches[i].contact.is_some()).collect();
    let count = count as usize;
    match met.len() {
        0 => Vec::new(),
        met_count if met_count < count => met.into_iter().cycle().take(count).collect(),
        met_count => (0..count).map(|i| met[i * met_count / count]).collect(),
    }
}
