//! Hypotheses about object and pose, and *none of these*.

use super::known_shape::KnownShape;
use super::library::{Library, LibraryObject, PlacedObject};
use super::measurement::{
    Measurement, NoiseModel, TouchMeasurement, ViewMeasurement, before_m, hull, log_sum_exp,
};
use super::model::Model;
use super::object_posterior::{HOPELESS, ObjectPosterior, Search};
use super::particles::{Particles, systematic};
use super::pose_prior::PosePrior;
use crate::evidence::Outcome;
use crate::robot::sensor::{GelPad, TipSurface};
use crate::task::{Approach, Target, Task};
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_input::config::{Rules, Validate};
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Settings of the hypotheses: noise, and the hypothesis *none of these*.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RecognitionSettings {
    /// Prior probability that the object is none of the library.
    pub none_probability: f64,
    /// Standard deviation of a contact along the normal, m, beside its sensor's; default 0.0005,
    /// for a soft finger 0.002.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_sd_m: Option<f64>,
    /// Standard deviation of a contact's normal about each of two axes, deg; default 10, for a soft
    /// finger 40.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal_sd_deg: Option<f64>,
    /// Share of contacts that are anywhere, e.g. on something else; default 0.001, for a soft
    /// finger 0.05.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outliers: Option<f64>,
    /// Number of poses per object; many possible objects share 32 times as many.
    pub particles: u32,
}

impl Default for RecognitionSettings {
    /// Returns the defaults.
    fn default() -> Self {
        let (contact_sd_m, normal_sd_deg, outliers) = (None, None, None);
        // heuristics: rarely another object; a few poses in each direction.
        Self { none_probability: 0.05, contact_sd_m, normal_sd_deg, outliers, particles: 256 }
    }
}

impl Validate for RecognitionSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("none_probability", self.none_probability, 0.0..=0.999);
        rules.optional_number("contact_sd_m", self.contact_sd_m, 1e-6..=0.1);
        rules.optional_number("normal_sd_deg", self.normal_sd_deg, 0.1..=180.0);
        rules.optional_number("outliers", self.outliers, 1e-12..=0.5);
        rules.number("particles", self.particles.into(), 8.0..=1e5);
    }
}

/// Noise of a shape near to one of the library: the object *none of these* is often of their kind.
// heuristic: a tenth of an object for a hand, and normals that hardly agree.
const NEAR_SHAPE: NoiseModel =
    NoiseModel { contact_sd_m: 6e-3, normal_sd_rad: 0.6, outliers: 0.05 };

/// Part of the poses that the hypothesis of a near shape has.
const NEAR_PART: u32 = 4;

/// Number of possible objects from which on they share the poses of so many.
// heuristic: as many as a planner draws hypotheses are left for each of the likely ones.
const SHARED: u32 = 32;

/// Number of peaks of the best object that are starts for the others.
const GUESSES: usize = 2;

/// Length over which a shape differs alike from one of the library, m.
// heuristic: half the size of an object for a hand.
const ALIKE_M: f64 = 0.03;

/// Counts of touches after which all objects are looked for once more, over the whole prior while
/// none is sure, and the probability of the best object, and its log-odds against none of these,
/// below which it is not.
// heuristic: often at first, when touches are few and poses many.
const SEARCHES: [usize; 8] = [3, 4, 6, 8, 11, 15, 20, 30];
const UNDECIDED: f64 = 0.9;
const DOUBT: f64 = 8.0;

/// A possible object at a possible pose.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    /// Number of the object in the library.
    pub object: usize,
    /// Pose of the object's frame in `W`.
    pub x_wo: Isometry3<f64>,
}

/// Predicted contact of a touch.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// Way of the tip from the approach's nearest point, m.
    pub way_m: f64,
    /// Normal in `W`, from the surface towards the finger.
    pub normal_w: Vector3<f64>,
    /// Point of the surface that is touched, in `W`.
    pub p_w: Point3<f64>,
    /// Whether the tip touches; otherwise the shaft does, where no sensor is.
    pub is_on_tip: bool,
}

/// Estimate of the most likely object's pose.
#[derive(Clone, Debug)]
pub struct PoseEstimate {
    /// Number of the object in the library.
    pub object: usize,
    /// Pose of the object's frame in `W` with the smallest expected distance of surfaces.
    pub x_wo: Isometry3<f64>,
    /// Distance of the surfaces, m, that the pose exceeds with a probability of 5 %.
    pub distance_95_m: f64,
}

/// Smallest number of poses per object.
const FEWEST: u32 = 8;

/// Returns the number of poses per object where `possible` objects are.
fn shared(particles: u32, possible: usize) -> u32 {
    let share = particles.saturating_mul(SHARED) / (possible as u32).max(1);
    share.clamp(FEWEST, particles.max(FEWEST))
}

/// Posterior over objects and poses.
#[derive(Clone)]
pub struct ObjectHypotheses {
    library: Arc<Library>,
    prior: Arc<PosePrior>,
    settings: RecognitionSettings,
    noise: NoiseModel,
    task: Task,
    slack_m: f64,
    /// Error that all contacts have in common.
    offset_m: f64,
    pad: Option<GelPad>,
    evidence: Vec<Arc<Measurement>>,
    objects: Vec<ObjectPosterior>,
    near: Vec<ObjectPosterior>,
    tested: Option<TestedClass>,
}

/// The named class, with the log-likelihood ratio against none of these of the touches since, each
/// predicted by those before.
#[derive(Clone, Copy)]
struct TestedClass {
    class: usize,
    predictive_nats: f64,
}

impl ObjectHypotheses {
    /// Creates the prior of touches by a tip with this `surface`: all objects are equally likely.
    pub fn new(
        library: Arc<Library>,
        prior: PosePrior,
        settings: RecognitionSettings,
        task: &Task,
        surface: &TipSurface,
        random: &mut ChaCha8Rng,
    ) -> Self {
        let usual = surface.errors(task.touch().press_m);
        let noise = NoiseModel {
            contact_sd_m: settings.contact_sd_m.unwrap_or(usual.contact_sd_m),
            normal_sd_rad: settings.normal_sd_deg.map_or(usual.normal_sd_rad, f64::to_radians),
            outliers: settings.outliers.unwrap_or(usual.outliers),
        };
        let pad = match surface {
            TipSurface::Pad(pad) => Some(pad.clone()),
            TipSurface::Rigid | TipSurface::Skin => None,
        };
        let mut made = Self {
            library,
            prior: Arc::new(prior),
            settings,
            noise,
            task: task.clone(),
            slack_m: usual.slack_m,
            offset_m: usual.offset_m[1],
            pad,
            evidence: Vec::new(),
            objects: Vec::new(),
            near: Vec::new(),
            tested: None,
        };
        let mut bank = |count: u32, noise: NoiseModel| -> Vec<ObjectPosterior> {
            let numbers = 0..made.library.objects().len();
            let posterior = numbers.map(|number| {
                let mut random: ChaCha8Rng = rand::SeedableRng::from_rng(&mut *random);
                let particles =
                    Particles::new(&made.model(number, &[], noise), count as usize, &mut random);
                ObjectPosterior::new(particles, random)
            });
            posterior.collect()
        };
        let count = shared(made.settings.particles, made.library.objects().len());
        let objects = bank(count, made.noise);
        let near = bank((count / NEAR_PART).max(FEWEST), NEAR_SHAPE);
        (made.objects, made.near) = (objects, near);
        made
    }

    /// Number of poses of each possible object.
    fn particles(&self) -> u32 {
        shared(self.settings.particles, self.objects.iter().filter(|it| it.is_possible).count())
    }

    fn model<'a>(
        &'a self,
        number: usize,
        evidence: &'a [Arc<Measurement>],
        noise: NoiseModel,
    ) -> Model<'a> {
        let object = &self.library.objects()[number];
        Model { object, prior: &self.prior, evidence, noise, is_coarse: false }
    }

    /// The objects.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// The task of the touches.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// Updates the posterior by what an action has shown; nothing after an overload, or by a view
    /// that shows nothing.
    pub fn observe(&mut self, outcome: &Outcome) {
        let measurement = match outcome.seen() {
            Some(seen) => ViewMeasurement::new(seen).map(Measurement::View),
            None => {
                let (pad, region_m) = (self.pad.as_ref(), self.task.region().widest_m());
                TouchMeasurement::new(outcome, self.slack_m, pad, region_m).map(Measurement::Touch)
            }
        };
        self.push(measurement);
    }

    fn push(&mut self, evidence: Option<Measurement>) {
        let Some(evidence) = evidence else { return };
        self.evidence.push(Arc::new(evidence));
        let before = self.tested.map(|tested| self.log_ratio(tested.class));
        self.update_all();
        if let (Some(tested), Some(before)) = (self.tested, before) {
            let predictive_nats = tested.predictive_nats + self.log_ratio(tested.class) - before;
            self.tested = Some(TestedClass { predictive_nats, ..tested });
        }
        self.revise();
        self.name_likeliest();
    }

    /// Takes in new touches for all objects that are possible.
    fn update_all(&mut self) {
        let wanted = self.particles() as usize;
        let Self { library, prior, evidence, noise, objects, near, .. } = self;
        let of_near = (wanted / NEAR_PART as usize).max(FEWEST as usize);
        // A near shape differs by more than the grid of distances errs.
        let banks = [(objects, *noise, wanted, false), (near, NEAR_SHAPE, of_near, true)];
        for (bank, noise, wanted, is_coarse) in banks {
            let each = bank.par_iter_mut().zip(library.objects());
            each.filter(|(posterior, _)| posterior.is_possible).for_each(|(posterior, object)| {
                let model = Model { object, prior, evidence, noise, is_coarse };
                posterior.update(&model, wanted);
            });
        }
    }

    /// Leaves out hopeless objects.
    fn leave_out(&mut self) {
        for bank in [&mut self.objects, &mut self.near] {
            let evidences = bank.iter().map(|it| it.particles.log_evidence);
            let best = evidences.fold(f64::NEG_INFINITY, f64::max);
            for posterior in bank {
                posterior.is_possible &= posterior.particles.log_evidence > best + HOPELESS;
            }
        }
    }

    /// Whether no object is likely, or the best one explains the touches hardly better than none of
    /// these does.
    fn is_doubtful(&self) -> bool {
        let probabilities = self.probabilities();
        let Some((none, objects)) = probabilities.split_last() else { return false };
        let best = objects.iter().copied().fold(0.0, f64::max);
        best < UNDECIDED || none.ln() > best.ln() - DOUBT
    }

    /// Looks for poses that particles have missed, over the whole prior after some touches if in
    /// doubt: first for the best object, then for the others at its poses too, so that none is left
    /// out whose shape fits there. Those left out are looked at after some touches.
    fn revise(&mut self) {
        let is_due = SEARCHES.contains(&self.evidence.len());
        let is_doubtful = self.is_doubtful();
        let is_wide = is_due && is_doubtful;
        let wanted = self.particles() as usize;
        let Self { library, prior, evidence, noise, objects, .. } = self;
        let log = |posterior: &ObjectPosterior| posterior.particles.log_evidence;
        let numbers = 0..objects.len();
        let first = numbers.max_by(|a, b| log(&objects[*a]).total_cmp(&log(&objects[*b])));
        let Some(first) = first else { return };
        let noise = *noise;
        let model = |number: usize| Model {
            object: &library.objects()[number],
            prior,
            evidence,
            noise,
            is_coarse: false,
        };
        let search = Search { guesses: &[], best: log(&objects[first]), is_wide, wanted };
        let is_needed =
            |it: &ObjectPosterior| is_due || (it.is_possible && (it.is_surprised || is_doubtful));
        if is_needed(&objects[first]) {
            objects[first].revise(&model(first), &search);
        }
        let guesses: Vec<_> = objects[first].peaks.iter().take(GUESSES).copied().collect();
        let search = Search { guesses: &guesses, best: log(&objects[first]), ..search };
        let others = objects
            .par_iter_mut()
            .enumerate()
            .filter(|(number, posterior)| *number != first && is_needed(posterior));
        others.for_each(|(number, posterior)| posterior.revise(&model(number), &search));
        self.leave_out();
    }

    /// Names the likeliest class, once it is likely at a known pose: the touches from then on test
    /// it. Another pose would explain them too before.
    fn name_likeliest(&mut self) {
        let probabilities = self.class_probabilities();
        let likeliest = probabilities.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let Some((class, probability)) = likeliest else { return };
        if self.tested.is_none_or(|tested| tested.class != class) {
            let is_named = *probability >= UNDECIDED
                && class < self.library.classes().len()
                && self.estimate().distance_95_m < NEAR_SHAPE.contact_sd_m;
            self.tested = is_named.then_some(TestedClass { class, predictive_nats: 0.0 });
        }
    }

    /// Log-likelihood ratio, against none of these, of the touches since the likeliest class was
    /// named, nats: each is predicted by those before. It is 0 before a class is named.
    pub fn predictive_nats(&self) -> f64 {
        self.tested.map_or(0.0, |tested| tested.predictive_nats)
    }

    /// Logarithm of the evidence for a class over that for none of these.
    fn log_ratio(&self, class: usize) -> f64 {
        let objects = self.objects.iter().enumerate();
        let of_class = objects.filter(|(number, _)| self.library.class_of(*number) == class);
        let logs: Vec<f64> = of_class.map(|(_, it)| it.particles.log_evidence).collect();
        log_sum_exp(&logs) - (logs.len() as f64).ln() - self.log_evidence_of_none()
    }

    /// Logarithm of the evidence for none of these: half of the other shapes are near to one of the
    /// library.
    fn log_evidence_of_none(&self) -> f64 {
        let near: Vec<f64> = self.near.iter().map(|it| it.particles.log_evidence).collect();
        log_sum_exp(&[0.0, log_sum_exp(&near) - (near.len() as f64).ln()]) - 2f64.ln()
    }

    /// Deviation of the surface of a shape near to one of the library, at a point in `W`, m: it
    /// grows with the distance from the contacts so far.
    pub fn near_sd_m(&self, p_w: &Point3<f64>) -> f64 {
        let contacts = self.evidence.iter().flat_map(|measurement| measurement.touched_w());
        let nearest_m = contacts.map(|(at_w, _)| (at_w - p_w).norm()).fold(f64::INFINITY, f64::min);
        // What a squared exponential kernel leaves of the prior's variance.
        let left = -(-(nearest_m / ALIKE_M).powi(2)).exp_m1();
        NEAR_SHAPE.contact_sd_m * left.sqrt()
    }

    /// Probability of none of these, or that of its prior if it is less: objects that no touch was
    /// chosen against remain possible.
    pub fn open_probability(&self) -> f64 {
        let none = self.probabilities().last().copied().unwrap_or(0.0);
        none.max(self.settings.none_probability)
    }

    /// Probability of each object, then that of none of these.
    pub fn probabilities(&self) -> Vec<f64> {
        let count = self.objects.len() as f64;
        let none = self.settings.none_probability;
        let share = ((1.0 - none) / count).ln();
        let mut logs: Vec<f64> =
            self.objects.iter().map(|it| it.particles.log_evidence + share).collect();
        logs.push(none.ln() + self.log_evidence_of_none());
        let sum = log_sum_exp(&logs);
        logs.into_iter().map(|log| (log - sum).exp()).collect()
    }

    /// Probability of each class of objects, then that of none of these.
    pub fn class_probabilities(&self) -> Vec<f64> {
        let mut classes = vec![0.0; self.library.classes().len()];
        let mut probabilities = self.probabilities();
        let none = probabilities.pop();
        for (object, probability) in probabilities.into_iter().enumerate() {
            classes[self.library.class_of(object)] += probability;
        }
        classes.extend(none);
        classes
    }

    /// Whether none of the objects is more likely than not.
    pub fn is_unknown(&self) -> bool {
        self.probabilities().last().is_some_and(|none| *none > 0.5)
    }

    /// Draws `count` hypotheses by their probability, evenly over the posterior.
    pub fn draw(&self, count: usize, random: &mut impl Rng) -> Vec<Hypothesis> {
        let probabilities = self.probabilities();
        let weighted = self.objects.iter().zip(probabilities).enumerate().flat_map(
            |(object, (posterior, probability))| {
                let weighted = posterior.particles.weighted();
                weighted.map(move |(x_wo, weight)| (object, x_wo, weight * probability))
            },
        );
        let weighted: Vec<_> = weighted.collect();
        let sum: f64 = weighted.iter().map(|it| it.2).sum();
        let weights = weighted.iter().map(|it| it.2 / sum);
        let drawn = systematic(weights, count, random.random());
        drawn
            .into_iter()
            .map(|i| Hypothesis { object: weighted[i].0, x_wo: *weighted[i].1 })
            .collect()
    }

    /// Returns `count` shapes that the object may be like, drawn evenly over the posterior: half of
    /// them objects of the library, half of them near to one. The rest of their probability is that
    /// of none of these before all touches.
    pub fn shapes(&self, count: usize) -> Vec<KnownShape> {
        [&self.objects, &self.near]
            .into_iter()
            .flat_map(|bank| self.drawn(bank, count / 2))
            .collect()
    }

    /// Returns `count` shapes drawn from a bank of objects that were equally likely before.
    fn drawn(&self, bank: &[ObjectPosterior], count: usize) -> Vec<KnownShape> {
        let logs: Vec<f64> = bank.iter().map(|it| it.particles.log_evidence).collect();
        let sum = log_sum_exp(&logs);
        let weighted: Vec<_> = (bank.iter().zip(self.library.objects()).zip(&logs))
            .flat_map(|((posterior, object), log)| {
                let probability = (log - sum).exp();
                let weighted = posterior.particles.weighted();
                weighted.map(move |(x_wo, weight)| (object, x_wo, weight * probability))
            })
            .collect();
        let drawn = systematic(weighted.iter().map(|it| it.2), count, 0.5).into_iter();
        let probability = (1.0 - self.settings.none_probability) / (2 * count.max(1)) as f64;
        let shape = |i: usize| {
            let (object, x_wo, _) = weighted[i];
            KnownShape::new(Arc::clone(object), *x_wo, probability, Arc::clone(&self.prior))
        };
        drawn.map(shape).collect()
    }

    /// Returns the pose of the most likely object.
    pub fn estimate(&self) -> PoseEstimate {
        let likely = self
            .objects
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.particles.log_evidence.total_cmp(&b.1.particles.log_evidence));
        let (number, posterior) = likely.unwrap_or((0, &self.objects[0]));
        let object = &self.library.objects()[number];
        let (x_wo, distance_95_m) = posterior.particles.central(object);
        let distance_95_m = distance_95_m.hypot(self.offset_m);
        PoseEstimate { object: number, x_wo, distance_95_m }
    }

    /// Returns a point of a hypothesis's surface, in `W`, with the number of the point among its
    /// samples.
    pub fn surface_point_w(&self, hypothesis: &Hypothesis, number: usize) -> Point3<f64> {
        let samples = &self.library.objects()[hypothesis.object].samples;
        hypothesis.x_wo * samples[number % samples.len()]
    }

    /// Predicts the contact of a touch for a hypothesis; `None` for a miss.
    pub fn predict(&self, hypothesis: &Hypothesis, approach: &Approach) -> Option<Prediction> {
        let finger = self.task.finger();
        let object: &LibraryObject = &self.library.objects()[hypothesis.object];
        let (ahead_w, before_m) = (approach.direction_w(), before_m(finger));
        let start_w = approach.p_near_w - ahead_w.scale(before_m);
        let hull = hull(finger, &approach.r_wt(), start_w);
        let way_m = (approach.p_far_w - start_w).dot(&ahead_w) + finger.radius_m;
        let placed = PlacedObject::exact(object, &hypothesis.x_wo);
        let hit = placed.sweep(&hull, &ahead_w, way_m)?;
        let p_wt = start_w + ahead_w.scale(hit.travel_m);
        let behind_m = (hit.p_w - p_wt).dot(&(hull.p1_w - hull.p0_w)) / finger.length_m;
        Some(Prediction {
            way_m: hit.travel_m - before_m,
            normal_w: hit.normal_w,
            p_w: hit.p_w,
            is_on_tip: finger.length_m == 0.0 || behind_m <= finger.radius_m,
        })
    }

    /// Returns the approach to a target, if the finger reaches it.
    pub fn approach(&self, target: &Target) -> Option<Approach> {
        self.task.approach(target).filter(|_| self.task.region().contains(target))
    }
}
