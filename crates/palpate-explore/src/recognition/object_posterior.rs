//! Posterior of one object's pose beside those of the other objects: it is left out, and found
//! again.

use super::measurement::log_sum_exp;
use super::model::Model;
use super::pairs;
use super::particles::Particles;
use super::peaks;
use nalgebra::Isometry3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Logarithm of the probability, relative to the best object, below which an object is left out of
/// further touches.
// heuristic: two contacts that fit exactly would not make up for it.
pub(super) const HOPELESS: f64 = -20.0;

/// Logarithm of the probability, relative to the best object, below which an object is unlikely;
/// when it becomes so its pose is looked for widely.
// heuristic: one in a thousand.
const UNLIKELY: f64 = -6.9;

/// Numbers of poses by pairs of contacts, at each touch and in a wide search, and of the prior in a
/// wide search.
// heuristic: twice as many as the guesses; several times as many as particles remain; and without
// pairs too.
const PAIRED: [usize; 2] = [128, 512];
const SEARCHED: u32 = 256;

/// Nats by which peaks exceed the particles' evidence if the particles have missed a pose.
// heuristic: Laplace's approximation is seldom off by that much.
const MISSED: f64 = 2.0;

/// Poses of an object with their own random numbers, so that objects are updated side by side.
#[derive(Clone)]
pub(super) struct ObjectPosterior {
    pub particles: Particles,
    pub random: ChaCha8Rng,
    /// Whether particles still take part; otherwise their evidence is that of the peaks.
    pub is_possible: bool,
    /// Poses of the peaks.
    pub peaks: Vec<Isometry3<f64>>,
    /// Whether the last touch was less likely than on an unknown shape: particles may have missed
    /// the pose.
    pub is_surprised: bool,
    /// Whether it was unlikely after the last touch.
    is_unlikely: bool,
}

/// Where poses are looked for.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    /// Poses at which the object may be, or turned by quarters.
    pub guesses: &'a [Isometry3<f64>],
    /// Logarithm of the largest evidence of an object.
    pub best: f64,
    /// Whether all poses of the prior are searched, as for an object that becomes unlikely.
    pub is_wide: bool,
    /// Number of particles.
    pub wanted: usize,
}

impl ObjectPosterior {
    pub fn new(particles: Particles, random: ChaCha8Rng) -> Self {
        Self {
            particles,
            random,
            is_possible: true,
            peaks: Vec::new(),
            is_surprised: false,
            is_unlikely: false,
        }
    }

    /// Takes in new evidence; `wanted` poses remain after resampling.
    pub fn update(&mut self, model: &Model, wanted: usize) {
        let before = self.particles.log_evidence;
        self.particles.update(model, wanted, &mut self.random);
        self.is_surprised = self.particles.log_evidence < before;
    }

    /// Looks for poses that the particles have missed, from the peaks so far, the likeliest
    /// particle and the guesses, and draws new particles if there are any.
    pub fn revise(&mut self, model: &Model, search: &Search) {
        let Search { guesses, best, is_wide, wanted } = *search;
        let was_unlikely = self.is_unlikely;
        self.is_unlikely = !self.is_possible || self.particles.log_evidence < best + UNLIKELY;
        let is_wide = is_wide || (self.is_unlikely && !was_unlikely);
        let turns = model.prior.quarter_turns();
        let turned = guesses.iter().flat_map(|x_wo| turns.iter().map(move |turn| x_wo * turn));
        let own = self.is_possible.then(|| self.particles.likeliest(model)).flatten();
        let mut starts: Vec<_> = turned.chain(own).chain(self.peaks.iter().copied()).collect();
        let paired = if is_wide { PAIRED[1] } else { PAIRED[0] };
        starts.extend(pairs::poses(model, paired, &mut self.random));
        if is_wide {
            starts.extend(model.prior.spread(model.object, SEARCHED, self.random.next_u32()));
        }
        let peaks = peaks::find(model, starts.into_iter());
        let mass = peaks::log_mass(&peaks);
        if !self.is_possible {
            self.particles.log_evidence = mass;
        }
        let is_missed = mass > self.particles.log_evidence + MISSED;
        if (!self.is_possible || is_wide || is_missed) && mass > best + HOPELESS {
            let found = peaks::sample(model, &peaks, wanted, &mut self.random);
            self.merge(found);
        }
        self.peaks = peaks.into_iter().map(|peak| peak.x_wo).collect();
    }

    /// Takes another estimate of all evidence if it has more of it. The evidence then is the mean
    /// of both, because each is unbiased and particles that miss a pose have too little.
    fn merge(&mut self, found: Particles) {
        let logs = [found.log_evidence, self.particles.log_evidence];
        if !self.is_possible {
            self.is_possible = found.log_evidence.is_finite();
            self.particles = found;
        } else if logs[0] > logs[1] {
            self.particles = found;
            self.particles.log_evidence = log_sum_exp(&logs) - 2f64.ln();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recognition::boxes::{NOISE, prior, touched_box, touches};
    use crate::recognition::pose_prior::PosePrior;
    use palpate_gp::math::seed;

    /// Particles that have left the object's pose, all of them, do not make it improbable: those
    /// found anew have the evidence of particles that have never left it.
    #[test]
    fn an_object_that_particles_have_left_is_found_again() {
        let (object, prior, touches) = (touched_box(), prior(), touches());
        let model = Model {
            object: &object,
            prior: &prior,
            evidence: &touches,
            noise: NOISE,
            is_coarse: false,
        };
        let mut random = seed::stream(2, 0, "particles");
        let mut posterior = |prior: &PosePrior| {
            let model = Model { prior, ..model };
            let mut particles = Particles::new(&Model { evidence: &[], ..model }, 64, &mut random);
            particles.update(&model, 64, &mut random);
            ObjectPosterior::new(particles, seed::stream(2, 1, "particles"))
        };
        let expected = posterior(&prior).particles.log_evidence;
        let elsewhere = PosePrior {
            position_m: [-0.015, -0.015, -0.04],
            half_width_m: [1e-3, 1e-3, 0.0],
            ..prior
        };
        for is_possible in [true, false] {
            let mut lost = ObjectPosterior { is_possible, ..posterior(&elsewhere) };
            assert!(lost.particles.log_evidence < expected - 10.0);
            let search = Search { guesses: &[], best: expected, is_wide: false, wanted: 64 };
            lost.revise(&model, &search);
            let found = lost.particles.log_evidence;
            assert!(lost.is_possible && (found - expected).abs() < 1.5, "{found} for {expected}");
        }
    }
}
