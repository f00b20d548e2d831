//! Recognition of an object by recorded contacts, whose errors are of unknown size.
//!
//! Unlike [`ObjectHypotheses`](super::ObjectHypotheses), which follow a probe whose noise is known
//! touch by touch, it takes all contacts at once, from a robot that is not modelled.

use super::library::Library;
use super::measurement::{
    ContactErrors, ContactSet, Measurement, NoiseModel, TouchMeasurement, log_sum_exp,
};
use super::model::Model;
use super::object_posterior::{ObjectPosterior, Search};
use super::particles::Particles;
use super::pose_prior::{PosePrior, Turn};
use crate::evidence::{Contact, End, Evidence, FreeVolume, Outcome};
use nalgebra::{Isometry3, Vector3};
use palpate_gp::math::seed;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::Arc;

/// Noise of normals, and of the depth by which a finger on a path without contact would have met
/// the object.
// heuristic: as for a soft finger; three times the error of an arm's forward kinematics.
const NOISE: NoiseModel = NoiseModel { contact_sd_m: 3e-3, normal_sd_rad: 0.7, outliers: 0.05 };

/// Number of poses of each object.
// heuristic: its evidence then differs by some tenths of a nat from seed to seed.
const POSES: usize = 512;

/// An object of a library with what recorded contacts tell about it.
#[derive(Clone, Debug)]
pub struct RecordedObject {
    /// Number of the object in the library.
    pub object: usize,
    /// Probability, with all objects equally likely before.
    pub probability: f64,
    /// Most likely pose of the object's frame in `W`.
    pub x_wo: Isometry3<f64>,
    /// Distance of the surfaces, m, that the pose exceeds with a probability of 5 %.
    pub distance_95_m: f64,
    /// Errors of the contacts at that pose.
    pub errors: ContactErrors,
}

impl RecordedObject {
    /// Whether the object has the probability `sure`, and the contacts may be of it.
    pub fn is_identified(&self, sure: f64) -> bool {
        self.probability >= sure && self.errors.is_plausible()
    }
}

/// Returns the objects of `library`, the most likely first, given `contacts` and `free` volumes in
/// the same frame `W`, in which the object may be anywhere, at any rotation; empty without
/// contacts. `seed` draws the poses.
///
/// The evidence of an object is the integral of the likelihood over its poses, over the area of its
/// surface: a single contact, which each object has at as many poses as its surface is large, then
/// favours none.
pub fn recognise(
    library: &Library,
    contacts: &[Contact],
    free: &[FreeVolume],
    offset_max_m: f64,
    seed: u64,
) -> Vec<RecordedObject> {
    let Some(set) = ContactSet::new(contacts, offset_max_m) else { return Vec::new() };
    let count = contacts.len() as f64;
    let middle_w: Vector3<f64> = contacts.iter().map(|contact| contact.p_wc.coords / count).sum();
    let largest_m = library.objects().iter().map(|it| it.radius_m()).fold(0.0, f64::max);
    let prior =
        PosePrior { position_m: middle_w.into(), half_width_m: [largest_m; 3], turn: Turn::Free };
    let paths = free.iter().filter_map(|free| {
        let miss = Outcome::new(End::Miss, vec![Evidence::Free(free.clone())]);
        TouchMeasurement::new(&miss, 0.0, None, 0.0)
            .map(|touch| Arc::new(Measurement::Touch(touch)))
    });
    let set = Arc::new(set);
    let contacts = Arc::new(Measurement::Contacts(Arc::clone(&set)));
    let evidence: Vec<Arc<Measurement>> = std::iter::once(contacts).chain(paths).collect();
    let numbered: Vec<_> = library.objects().iter().enumerate().collect();
    let mut found: Vec<(RecordedObject, f64)> = (numbered.par_iter())
        .map(|(number, object)| {
            let model = Model {
                object,
                prior: &prior,
                evidence: &evidence,
                noise: NOISE,
                is_coarse: false,
            };
            let particles = posterior(&model, seed::stream(seed, *number as u64, "recorded"));
            let x_wo = particles.likeliest(&model).unwrap_or_default();
            let log_evidence = particles.log_evidence - object.bvh.mesh().area_m2().ln();
            let found = RecordedObject {
                object: *number,
                probability: 0.0,
                x_wo,
                distance_95_m: particles.central(object).1,
                errors: set.errors(object, &x_wo),
            };
            (found, log_evidence)
        })
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let sum = log_sum_exp(&found.iter().map(|(_, log)| *log).collect::<Vec<_>>());
    let share = |log: f64| (log - sum).exp();
    found.into_iter().map(|(it, log)| RecordedObject { probability: share(log), ..it }).collect()
}

/// Draws poses of an object by the evidence, also those that particles from the prior miss.
fn posterior(model: &Model, mut random: ChaCha8Rng) -> Particles {
    let mut particles = Particles::new(&Model { evidence: &[], ..*model }, POSES, &mut random);
    particles.update(model, POSES, &mut random);
    let best = particles.log_evidence;
    let mut posterior = ObjectPosterior::new(particles, random);
    posterior.revise(model, &Search { guesses: &[], best, is_wide: true, wanted: POSES });
    posterior.particles
}
