//! Comparison of the hypotheses about the object with the object of the trial.

use palpate_explore::recognition::ObjectHypotheses;
use palpate_gp::math::pose::parts;
use palpate_sim::library::TrueObject;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the hypothesis that the object is none of the library.
pub const NONE: &str = "none";

/// Smallest probability that a row has.
// heuristic: less is not visible in a figure.
const LEAST: f64 = 1e-3;

/// Smallest probability of the true object in a logarithm.
// heuristic: a score of 14 nats for a certain error.
const FLOOR: f64 = 1e-6;

/// Hypotheses after a touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecognitionMetrics {
    /// Most likely object or class of objects, or `none`.
    pub object: String,
    /// Probabilities of at least 0.001, by object or class; that of none of these as `none`.
    pub probabilities: BTreeMap<String, f64>,
    /// Log-likelihood ratio against none of these, nats, of the touches since the most likely
    /// object or class was 0.9 likely with a pose known to 6 mm, each predicted by those before.
    #[serde(default)]
    pub predictive_nats: f64,
    /// Estimated pose of the most likely object of the library.
    pub pose: PoseRow,
    /// Errors, in a simulation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<RecognitionError>,
}

/// Pose of an object's mesh in `W`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PoseRow {
    /// Name of the object.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub object: String,
    /// Position of the mesh's origin, m.
    pub position_m: [f64; 3],
    /// Rotation about the fixed axes x, then y, then z, deg.
    pub rotation_deg: [f64; 3],
    /// Mean distance between the surfaces at the true and at this pose that is exceeded with a
    /// probability of 5 %, m.
    pub distance_95_m: f64,
}

/// Errors of hypotheses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecognitionError {
    /// Name of the true object.
    pub object: String,
    /// Position of the origin of its mesh, m, and rotation about the fixed axes x, then y, then z,
    /// deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<[[f64; 3]; 2]>,
    /// Right hypothesis: its name or class; `none` for an unknown object.
    pub hypothesis: String,
    /// Probability of the right hypothesis.
    pub probability: f64,
    /// Mean distance between the surface at the true and at the estimated pose, m (ADD-S), if the
    /// most likely object is the true one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance_m: Option<f64>,
    /// Distance of the estimated from the true position of the object's middle, m, and angle of
    /// the rotation between both poses, deg, under the same condition. A symmetric object's angle
    /// means nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<[f64; 2]>,
}

impl RecognitionMetrics {
    /// Compares hypotheses with the object of the trial, where it is known.
    pub fn of(hypotheses: &ObjectHypotheses, truth: Option<&TrueObject>) -> Self {
        let objects = hypotheses.library().objects();
        let classes = hypotheses.library().classes();
        let name = |i: usize| classes.get(i).map_or_else(|| NONE.to_owned(), String::clone);
        let probabilities = hypotheses.class_probabilities();
        let best = probabilities.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let best = best.map_or(classes.len(), |(i, _)| i);
        let estimate = hypotheses.estimate();
        let object = &objects[estimate.object];
        let (position_m, rotation_deg) = parts(&(estimate.x_wo * object.x_om()));
        let error = truth.map(|truth| {
            let right = classes.iter().position(|class| *class == truth.class);
            let right = right.unwrap_or(classes.len());
            let is_found = truth.number == Some(estimate.object);
            let between = truth.x_wo.inv_mul(&estimate.x_wo);
            RecognitionError {
                object: truth.name.clone(),
                pose: Some(parts(&truth.x_wm).into()),
                hypothesis: name(right),
                probability: probabilities.get(right).copied().unwrap_or(0.0),
                distance_m: is_found
                    .then(|| object.surface_distance_m(&truth.x_wo, &estimate.x_wo)),
                offset: is_found.then(|| {
                    let offset_m = truth.x_wo.translation.vector - estimate.x_wo.translation.vector;
                    [offset_m.norm(), between.rotation.angle().to_degrees()]
                }),
            }
        });
        let listed = probabilities.iter().enumerate().filter(|(_, it)| **it >= LEAST);
        Self {
            object: name(best),
            probabilities: listed.map(|(i, it)| (name(i), *it)).collect(),
            predictive_nats: hypotheses.predictive_nats(),
            pose: PoseRow {
                object: object.name.clone(),
                position_m,
                rotation_deg,
                distance_95_m: estimate.distance_95_m,
            },
            error,
        }
    }

    /// Probability of the most likely hypothesis.
    pub fn confidence(&self) -> f64 {
        self.probabilities.get(&self.object).copied().unwrap_or(0.0)
    }

    /// Whether the object is identified: none of these, or an object, has the probability `sure`,
    /// and touches that the object has predicted since it was named alone have these odds against
    /// none of these. The touches that led to a name do not test it.
    pub fn is_identified(&self, sure: f64) -> bool {
        let odds = sure / (1.0 - sure);
        let is_tested = self.object == NONE || self.predictive_nats >= odds.ln();
        self.confidence() >= sure && is_tested
    }

    /// Whether the most likely hypothesis is the right one.
    pub fn is_right(&self) -> Option<bool> {
        self.error.as_ref().map(|error| error.hypothesis == self.object)
    }

    /// Negative logarithm of the right hypothesis's probability, nats.
    pub fn log_score(&self) -> Option<f64> {
        self.error.as_ref().map(|error| -error.probability.max(FLOOR).ln())
    }

    /// Whether the true pose is within the distance stated for it, where the object is found.
    pub fn is_covered(&self) -> Option<bool> {
        let distance_m = self.error.as_ref()?.distance_m?;
        Some(distance_m <= self.pose.distance_95_m)
    }
}
