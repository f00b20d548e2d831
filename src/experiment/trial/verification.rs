//! Held-out touches, which need no ground truth: after a trial's last touch the belief predicts
//! further touches.

use crate::experiment::experiment::Experiment;
use crate::experiment::trial::row::{TouchRow, TrialRow, VerificationRow};
use nalgebra::Point3;
use palpate_explore::belief::{Belief, HeightField, SurfaceBelief};
use palpate_explore::evidence::End;
use palpate_explore::planner::sample::target_from_fractions;
use palpate_explore::probe::Probe;
use palpate_explore::task::{Target, Task};
use palpate_explore::whole_object::surface::steepness;
use palpate_gp::math::seed;
use palpate_gp::posterior::Scratch;
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
    task: &Task,
    belief: &Belief,
    probe: &mut dyn Probe,
    row: &mut TrialRow,
) -> Result<(), String> {
    let TrialRow { trial, touches, verification: rows, .. } = row;
    let mut stream = seed::stream(experiment.seed, (*trial).into(), "verification");
    let targets = new_targets(belief, experiment.verification_touches, &mut stream);
    let targets = targets.into_iter().map(|target| (target, None));
    let again = repeated(touches, experiment.repeat_touches);
    let again = again.into_iter().map(|at| (touches[at].target.clone(), Some(at)));
    for (target, again) in targets.chain(again) {
        let predicted = predicted(belief, &target);
        let Some(((predicted_m, predicted_sd_m), approach)) = predicted.zip(task.approach(&target))
        else {
            break;
        };
        let outcome = probe.touch(&approach);
        let outcome =
            outcome.map_err(|fault| format!("verification touch {}: {fault}", rows.len() + 1))?;
        let p_wc = outcome.contact().map(|contact| contact.p_wc);
        let error = p_wc.and_then(|p_wc| signed_distance(belief, &p_wc));
        let first = again.and_then(|at| touches[at].contact());
        let before = error.zip(first.and_then(|first| signed_distance(belief, &first)));
        rows.push(VerificationRow {
            target,
            repeats: again.map(|at| at as u32 + 1),
            predicted_m,
            predicted_sd_m,
            contact: p_wc.map(|p_wc| p_wc.coords.into()),
            overload: outcome.end == End::Overload,
            error_m: error.map(|(error_m, _)| error_m),
            sd_m: error.map(|(_, sd_m)| sd_m),
            band_m: p_wc.and_then(|p_wc| band_m(belief.height_field()?, &p_wc)),
            difference_m: before.map(|((now_m, _), (before_m, _))| now_m - before_m),
        });
    }
    Ok(())
}

/// Predicted height at a place of a zone and the standard deviation of a touch; `None` before the
/// first fit.
fn height(field: &HeightField, place: &[f64]) -> Option<(f64, f64)> {
    let surface = field.surface()?;
    let mut scratch = Scratch::default();
    let noise_sd = surface.hyperparameters().noise_sd;
    let variance = surface.variance(place, &mut scratch) + noise_sd * noise_sd;
    Some((surface.mean(place, &mut scratch), variance.max(0.0).sqrt()))
}

/// Ends of the 95 % band at the place of a point of `W`, relative to the mean; `None` before the
/// first fit.
fn band_m(field: &HeightField, p_w: &Point3<f64>) -> Option<[f64; 2]> {
    let place = field.zone().place(p_w);
    let (mean_m, _) = height(field, &place)?;
    let [ends_m] = field.bands_m(&[place])?[..] else { return None };
    Some(ends_m.map(|end_m| end_m - mean_m))
}

/// Distance of a point of `W` outside the estimated surface and the standard deviation of a touch;
/// `None` before the first fit.
fn signed_distance(belief: &Belief, p_w: &Point3<f64>) -> Option<(f64, f64)> {
    match belief.surface() {
        SurfaceBelief::HeightField(field) => {
            let (mean_m, sd_m) = height(field, &field.zone().place(p_w))?;
            Some((field.zone().height_m(p_w) - mean_m, sd_m))
        }
        SurfaceBelief::ImplicitSurface(surface) => {
            let surface = surface.surface()?;
            let sd = surface.sds_m(&[*p_w]).first().copied()?;
            let noise_sd = surface.posterior().hyperparameters().noise_sd;
            let field = surface.field(p_w);
            let per_m = steepness(&field.gradient);
            Some((field.value / per_m, sd.hypot(noise_sd) / per_m))
        }
    }
}

/// Returns the predicted contact of a touch at `target` with its standard deviation. At a place it
/// is the height; around an object the distance before the aimed point, or 0 with the ball's radius
/// as deviation if no contact is predicted.
fn predicted(belief: &Belief, target: &Target) -> Option<(f64, f64)> {
    match belief.surface() {
        SurfaceBelief::HeightField(field) => height(field, target.place()?),
        SurfaceBelief::ImplicitSurface(surface) => {
            let (aim, ball) = (target.aim()?, &surface.scope().ball);
            let surface = surface.surface()?;
            let at = |along_m: f64| aim.p_w + aim.direction_w.scale(along_m);
            let [from_m, to_m] = ball.chord_m(aim);
            let along_m = first_zero([from_m, to_m], |along_m| surface.value(&at(along_m)));
            Some(match along_m {
                Some(along_m) => (-along_m, signed_distance(belief, &at(along_m))?.1),
                None => (0.0, ball.radius_m),
            })
        }
    }
}

/// Steps of the search for the surface along a path, and bisections of the step that contains it.
// heuristic: a twentieth of the ball's radius, then a millionth of that.
const STEPS: usize = 40;
const HALVINGS: usize = 20;

/// Returns the first argument between two bounds at which a function becomes negative.
fn first_zero([from, to]: [f64; 2], mut value: impl FnMut(f64) -> f64) -> Option<f64> {
    let at = |i: usize| from + (to - from) * i as f64 / STEPS as f64;
    let entered = (1..=STEPS).find(|&i| value(at(i)) < 0.0)?;
    let (mut low, mut high) = (at(entered - 1), at(entered));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        *(if value(middle) < 0.0 { &mut high } else { &mut low }) = middle;
    }
    Some(high)
}

/// Returns `count` targets of a Halton sequence over the unit square, shifted by `random` (Cranley
/// and Patterson 1976).
fn new_targets(belief: &Belief, count: u32, random: &mut ChaCha8Rng) -> Vec<Target> {
    let dimension = belief.height_field().map_or(2, |field| field.zone().dimension());
    let shifts: Vec<f64> = (0..dimension).map(|_| random.random()).collect();
    let mut i = 0;
    let mut next = |_| {
        i += 1;
        let axes = [2, 3].into_iter().zip(&shifts);
        axes.map(|(base, shift)| (radical_inverse(i, base) + shift).fract()).collect()
    };
    (0..count).map(|_| target_from_fractions(belief, &mut next)).collect()
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
