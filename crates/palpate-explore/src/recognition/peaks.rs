//! Peaks of an object's posterior over its pose, climbed from several starts: ICP (Chen & Medioni
//! 1992) whose outliers, normals and free space are those of the likelihood. They show a pose that
//! particles have missed, and are the proposal of importance sampling that finds posterior and
//! evidence anew: a mixture of Laplace's approximations, each also with wider tails (Hesterberg
//! 1995).

use super::library::Nearest;
use super::measurement::{LEVER_M, log_sum_exp};
use super::model::{Model, Quadratic};
use super::particles::{Particle, Particles, free_normals, systematic};
use super::pose_prior::{PosePrior, motion, moved};
use nalgebra::{Isometry3, Vector6};
use rand::{Rng, RngExt};
use std::f64::consts::{PI, TAU};

/// Temperatures of a climb, m, before the last steps at none.
// heuristic: from half the height of a detail to a contact's deviation.
const CLIMB_M: [f64; 5] = [8e-3, 4e-3, 2e-3, 1e-3, 5e-4];

/// Number of these at which the grid of distances suffices.
// heuristic: its cells are some millimetres.
const COARSE: usize = 3;

/// Last steps of a climb, their halvings, and the gain below which they end, nats; heuristics.
const STEPS: usize = 6;
const HALVINGS: i32 = 3;
const SETTLED: f64 = 0.01;

/// Number of starts that are compared by all evidence, beside the contacts.
// heuristic: several for each climb; a sweep of the finger costs four times a distance.
const PROMISING: usize = 64;

/// Number of climbs, and the distance of their starts from each other, m; a turn counts by its way
/// on the surface.
// heuristic: an object looks alike at a few poses, and a climb begins with 8 mm.
const CLIMBS: usize = 8;
const APART_M: f64 = 0.005;

/// Deviations of the proposal over those of the approximation, half of the draws each.
// heuristic: edges bend the posterior, so that it has wider tails.
const WIDER: [f64; 2] = [1.0, 3.0];

/// Share of the draws that all peaks have alike.
// heuristic: an approximation may miss by more than a nat.
const EVENLY: f64 = 0.25;

/// Peak of a posterior with its approximation.
pub(super) struct Peak {
    pub x_wo: Isometry3<f64>,
    quadratic: Quadratic,
    /// Logarithm of its integral over the prior, by Laplace's approximation.
    log_mass: f64,
}

/// Returns the logarithm of the integral over all peaks.
pub(super) fn log_mass(peaks: &[Peak]) -> f64 {
    log_sum_exp(&peaks.iter().map(|peak| peak.log_mass).collect::<Vec<_>>())
}

/// Returns the peaks that the most promising starts lead to.
pub(super) fn find(model: &Model, starts: impl Iterator<Item = Isometry3<f64>>) -> Vec<Peak> {
    let coarse = Model { is_coarse: true, ..*model };
    let score = |x_wo: &Isometry3<f64>| coarse.log_likelihood(&coarse.fits(x_wo), CLIMB_M[0]);
    let starts = starts.map(|x_wo| model.prior.clamped(model.object, x_wo));
    let promising = promising(model, starts.collect());
    let mut scored: Vec<_> = promising.into_iter().map(|x_wo| (score(&x_wo), x_wo)).collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<Isometry3<f64>> = Vec::new();
    for (_, x_wo) in scored {
        if chosen.len() < CLIMBS && chosen.iter().all(|other| distance_m(other, &x_wo) > APART_M) {
            chosen.push(x_wo);
        }
    }
    let mut peaks: Vec<Peak> = Vec::new();
    for peak in chosen.iter().map(|start| climb(model, start)) {
        // Climbs that meet count once.
        let is_same = |other: &Peak| {
            let by = motion(&other.x_wo, &peak.x_wo);
            other.quadratic.distance_squared(&by) < 1.0
        };
        match peaks.iter_mut().find(|other| is_same(other)) {
            Some(other) if other.log_mass < peak.log_mass => *other = peak,
            Some(_) => {}
            None => peaks.push(peak),
        }
    }
    peaks.sort_by(|a, b| b.log_mass.total_cmp(&a.log_mass));
    peaks
}

/// Returns those starts at which the contacts lie best on the object; all before a contact.
fn promising(model: &Model, starts: Vec<Isometry3<f64>>) -> Vec<Isometry3<f64>> {
    let contacts: Vec<_> = model.evidence.iter().flat_map(|it| it.touched_w()).collect();
    if contacts.is_empty() {
        return starts;
    }
    let (most_m, coarse) = (2.0 * CLIMB_M[0], Model { is_coarse: true, ..*model });
    let off_m2 = |x_wo: &Isometry3<f64>| -> f64 {
        let each = contacts.iter().map(|(p_w, normal_w)| {
            let Nearest { face_w, distance_m, .. } = coarse.placed(x_wo).nearest(p_w);
            // Near a thin part, the nearest face is often the one behind.
            let turned_m = normal_w.map_or(0.0, |to_w| LEVER_M * (face_w - to_w).norm());
            distance_m.powi(2) + turned_m.min(most_m).powi(2)
        });
        each.sum()
    };
    let mut scored: Vec<_> = starts.into_iter().map(|x_wo| (off_m2(&x_wo), x_wo)).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    scored.into_iter().take(PROMISING).map(|(_, x_wo)| x_wo).collect()
}

fn distance_m(from: &Isometry3<f64>, to: &Isometry3<f64>) -> f64 {
    let by = motion(from, to);
    by.fixed_rows::<3>(0).norm() + LEVER_M * by.fixed_rows::<3>(3).norm()
}

/// Climbs at a falling temperature.
fn climb(model: &Model, start: &Isometry3<f64>) -> Peak {
    let mut x_wo = *start;
    let after = |x_wo: &Isometry3<f64>, by: &Vector6<f64>| {
        model.prior.clamped(model.object, moved(x_wo, by))
    };
    for (number, tau_m) in CLIMB_M.into_iter().enumerate() {
        let model = Model { is_coarse: model.is_coarse || number < COARSE, ..*model };
        let quadratic = model.quadratic(&model.fits(&x_wo), 0, tau_m);
        x_wo = after(&x_wo, &quadratic.to_peak);
    }
    let at = |x_wo: &Isometry3<f64>| model.quadratic(&model.fits(x_wo), 0, 0.0);
    let mut quadratic = at(&x_wo);
    for _ in 0..STEPS {
        let higher = (0..=HALVINGS).find_map(|halvings| {
            let to = after(&x_wo, &(quadratic.to_peak * 0.5f64.powi(halvings)));
            Some((to, at(&to))).filter(|(_, there)| there.value > quadratic.value)
        });
        let Some((to, there)) = higher else { break };
        let gained = there.value - quadratic.value;
        (x_wo, quadratic) = (to, there);
        if gained < SETTLED {
            break;
        }
    }
    let log_volume = 0.5 * free(model.prior) * TAU.ln() - quadratic.log_determinant();
    let log_mass = quadratic.value + model.prior.log_density() + log_volume;
    Peak { x_wo, quadratic, log_mass }
}

/// Number of directions in which a pose can change.
fn free(prior: &PosePrior) -> f64 {
    prior.free().into_iter().filter(|is_free| *is_free).count() as f64
}

/// Draws particles around peaks; their evidence is that of all poses by importance sampling.
pub(super) fn sample(
    model: &Model,
    peaks: &[Peak],
    wanted: usize,
    random: &mut impl Rng,
) -> Particles {
    let (free, count) = (free(model.prior), wanted * WIDER.len());
    let total = log_mass(peaks);
    let even = EVENLY / peaks.len() as f64;
    let shares: Vec<f64> =
        peaks.iter().map(|peak| even + (1.0 - EVENLY) * (peak.log_mass - total).exp()).collect();
    let log_proposal = |x_wo: &Isometry3<f64>| {
        let each = peaks.iter().zip(&shares).flat_map(|(peak, share)| {
            let by = motion(&peak.x_wo, x_wo);
            let log = (share / WIDER.len() as f64).ln() - model.prior.log_volume(&by);
            WIDER.map(|wider| log + peak.quadratic.log_density(&by, wider, free))
        });
        log_sum_exp(&each.collect::<Vec<_>>())
    };
    let (mut draws, mut logs) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for wider in WIDER {
        for of in systematic(shares.iter().copied(), wanted, random.random()) {
            let by = peaks[of].quadratic.deviation(&free_normals(model, random)) * wider;
            let x_wo = moved(&peaks[of].x_wo, &by);
            // Draws outside of the prior have no weight, and those of more than half a turn would
            // be others.
            let is_turned = by.fixed_rows::<3>(3).norm() > PI;
            if is_turned || !model.prior.contains(model.object, &x_wo) {
                continue;
            }
            let fits = model.fits(&x_wo);
            let log = model.log_likelihood(&fits, 0.0) + model.prior.log_density();
            logs.push(log - log_proposal(&x_wo));
            draws.push(Particle { x_wo, fits });
        }
    }
    Particles::from_draws(model, (draws, logs), count, wanted, random)
}
