//! What is told of a believed closed surface.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Agreement of a believed closed surface with the true one.
///
/// Distances are from a point of one surface to the nearest point of the other, over points spread
/// evenly by area; shares of a length are of the diagonal of the true surface's bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShapeMetrics {
    /// Chamfer distance, in metres: ½·(mean distance from the true surface to the believed one) +
    /// ½·(mean distance from the believed surface to the true one). None where no surface is
    /// believed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chamfer_m: Option<f64>,
    /// Chamfer distance over the diagonal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chamfer_share: Option<f64>,
    /// Mean distance to the believed surface of what the finger can touch of the true one, in
    /// metres; none where that is not asked or is nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reachable_chamfer_m: Option<f64>,
    /// F-score 2·P·R / (P + R) at 1 % of the diagonal: P is the share of the believed surface no
    /// farther than that from the true one, R the share of the true surface no farther than that
    /// from the believed one (Knapitsch et al. 2017, "Tanks and Temples", section 4). 0 where
    /// no surface is believed.
    pub f_1: f64,
    /// The same at 3 % of the diagonal.
    pub f_3: f64,
    /// Believed volume over the true one, minus 1; none where the true surface is open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume_error: Option<f64>,
    /// Believed area over the true one, minus 1.
    pub area_error: f64,
    /// Volume inside both surfaces over the volume inside either; none where the true surface is
    /// open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iou: Option<f64>,
    /// Share of the true surface that lies within two standard deviations of the believed one,
    /// |mean| ≤ 2·sd of the field there; none of a belief that has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
}

/// Standard deviations from the believed surface within which the truth is covered.
const COVERED_SD: f64 = 2.0;

impl ShapeMetrics {
    /// With the share that is covered, from |mean| / sd of the believed field at the true samples;
    /// a ratio that is no number is not covered.
    pub fn with_coverage(self, ratios: impl IntoIterator<Item = f64>) -> Self {
        let coverage = share(ratios, |ratio| ratio.abs() <= COVERED_SD).map(tidy);
        Self { coverage, ..self }
    }
}

/// F-score of distances in metres from the true surface and from the believed one: the harmonic
/// mean of the shares within `limit_m`; 0 where both are.
pub(super) fn f_score(from_true_m: &[f64], from_believed_m: &[f64], limit_m: f64) -> f64 {
    let within = |distances_m: &[f64]| {
        share(distances_m.iter().copied(), |distance_m| distance_m <= limit_m).unwrap_or(0.0)
    };
    let (recall, precision) = (within(from_true_m), within(from_believed_m));
    let sum = precision + recall;
    if sum > 0.0 { tidy(2.0 * precision * recall / sum) } else { 0.0 }
}

/// Mean of some numbers; none of none.
pub(super) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (count, sum) =
        values.into_iter().fold((0_u32, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / f64::from(count))
}

/// A share to six decimals, more than samples resolve: the rows keep one after every touch.
pub(super) fn tidy(share: f64) -> f64 {
    (1e6 * share).round() / 1e6
}

fn share(values: impl IntoIterator<Item = f64>, holds: impl Fn(f64) -> bool) -> Option<f64> {
    mean(values.into_iter().map(|value| f64::from(u8::from(holds(value)))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recall of a quarter and a precision of one: 2 · ¼ / (5/4). A distance at the limit is
    /// within.
    #[test]
    fn the_f_score_is_the_harmonic_mean() {
        assert_eq!(f_score(&[0.1, 1.0, 2.0, 3.0], &[0.0, 0.1], 0.1), 0.4);
        assert_eq!(f_score(&[1.0], &[1.0], 0.1), 0.0);
        assert_eq!(f_score(&[0.0], &[1.0], 0.1), 0.0);
        assert_eq!(f_score(&[0.0], &[], 0.1), 0.0);
    }
}
