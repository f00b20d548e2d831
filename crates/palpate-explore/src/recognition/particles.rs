//! Sequential Monte Carlo over the poses of one object (Del Moral et al. 2006): each touch enters
//! at a falling temperature, and particles move by a preconditioned Langevin step (Girolami &
//! Calderhead 2011) on all evidence so far.

use super::library::LibraryObject;
use super::measurement::{LogLikelihood, MeasurementFit, log_sum_exp};
use super::model::{Model, Quadratic};
use super::pose_prior::moved;
use nalgebra::{Isometry3, Vector6};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// Effective number of particles that a step of the temperature keeps, over their wanted number.
// heuristic: usual for tempering.
const ESS: f64 = 0.5;

/// Poses drawn at first, over the wanted number: the first evidence finds the good ones among them.
// heuristic: a pose is looked for in half the steps along each of three directions.
const DRAWN_FIRST: usize = 8;

/// Moves of each particle after a resampling.
// heuristic: two, each with an acceptance of about a half, renew three quarters.
const MOVES: usize = 2;

/// Largest and smallest temperature, m: the size of a region and below any contact's deviation.
const TAU_M: [f64; 2] = [1.0, 1e-5];

/// Length of a Langevin step in units of the posterior's deviation.
// heuristic: near the optimal acceptance of 0.57 in six dimensions.
const STEP: f64 = 1.0;

/// Number of shorter moves, each half as long as the one before, while most particles are copies.
// heuristic: a rough posterior accepts few full steps.
const SHORTER: i32 = 4;

/// Number of poses among which an estimate is found, and the step between the points of its
/// distances; heuristics.
const ESTIMATED: usize = 24;
const POINT_STEP: usize = 8;

/// A pose with its residuals.
#[derive(Clone)]
pub(super) struct Particle {
    pub x_wo: Isometry3<f64>,
    pub fits: Vec<MeasurementFit>,
}

/// Posterior of one object's pose, and the evidence for the object.
#[derive(Clone)]
pub(super) struct Particles {
    particles: Vec<Particle>,
    /// Logarithms of the weights, normalised.
    log_weights: Vec<f64>,
    /// Number that remains after a resampling.
    wanted: usize,
    /// Logarithm of the likelihood ratio of all evidence, over the prior of the pose.
    pub log_evidence: f64,
}

impl Particles {
    /// Draws poses from the prior, evenly spread, of which `wanted` remain.
    pub fn new(model: &Model, wanted: usize, random: &mut impl Rng) -> Self {
        let count = wanted * DRAWN_FIRST;
        let poses = model.prior.spread(model.object, count as u32, random.next_u32());
        let particles = poses.map(|x_wo| Particle { x_wo, fits: Vec::new() }).collect();
        let log_weights = vec![-(count as f64).ln(); count];
        Self { particles, log_weights, wanted, log_evidence: 0.0 }
    }

    /// Creates particles from weighted poses: `logs` are the weights' logarithms, whose sum over
    /// the number of draws estimates the evidence.
    pub fn from_draws(
        model: &Model,
        (draws, logs): (Vec<Particle>, Vec<f64>),
        drawn: usize,
        wanted: usize,
        random: &mut impl Rng,
    ) -> Self {
        let sum = log_sum_exp(&logs);
        let log_weights = logs.iter().map(|log| log - sum).collect();
        let log_evidence = sum - (drawn as f64).ln();
        let mut made = Self { particles: draws, log_weights, wanted, log_evidence };
        if log_evidence.is_finite() {
            made.resample(random);
            let cold = (model.evidence.len(), 0.0);
            for _ in 0..MOVES {
                made.advance(model, cold, STEP, random);
            }
            made.separate(model, cold, random);
        }
        made
    }

    /// Returns the pose that explains the evidence best.
    pub fn likeliest(&self, model: &Model) -> Option<Isometry3<f64>> {
        let scored = self
            .particles
            .iter()
            .map(|particle| (model.log_likelihood(&particle.fits, 0.0), particle.x_wo));
        scored.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, x_wo)| x_wo)
    }

    /// Returns the poses and their weights.
    pub fn weighted(&self) -> impl Iterator<Item = (&Isometry3<f64>, f64)> {
        let weights = self.log_weights.iter().map(|log| log.exp());
        self.particles.iter().map(|particle| &particle.x_wo).zip(weights)
    }

    /// Returns the pose of `object` with the smallest expected distance of surfaces, and the
    /// distance that it exceeds with a probability of 5 %, m.
    pub fn central(&self, object: &LibraryObject) -> (Isometry3<f64>, f64) {
        let weighted: Vec<_> = self.weighted().collect();
        let drawn = systematic(weighted.iter().map(|it| it.1), ESTIMATED, 0.5);
        let poses: Vec<&Isometry3<f64>> = drawn.into_iter().map(|i| weighted[i].0).collect();
        let distance_m = |from, to| object.sampled_distance_m(to, from, POINT_STEP);
        let sum_m = |from| poses.iter().map(|to| distance_m(from, to)).sum::<f64>();
        let scored = poses.iter().map(|pose| (sum_m(*pose), **pose));
        let best = scored.min_by(|a, b| a.0.total_cmp(&b.0));
        let x_wo = best.map_or_else(Isometry3::identity, |(_, pose)| pose);
        // Over all particles, because the quantile is in the tail.
        let step = (weighted.len() / 128).max(1);
        let mut away: Vec<(f64, f64)> = (weighted.iter().step_by(step))
            .map(|(pose, weight)| (distance_m(&x_wo, *pose), *weight))
            .collect();
        away.sort_by(|a, b| a.0.total_cmp(&b.0));
        let whole: f64 = away.iter().map(|it| it.1).sum();
        let mut passed = 0.0;
        let within = away.iter().find(|(_, weight)| {
            passed += weight;
            passed >= 0.95 * whole
        });
        (x_wo, within.map_or(0.0, |it| it.0))
    }

    /// Takes in those of the model's evidence that is new; `wanted` poses remain after resampling.
    pub fn update(&mut self, model: &Model, wanted: usize, random: &mut impl Rng) {
        self.wanted = wanted;
        let known = self.particles.first().map_or(0, |particle| particle.fits.len());
        for particle in &mut self.particles {
            let (new, placed) = (model.evidence[known..].iter(), model.placed(&particle.x_wo));
            particle.fits.extend(new.map(|touch| touch.fit(&placed)));
        }
        let mut tau_m = f64::INFINITY;
        while tau_m > 0.0 {
            let before = self.logs(model, known, tau_m);
            let gains = |tau_m: f64| -> Vec<f64> {
                let after = self.logs(model, known, tau_m);
                after.iter().zip(&before).map(|(after, before)| after - before).collect()
            };
            let (next_m, gained) = self.next_temperature(tau_m, &gains);
            self.reweight(&gained);
            tau_m = next_m;
            if self.effective_share() < ESS * 1.5 || tau_m > 0.0 {
                self.resample(random);
                for _ in 0..MOVES {
                    self.advance(model, (known, tau_m), STEP, random);
                }
                self.separate(model, (known, tau_m), random);
            }
        }
    }

    /// Log-likelihood ratio of the evidence from number `known` on for each particle at a
    /// temperature; 0 at an infinite one.
    fn logs(&self, model: &Model, known: usize, tau_m: f64) -> Vec<f64> {
        let log = |particle: &Particle| {
            let mut sum = LogLikelihood::zero();
            if tau_m.is_finite() {
                let new = model.evidence.iter().zip(&particle.fits).skip(known);
                new.for_each(|(touch, fit)| touch.add(fit, &model.noise, tau_m, &mut sum));
            }
            sum.value
        };
        self.particles.iter().map(log).collect()
    }

    /// Returns the smallest temperature that keeps enough particles, and what they gain by it.
    fn next_temperature(&self, from_m: f64, gains: &impl Fn(f64) -> Vec<f64>) -> (f64, Vec<f64>) {
        let keeps = |gained: &[f64]| self.share_after(gained) >= ESS;
        let cold = gains(0.0);
        if keeps(&cold) {
            return (0.0, cold);
        }
        let [most_m, least_m] = TAU_M;
        let (mut high, mut low) = (from_m.min(most_m).ln(), least_m.ln());
        for _ in 0..10 {
            let middle = 0.5 * (high + low);
            match keeps(&gains(middle.exp())) {
                true => high = middle,
                false => low = middle,
            }
        }
        // At the smallest temperature the rest is one step.
        match high - least_m.ln() < 0.1 {
            true => (0.0, cold),
            false => (high.exp(), gains(high.exp())),
        }
    }

    /// Effective number of particles after a gain of their log-weights, over the wanted number.
    fn share_after(&self, gained: &[f64]) -> f64 {
        let logs = self.log_weights.iter().zip(gained).map(|(weight, gain)| weight + gain);
        let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
        let (sum, squares) = logs.fold((0.0, 0.0), |(sum, squares), log| {
            let weight = (log - most).exp();
            (sum + weight, squares + weight * weight)
        });
        sum * sum / squares / self.wanted as f64
    }

    fn effective_share(&self) -> f64 {
        self.share_after(&vec![0.0; self.particles.len()])
    }

    fn reweight(&mut self, gained: &[f64]) {
        self.log_weights.iter_mut().zip(gained).for_each(|(weight, gain)| *weight += gain);
        let sum = log_sum_exp(&self.log_weights);
        self.log_weights.iter_mut().for_each(|weight| *weight -= sum);
        self.log_evidence += sum;
    }

    /// Moves the particles by ever shorter steps while most are copies of others.
    fn separate(&mut self, model: &Model, known: (usize, f64), random: &mut impl Rng) {
        for halvings in 1..=SHORTER {
            // Copies are drawn one after the other.
            let moved = self.particles.array_windows().filter(|[a, b]| a.x_wo != b.x_wo).count();
            if 2 * moved >= self.particles.len() {
                return;
            }
            self.advance(model, known, STEP * 0.5f64.powi(halvings), random);
        }
    }

    /// Draws particles by their weights, systematically.
    fn resample(&mut self, random: &mut impl Rng) {
        let count = self.wanted;
        let drawn = systematic(self.weighted().map(|(_, weight)| weight), count, random.random());
        self.particles = drawn.into_iter().map(|i| self.particles[i].clone()).collect();
        self.log_weights = vec![-(count as f64).ln(); count];
    }

    /// Moves every particle by one step of this length with the posterior of the evidence from
    /// number `known` on at the temperature `tau_m` as its invariant.
    fn advance(
        &mut self,
        model: &Model,
        (known, tau_m): (usize, f64),
        length: f64,
        random: &mut impl Rng,
    ) {
        for particle in &mut self.particles {
            let normals = free_normals(model, random);
            let accepts: f64 = random.random();
            let here = model.quadratic(&particle.fits, known, tau_m);
            let step = drift(&here, length) + here.deviation(&normals) * length;
            let x_wo = moved(&particle.x_wo, &step);
            if !model.prior.contains(model.object, &x_wo) {
                continue;
            }
            let fits = model.fits(&x_wo);
            let there = model.quadratic(&fits, known, tau_m);
            let log_density = |from: &Quadratic, step: Vector6<f64>| {
                from.log_density(&(step - drift(from, length)), length, 0.0)
            };
            let log =
                there.value - here.value + log_density(&there, -step) - log_density(&here, step);
            if accepts.ln() < log {
                *particle = Particle { x_wo, fits };
            }
        }
    }
}

/// Mean of a Langevin step of this length.
fn drift(here: &Quadratic, length: f64) -> Vector6<f64> {
    here.to_peak * (0.5 * length * length)
}

/// Returns standard normal numbers along the directions in which a pose can change.
pub(super) fn free_normals(model: &Model, random: &mut impl Rng) -> Vector6<f64> {
    let free = model.prior.free();
    Vector6::from_fn(|i, _| if free[i] { StandardNormal.sample(random) } else { 0.0 })
}

/// Returns the numbers of `count` items drawn with these weights at equal steps from the offset
/// `start`, from 0 to 1.
pub(super) fn systematic(
    weights: impl Iterator<Item = f64>,
    count: usize,
    start: f64,
) -> Vec<usize> {
    let mut drawn = Vec::with_capacity(count);
    let mut passed = 0.0;
    let mut last = 0;
    for (i, weight) in weights.enumerate() {
        passed += weight * count as f64;
        while drawn.len() < count && drawn.len() as f64 + start < passed {
            drawn.push(i);
        }
        last = i;
    }
    // Rounding of the sum.
    drawn.resize(count, last);
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recognition::boxes::{NOISE, prior, touched_box, touches};
    use crate::recognition::library::PlacedObject;
    use crate::recognition::peaks;
    use nalgebra::Vector3;
    use palpate_gp::math::seed;

    /// The evidence of particles is the integral of the likelihood over the prior, and their mean
    /// is that of the posterior: a sum over a grid is the slow twin. So is that of draws around the
    /// peaks.
    #[test]
    fn particles_are_an_integral_over_the_prior() {
        let (object, prior, noise, touches) = (touched_box(), prior(), NOISE, touches());
        let per_side = 400;
        let (mut logs, mut means) = (Vec::new(), [0.0; 2]);
        for i in 0..per_side * per_side {
            let at = [i % per_side, i / per_side].map(|n| (n as f64 + 0.5) / per_side as f64);
            let x_wo = prior.at(&object, [at[0], at[1], 0.5, 0.0, 0.0, 0.0]);
            let mut sum = LogLikelihood::zero();
            for touch in &touches {
                touch.add(&touch.fit(&PlacedObject::exact(&object, &x_wo)), &noise, 0.0, &mut sum);
            }
            logs.push((sum.value, x_wo.translation.vector));
        }
        let values: Vec<f64> = logs.iter().map(|(value, _)| *value).collect();
        let total = log_sum_exp(&values);
        for (value, at) in &logs {
            let weight = (value - total).exp();
            means = [means[0] + weight * at.x, means[1] + weight * at.y];
        }
        let expected = total - (logs.len() as f64).ln();
        let model = |count: usize| Model {
            object: &object,
            prior: &prior,
            evidence: &touches[..count],
            noise,
            is_coarse: false,
        };
        let mut evidences = Vec::new();
        for number in 0..8 {
            let mut random = seed::stream(1, number, "particles");
            let mut particles = Particles::new(&model(0), 256, &mut random);
            // One after another, or both at once as in a restart.
            if number % 2 == 0 {
                particles.update(&model(1), 256, &mut random);
            }
            particles.update(&model(2), 256, &mut random);
            evidences.push(particles.log_evidence);
            let mean = particles.weighted().fold(Vector3::zeros(), |sum, (x_wo, weight)| {
                sum + x_wo.translation.vector * weight
            });
            assert!((mean.x - means[0]).abs() < 4e-4, "{mean} {means:?}");
            assert!((mean.y - means[1]).abs() < 4e-4, "{mean} {means:?}");
            let model = model(2);
            let starts = prior.spread(&object, 32, number as u32);
            let drawn = peaks::sample(&model, &peaks::find(&model, starts), 256, &mut random);
            assert!((drawn.log_evidence - expected).abs() < 0.3, "{}", drawn.log_evidence);
        }
        let mean = evidences.iter().sum::<f64>() / evidences.len() as f64;
        assert!((mean - expected).abs() < 0.2, "{evidences:?}, expected {expected}");
        assert!(evidences.iter().all(|it| (it - expected).abs() < 0.8), "{evidences:?}");
        assert!((means[0] - 0.003).abs() < 1e-3 && (means[1] - 0.002).abs() < 1e-3, "{means:?}");
    }

    #[test]
    fn systematic_draws_follow_the_weights() {
        let weights = [0.1, 0.0, 0.6, 0.3];
        for start in [0.0, 0.3, 0.999] {
            let drawn = systematic(weights.iter().copied(), 1000, start);
            let count = |of: usize| drawn.iter().filter(|i| **i == of).count() as f64;
            for (i, weight) in weights.iter().enumerate() {
                assert!((count(i) - 1000.0 * weight).abs() <= 1.0, "{i}: {}", count(i));
            }
        }
    }
}
