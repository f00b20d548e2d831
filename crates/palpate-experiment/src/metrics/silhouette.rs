//! Errors of the estimated silhouette of an object.

use crate::metrics::truth::Truth;
use palpate_explore::surface_evidence::Silhouette;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Number of bins of the probability in a reliability diagram.
pub const TENTHS: usize = 10;

/// Agreement of the estimated presence of a surface with the ground truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SilhouetteMetrics {
    /// Brier score: mean squared error of the probability of a surface.
    pub brier: f64,
    /// Intersection over union of the estimated (probability > ½) and the true surface area.
    pub iou: f64,
    /// Share of the zone's test points that are classified wrongly at probability ½.
    pub misclassified_share: f64,
    /// Test points in each tenth of the probability, and those of them with a surface; written
    /// after the last touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reliability: Option<[[u32; 2]; TENTHS]>,
}

impl SilhouetteMetrics {
    /// Compares `silhouette` with the ground truth at the test points. Returns `None` if every
    /// point has a surface, if the points without one are unknown, or before any observed sweep of
    /// the finger.
    pub fn of(silhouette: &Silhouette, truth: &Truth) -> Option<Self> {
        let count = truth.places.len();
        if !truth.is_complete || truth.surface_count() == count {
            return None;
        }
        if !silhouette.is_known() {
            return None;
        }
        let (mut squares, mut wrong, mut both, mut either) = (0.0, 0.0, 0.0, 0.0);
        let mut reliability = [[0; 2]; TENTHS];
        let one_if = |holds: bool| f64::from(u8::from(holds));
        let probabilities = silhouette.probabilities(truth.places.iter().map(Vec::as_slice));
        for (probability, height_m) in probabilities.into_iter().zip(&truth.heights_m) {
            let is_there = height_m.is_some();
            let is_believed = probability > 0.5;
            squares += (probability - one_if(is_there)).powi(2);
            wrong += one_if(is_believed != is_there);
            both += one_if(is_believed && is_there);
            either += one_if(is_believed || is_there);
            let tenth = ((probability * TENTHS as f64) as usize).min(TENTHS - 1);
            reliability[tenth][0] += 1;
            reliability[tenth][1] += u32::from(is_there);
        }
        let tidy = |value: f64| (1e4 * value).round() / 1e4;
        Some(Self {
            brier: tidy(squares / count as f64),
            iou: tidy(both / f64::max(either, 1.0)),
            misclassified_share: tidy(wrong / count as f64),
            reliability: Some(reliability),
        })
    }
}
