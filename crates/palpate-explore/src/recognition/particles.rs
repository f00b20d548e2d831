//! Sequential Monte Carlo over the poses of one object (Del Moral et al. 2006): each touch enters
//! at a falling temperature, and particles move by a preconditioned Langevin step (Girolami &
//! Calderhead 2011) on all evidence so far.

use super::library::LibraryObject;
use super::measurement::{LogLikelihood, Measurement, MeasurementFit, NoiseModel};
use super::pose_prior::{PosePrior, moved};
use nalgebra::{Cholesky, Const, Isometry3, Matrix6, Vector6};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use std::sync::Arc;

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

/// A pose with its residuals.
#[derive(Clone)]
struct Particle {
    x_wo: Isometry3<f64>,
    fits: Vec<MeasurementFit>,
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

/// Object, prior and data that particles share.
pub(super) struct Model<'a> {
    pub object: &'a LibraryObject,
    pub prior: &'a PosePrior,
    pub evidence: &'a [Arc<Measurement>],
    pub noise: NoiseModel,
}

impl Particles {
    /// Draws poses from the prior, evenly spread, of which `wanted` remain.
    pub fn new(model: &Model, wanted: usize, random: &mut impl Rng) -> Self {
        let count = wanted * DRAWN_FIRST;
        let seed = random.next_u32();
        let pose = |i: usize| {
            let number = |axis| f64::from(sobol_burley::sample(i as u32, axis, seed));
            model.prior.at(model.object, std::array::from_fn(|axis| number(axis as u32)))
        };
        let particles = (0..count).map(|i| Particle { x_wo: pose(i), fits: Vec::new() }).collect();
        let log_weights = vec![-(count as f64).ln(); count];
        Self { particles, log_weights, wanted, log_evidence: 0.0 }
    }

    /// Returns the poses and their weights.
    pub fn weighted(&self) -> impl Iterator<Item = (&Isometry3<f64>, f64)> {
        let weights = self.log_weights.iter().map(|log| log.exp());
        self.particles.iter().map(|particle| &particle.x_wo).zip(weights)
    }

    /// Takes in those of the model's evidence that is new.
    pub fn update(&mut self, model: &Model, random: &mut impl Rng) {
        let known = self.particles.first().map_or(0, |particle| particle.fits.len());
        for particle in &mut self.particles {
            let new = model.evidence[known..].iter();
            particle.fits.extend(new.map(|touch| touch.fit(model.object, &particle.x_wo)));
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
                    self.advance(model, known, tau_m, random);
                }
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

    /// Draws particles by their weights, systematically.
    fn resample(&mut self, random: &mut impl Rng) {
        let count = self.wanted;
        let drawn = systematic(self.weighted().map(|(_, weight)| weight), count, random.random());
        self.particles = drawn.into_iter().map(|i| self.particles[i].clone()).collect();
        self.log_weights = vec![-(count as f64).ln(); count];
    }

    /// Moves every particle by one step with the posterior at the temperature as its invariant.
    fn advance(&mut self, model: &Model, known: usize, tau_m: f64, random: &mut impl Rng) {
        let free = model.prior.free();
        for particle in &mut self.particles {
            let normals =
                Vector6::from_fn(|i, _| if free[i] { StandardNormal.sample(random) } else { 0.0 });
            let accepts: f64 = random.random();
            let here = Langevin::new(model, known, &particle.fits, tau_m);
            let step = here.step(&normals);
            let x_wo = moved(&particle.x_wo, &step);
            if !model.prior.contains(model.object, &x_wo) {
                continue;
            }
            let fits: Vec<MeasurementFit> =
                model.evidence.iter().map(|touch| touch.fit(model.object, &x_wo)).collect();
            let there = Langevin::new(model, known, &fits, tau_m);
            let log =
                there.value - here.value + there.log_density(&-step) - here.log_density(&step);
            if accepts.ln() < log {
                *particle = Particle { x_wo, fits };
            }
        }
    }
}

/// Proposal of a Langevin step from a pose.
struct Langevin {
    value: f64,
    drift: Vector6<f64>,
    information: Cholesky<f64, Const<6>>,
}

impl Langevin {
    fn new(model: &Model, known: usize, fits: &[MeasurementFit], tau_m: f64) -> Self {
        let mut sum = LogLikelihood::zero();
        for (i, (touch, fit)) in model.evidence.iter().zip(fits).enumerate() {
            let tau_m = if i < known { 0.0 } else { tau_m };
            touch.add(fit, &model.noise, tau_m, &mut sum);
        }
        let free = model.prior.free();
        let is_free = |i: usize, j: usize| if free[i] && free[j] { 1.0 } else { 0.0 };
        let mask = Matrix6::from_fn(is_free);
        let information = sum.information.component_mul(&mask) + model.prior.precision();
        let gradient = sum.gradient.component_mul(&mask.diagonal());
        // The precision of the prior is positive, so that only overflow fails.
        let information =
            Cholesky::new(information).unwrap_or_else(|| Cholesky::pack_dirty(Matrix6::identity()));
        let drift = information.solve(&gradient) * (0.5 * STEP * STEP);
        Self { value: sum.value, drift, information }
    }

    /// Returns the step for standard normal numbers.
    fn step(&self, normals: &Vector6<f64>) -> Vector6<f64> {
        let mut across = *normals;
        // Lᵀ x = z gives the covariance (L Lᵀ)⁻¹.
        self.information.l_dirty().tr_solve_lower_triangular_mut(&mut across);
        self.drift + across * STEP
    }

    /// Logarithm of the density of a step, up to a constant.
    fn log_density(&self, step: &Vector6<f64>) -> f64 {
        let lower = self.information.l();
        let off = (lower.transpose() * (step - self.drift)) / STEP;
        let log_determinant: f64 = lower.diagonal().iter().map(|x| x.ln()).sum();
        log_determinant - 0.5 * off.norm_squared()
    }
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

/// Returns the logarithm of a sum of exponentials; −∞ for an empty one.
pub(super) fn log_sum_exp(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match most.is_finite() {
        true => most + logs.iter().map(|log| (log - most).exp()).sum::<f64>().ln(),
        false => most,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::{Contact, End, Evidence, FreeVolume, Outcome};
    use crate::recognition::measurement::TouchMeasurement;
    use crate::recognition::pose_prior::Turn;
    use crate::robot::Finger;
    use crate::task::{Aim, Ball};
    use nalgebra::{Point3, Vector3};
    use palpate_geometry::mesh::Mesh;
    use palpate_geometry::solids::box_mesh;
    use palpate_gp::math::seed;

    /// Touches of a box whose front and right side are 2 mm and 3 mm off.
    fn touches() -> Vec<Arc<Measurement>> {
        let ball = Ball { centre_w: Point3::origin(), radius_m: 0.15, lowest_m: None };
        let finger = Finger { pitch_deg: 0.0, ..Finger::default() };
        [([0.01, 0.032, 0.0], Vector3::y()), ([0.053, 0.0, 0.01], Vector3::x())]
            .into_iter()
            .map(|(p_w, normal_w)| {
                let aim = Aim::against(p_w.into(), &normal_w);
                let approach = ball.approach(&aim, &finger, 0.01, 0.0);
                let p_wt = aim.p_w + normal_w * finger.radius_m;
                let contact = Contact::new(aim.p_w, normal_w);
                let free = FreeVolume::new(finger.clone(), &approach, p_wt, End::Contact);
                let evidence = vec![Evidence::Points(contact.into()), Evidence::Free(free)];
                let outcome = Outcome::new(End::Contact, evidence);
                let evidence = TouchMeasurement::new(&outcome, 0.0, None);
                Arc::new(Measurement::Touch(evidence.unwrap()))
            })
            .collect()
    }

    /// The evidence of particles is the integral of the likelihood over the prior, and their mean
    /// is that of the posterior: a sum over a grid is the slow twin.
    #[test]
    fn particles_are_an_integral_over_the_prior() {
        let (vertices, triangles) = box_mesh([-0.05, -0.03, -0.04], [0.05, 0.03, 0.04]);
        let object = LibraryObject::new("box", &Mesh::new(&vertices, &triangles).unwrap().0);
        let half_width_m = [0.02, 0.02, 0.0];
        let prior = PosePrior { position_m: [0.0, 0.0, -0.04], half_width_m, turn: Turn::None };
        let noise = NoiseModel { contact_sd_m: 1e-3, normal_sd_rad: 0.2, outliers: 1e-3 };
        let touches = touches();
        let per_side = 400;
        let (mut logs, mut means) = (Vec::new(), [0.0; 2]);
        for i in 0..per_side * per_side {
            let at = [i % per_side, i / per_side].map(|n| (n as f64 + 0.5) / per_side as f64);
            let x_wo = prior.at(&object, [at[0], at[1], 0.5, 0.0, 0.0, 0.0]);
            let mut sum = LogLikelihood::zero();
            for touch in &touches {
                touch.add(&touch.fit(&object, &x_wo), &noise, 0.0, &mut sum);
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
        };
        let mut evidences = Vec::new();
        for number in 0..8 {
            let mut random = seed::stream(1, number, "particles");
            let mut particles = Particles::new(&model(0), 256, &mut random);
            // One after another, or both at once as in a restart.
            if number % 2 == 0 {
                particles.update(&model(1), &mut random);
            }
            particles.update(&model(2), &mut random);
            evidences.push(particles.log_evidence);
            let mean = particles.weighted().fold(Vector3::zeros(), |sum, (x_wo, weight)| {
                sum + x_wo.translation.vector * weight
            });
            assert!((mean.x - means[0]).abs() < 4e-4, "{mean} {means:?}");
            assert!((mean.y - means[1]).abs() < 4e-4, "{mean} {means:?}");
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
