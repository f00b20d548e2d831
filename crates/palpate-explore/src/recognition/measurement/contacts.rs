//! Evidence of recorded contacts whose errors are of unknown size, as those of a robot's hand are.
//!
//! The distance of contact i from the surface is rᵢ = δ + εᵢ, with the offset δ that all contacts
//! have in common, e.g. the radius of a fingertip, and the deviation σ of ε. Both are unknown: the
//! likelihood ratio
//!
//! L = mean over (σ, δ) of Πᵢ \[N(rᵢ; δ, σ² + sᵢ²) N(θᵢ; 0, σₙ²)\]^wᵢ
//!
//! with the deviation sᵢ that a contact states, and the angle θᵢ between both normals, where there
//! is one, is averaged over a grid. Contacts near to each other have errors in common: kinematics,
//! skin and mesh are the same there. So each counts by wᵢ = 1 / Σⱼ exp(−|xᵢ − xⱼ|² / 2ℓ²), a
//! composite likelihood (Varin, Reid & Firth 2011).

use super::likelihood::{LogLikelihood, NoiseModel, PointFit, Residual, log_sum_exp};
use super::touch::{LEVER_M, turn_between};
use crate::evidence::Contact;
use crate::recognition::library::{LibraryObject, Nearest, PlacedObject};
use nalgebra::{Isometry3, Point3, Vector3};

/// Distance within which contacts have errors in common, m.
// heuristic: the breadth of a fingertip.
const ALIKE_M: f64 = 0.015;

/// Smallest and largest deviation of a contact, m, and the number of deviations between, each as
/// likely as the others.
// heuristic: from a rigid stick on an industrial arm (0.3 mm) to three times a humanoid's hand
// (5 to 9 mm).
const SD_M: [f64; 2] = [2.5e-4, 1.6e-2];
const SDS: usize = 13;

/// Number of offsets of all contacts from the surface, from 0 to the largest.
// heuristic: 2 mm apart on a fingertip.
const OFFSETS: usize = 5;

/// A recorded contact.
struct RecordedPoint {
    p_w: Point3<f64>,
    normal_w: Option<Vector3<f64>>,
    /// Index of the deviation that it states.
    stated: usize,
    weight: f64,
}

/// Evidence of recorded contacts.
pub struct ContactSet {
    points: Vec<RecordedPoint>,
    /// Different deviations that contacts state, m; 0 without a statement.
    stated_m: Vec<f64>,
    offsets_m: Vec<f64>,
}

/// Errors of contacts, as learned from them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactErrors {
    /// Mean distance from the surface, m, regardless of the side.
    pub distance_m: f64,
    /// Expected deviation, m.
    pub sd_m: f64,
    /// Expected offset, m, outwards.
    pub offset_m: f64,
}

/// Deviation above which contacts are not of the object, m.
// heuristic: between the two largest deviations, of which no known hand has the first.
const FOREIGN_M: f64 = 0.012;

impl ContactErrors {
    /// Whether contacts with these errors may be of the object.
    pub fn is_plausible(&self) -> bool {
        self.sd_m < FOREIGN_M
    }
}

impl ContactSet {
    /// Creates the evidence of `contacts`, which may all be up to `offset_max_m` outside of the
    /// surface; `None` without any.
    pub fn new(contacts: &[Contact], offset_max_m: f64) -> Option<Self> {
        let alike = |a: &Contact, b: &Contact| {
            (-0.5 * (a.p_wc - b.p_wc).norm_squared() / (ALIKE_M * ALIKE_M)).exp()
        };
        let mut stated_m: Vec<f64> = Vec::new();
        let point = |contact: &Contact| {
            let sd_m = contact.sd_m().unwrap_or(0.0);
            let known = stated_m.iter().position(|stated_m| *stated_m == sd_m);
            RecordedPoint {
                p_w: contact.p_wc,
                normal_w: contact.has_normal.then_some(contact.normal_w),
                stated: known.unwrap_or_else(|| {
                    stated_m.push(sd_m);
                    stated_m.len() - 1
                }),
                weight: contacts.iter().map(|other| alike(contact, other)).sum::<f64>().recip(),
            }
        };
        let points: Vec<RecordedPoint> = contacts.iter().map(point).collect();
        let count = if offset_max_m > 0.0 { OFFSETS } else { 1 };
        let offset_m = |i: usize| offset_max_m * i as f64 / (OFFSETS - 1) as f64;
        let offsets_m = (0..count).map(offset_m).collect();
        (!points.is_empty()).then_some(Self { points, stated_m, offsets_m })
    }

    /// Returns the points, in `W`, with their normals, where they were measured.
    pub fn touched_w(&self) -> impl Iterator<Item = (Point3<f64>, Option<Vector3<f64>>)> {
        self.points.iter().map(|point| (point.p_w, point.normal_w))
    }

    /// Returns the residuals for an object at a pose.
    pub fn fit(&self, placed: &PlacedObject) -> Vec<PointFit> {
        let fit = |point: &RecordedPoint| {
            let (distance, Nearest { face_w, .. }) = Residual::of_point(placed, &point.p_w);
            let turn = point.normal_w.map(|to_w| (turn_between(&face_w, &to_w), face_w));
            PointFit { distance, turn }
        };
        self.points.iter().map(fit).collect()
    }

    /// Returns the log-likelihood of the distances for each deviation and offset, at the
    /// temperature `tau_m`.
    fn log_likelihoods(&self, fit: &[PointFit], tau_m: f64) -> Vec<f64> {
        // Σ w, Σ w r and Σ w r² of each stated deviation are enough for all of them.
        let mut sums = vec![[0.0; 3]; self.stated_m.len()];
        for (RecordedPoint { weight, stated, .. }, fit) in self.points.iter().zip(fit) {
            let off_m = fit.distance.value_m;
            let moments = [*weight, weight * off_m, weight * off_m * off_m];
            sums[*stated].iter_mut().zip(moments).for_each(|(sum, moment)| *sum += moment);
        }
        let log = |variance: f64, offset_m: f64| -> f64 {
            let each =
                sums.iter().zip(&self.stated_m).map(|([weight, first, second], stated_m)| {
                    let precision = (variance + stated_m * stated_m).recip();
                    let square = second - offset_m * (2.0 * first - offset_m * weight);
                    0.5 * (weight * precision.ln() - precision * square)
                });
            each.sum()
        };
        self.grid(tau_m).map(|(variance, offset_m)| log(variance, offset_m)).collect()
    }

    /// Returns the variances, m², with each offset, m, at a temperature.
    fn grid(&self, tau_m: f64) -> impl Iterator<Item = (f64, f64)> {
        let offsets_m = &self.offsets_m;
        variances(tau_m)
            .flat_map(move |variance| offsets_m.iter().map(move |offset_m| (variance, *offset_m)))
    }

    /// Adds the log-likelihood ratio of residuals at the temperature `tau_m`.
    pub fn add(&self, fit: &[PointFit], noise: &NoiseModel, tau_m: f64, to: &mut LogLikelihood) {
        let logs = self.log_likelihoods(fit, tau_m);
        let sum = log_sum_exp(&logs);
        to.value += sum - (logs.len() as f64).ln();
        // Expected precision, and precision times offset, of each stated deviation.
        let mut expected = vec![[0.0; 2]; self.stated_m.len()];
        for (variance, logs) in variances(tau_m).zip(logs.chunks(self.offsets_m.len())) {
            let shares = logs.iter().map(|log| (log - sum).exp());
            let (share, offset_m) = shares
                .zip(&self.offsets_m)
                .fold((0.0, 0.0), |sums, (share, at_m)| (sums.0 + share, sums.1 + share * at_m));
            for (expected, stated_m) in expected.iter_mut().zip(&self.stated_m) {
                let precision = (variance + stated_m * stated_m).recip();
                expected[0] += precision * share;
                expected[1] += precision * offset_m;
            }
        }
        let sd_rad = noise.normal_sd_rad.hypot(tau_m / LEVER_M);
        for (RecordedPoint { weight, stated, .. }, fit) in self.points.iter().zip(fit) {
            let [precision, by_offset] = expected[*stated].map(|it| weight * it);
            let Residual { value_m, slope } = &fit.distance;
            to.gradient -= slope * (value_m * precision - by_offset);
            to.information += slope * slope.transpose() * precision;
            if let Some((turn, normal_w)) = &fit.turn {
                to.add_turn(turn, normal_w, sd_rad, *weight);
            }
        }
    }

    /// Returns the errors for `object` at the pose `x_wo`.
    pub fn errors(&self, object: &LibraryObject, x_wo: &Isometry3<f64>) -> ContactErrors {
        let fit = self.fit(&PlacedObject::exact(object, x_wo));
        let logs = self.log_likelihoods(&fit, 0.0);
        let sum = log_sum_exp(&logs);
        let [mut sd_m, mut offset_m] = [0.0; 2];
        for ((variance, of_offset_m), log) in self.grid(0.0).zip(&logs) {
            let share = (log - sum).exp();
            sd_m += share * variance.sqrt();
            offset_m += share * of_offset_m;
        }
        let far_m: f64 = fit.iter().map(|fit| fit.distance.value_m.abs()).sum();
        let distance_m = far_m / fit.len().max(1) as f64;
        ContactErrors { distance_m, sd_m, offset_m }
    }
}

/// Returns the variances of a contact, m², evenly over their logarithms, at a temperature.
fn variances(tau_m: f64) -> impl Iterator<Item = f64> {
    let [low, high] = SD_M.map(f64::ln);
    let log = move |i: usize| low + (high - low) * i as f64 / (SDS - 1) as f64;
    (0..SDS).map(move |i| (2.0 * log(i)).exp() + tau_m * tau_m)
}
