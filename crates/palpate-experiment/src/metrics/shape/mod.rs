//! True surface of a whole object, and errors of an estimated one.

mod reach;

pub use reach::FingerReach;

use super::mean;
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate_explore::task::approach::attitude;
use palpate_explore::whole_object::Surface;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::low_discrepancy::{SurfacePoint, in_square, over_surface};
use palpate_geometry::mesh::Mesh;
use palpate_geometry::point_in_mesh::{Crossing, spans_inside};
use palpate_sim::Environment;
use palpate_sim::environment::ObjectShape;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Agreement of an estimated closed surface with the true one.
///
/// Distances are from a point of one surface to the nearest point of the other, over points spread
/// evenly by area. Shares of a length refer to the diagonal of the true surface's bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShapeMetrics {
    /// Chamfer distance, m: mean of the mean distances true → estimated and estimated → true; none
    /// without an estimated surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chamfer_m: Option<f64>,
    /// Chamfer distance divided by the diagonal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chamfer_share: Option<f64>,
    /// Mean distance from the reachable true surface to the estimated one, m; none without a
    /// reachable surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reachable_chamfer_m: Option<f64>,
    /// F-score 2·P·R / (P + R) at 1 % of the diagonal (Knapitsch et al. 2017, section 4); 0 without
    /// an estimated surface.
    pub f_1: f64,
    /// F-score at 3 % of the diagonal.
    pub f_3: f64,
    /// F-scores at 1 and 2 mm; absent in rows of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_mm: Option<[f64; 2]>,
    /// Share of the reachable true surface within 2 mm of the estimated one; none without a
    /// reachable surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reached_2_mm: Option<f64>,
    /// Estimated volume divided by the true one, minus 1; none for an open true surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume_error: Option<f64>,
    /// Estimated area divided by the true one, minus 1.
    pub area_error: f64,
    /// Volume inside both surfaces divided by the volume inside either; none for an open true
    /// surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iou: Option<f64>,
    /// Share of the true surface within two standard deviations of the estimated one: |mean| ≤ 2·sd
    /// of the field there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
}

/// Standard deviations within which the true surface counts as covered.
const COVERAGE_SDS: f64 = 2.0;

impl ShapeMetrics {
    /// Sets the coverage from |mean| / sd of the field at the true samples; a NaN ratio is not
    /// covered.
    pub fn with_coverage(self, ratios: impl IntoIterator<Item = f64>) -> Self {
        let coverage = share(ratios, |ratio| ratio.abs() <= COVERAGE_SDS).map(round_share);
        Self { coverage, ..self }
    }
}

/// F-score of the distances from the true surface and from the estimated one, m: the harmonic mean
/// of the shares within `limit_m`; 0 if both are 0.
fn f_score(from_true_m: &[f64], from_believed_m: &[f64], limit_m: f64) -> f64 {
    let within = |distances_m: &[f64]| {
        share(distances_m.iter().copied(), |distance_m| distance_m <= limit_m).unwrap_or(0.0)
    };
    let (recall, precision) = (within(from_true_m), within(from_believed_m));
    let sum = precision + recall;
    if sum > 0.0 { round_share(2.0 * precision * recall / sum) } else { 0.0 }
}

/// Rounds a share to six decimals, finer than the samples resolve: each row stores one per touch.
fn round_share(share: f64) -> f64 {
    (1e6 * share).round() / 1e6
}

fn share(values: impl IntoIterator<Item = f64>, holds: impl Fn(f64) -> bool) -> Option<f64> {
    mean(values.into_iter().map(|value| f64::from(u8::from(holds(value)))))
}

/// Points sampled on each surface.
// heuristic: for ten suite objects, each against two wavy copies and a ball, the Chamfer distance
// differs from that of 100 000 points by 0.07 % (median) and at most 0.4 %, F-scores by at most
// 0.006; half as many points differ by up to 0.9 %, twice as many by up to 0.3 %.
pub const SAMPLES: usize = 4000;

/// Lines along which volumes are compared.
// heuristic: for the same pairs the intersection over union differs from that of 100 000 lines by
// 0.001 (median) and at most 0.0035.
const LINES: usize = 1000;

/// Step between the true samples whose standard deviation is computed.
// heuristic: limits a cost that is quadratic in the number of observations.
const COVERAGE_STEP: usize = 4;

/// True surface, with precomputed samples and properties.
#[derive(Clone)]
pub struct TrueShape {
    bvh: MeshBvh,
    samples: Vec<SurfacePoint>,
    /// Enclosed volume; `None` for an open surface.
    volume_m3: Option<f64>,
    area_m2: f64,
    diagonal_m: f64,
    /// Whether the finger can touch each sample, if computed.
    is_reachable: Option<Vec<bool>>,
}

impl TrueShape {
    /// Returns the surface of an environment with a whole object, with its reachable part if it is
    /// closed; `None` for other environments.
    pub fn from_environment(environment: &Environment) -> Option<Self> {
        let ball = environment.task().ball()?;
        let ObjectShape::Mesh { bvh, report } = environment.shape() else { return None };
        let shape = Self::new(bvh.clone(), report.is_closed());
        if !report.is_closed() {
            return Some(shape);
        }
        let finger = &environment.scene().finger;
        let axis_w = |ahead_w: &UnitVector3<f64>| attitude(ahead_w) * finger.axis_a();
        let (radius_m, lowest_m) = (finger.radius_m, ball.lowest_m);
        Some(shape.with_reach(&FingerReach { radius_m, axis_w: &axis_w, lowest_m }))
    }

    /// Returns the surface of a mesh; only a closed mesh has a volume.
    pub fn new(bvh: MeshBvh, is_closed: bool) -> Self {
        let mesh = bvh.mesh();
        let (low, high) = mesh.bounds();
        // The surface is unknown over a hole.
        let mut samples = over_surface(mesh, SAMPLES);
        samples.retain(|spot| !mesh.is_patch(spot.triangle));
        Self {
            samples,
            volume_m3: is_closed.then(|| mesh.volume_m3()),
            area_m2: mesh.area_m2(),
            diagonal_m: (high - low).norm(),
            is_reachable: None,
            bvh,
        }
    }

    /// Adds the part that a finger can touch.
    pub fn with_reach(self, reach: &FingerReach) -> Self {
        let is_reachable = Some(reach.reachable(&self.bvh, &self.samples));
        Self { is_reachable, ..self }
    }

    /// Whether the surface encloses a volume.
    pub fn is_closed(&self) -> bool {
        self.volume_m3.is_some()
    }

    /// Share of the area that the finger can touch, if computed.
    pub fn reachable_share(&self) -> Option<f64> {
        let is_reachable = self.is_reachable.as_ref()?;
        let count = is_reachable.iter().filter(|&&is_reachable| is_reachable).count();
        Some(count as f64 / is_reachable.len() as f64)
    }

    /// Points spread evenly over the surface, and whether the finger can touch each; empty if that
    /// was not computed.
    pub fn reachable_samples(&self) -> Vec<(Point3<f64>, bool)> {
        let is_reachable = self.is_reachable.iter().flatten();
        self.samples.iter().map(|spot| spot.point).zip(is_reachable.copied()).collect()
    }

    /// Points spread evenly over the surface.
    pub fn samples(&self) -> &[SurfacePoint] {
        &self.samples
    }

    /// Compares an estimated surface, meshed with `cells` along its longest side, with the true
    /// one, including the coverage.
    pub fn evaluate(&self, surface: &Surface, cells: u32) -> ShapeMetrics {
        let looked_at = self.samples.iter().step_by(COVERAGE_STEP).map(|spot| spot.point);
        let points_w: Vec<Point3<f64>> = looked_at.collect();
        let values = surface.values(&points_w).into_iter().zip(surface.sds_m(&points_w));
        let ratios = values.map(|(value, sd_m)| value / sd_m);
        let metrics = match surface.mesh(cells) {
            Some(mesh) => self.compare(&mesh),
            None => self.compare_nothing(),
        };
        metrics.with_coverage(ratios)
    }

    /// Compares the closed mesh `estimated` with the true surface.
    pub fn compare(&self, believed: &Mesh) -> ShapeMetrics {
        let bvh = MeshBvh::new(believed.clone());
        let from_true_m = distances_m(&self.samples, &bvh);
        let from_believed_m = distances_m(&over_surface(believed, SAMPLES), &self.bvh);
        let ways_m = [&from_true_m, &from_believed_m].map(|way_m| mean(way_m.iter().copied()));
        let chamfer_m = ways_m[0].zip(ways_m[1]).map(|(to_m, from_m)| 0.5 * to_m + 0.5 * from_m);
        let reached = self.is_reachable.iter().flatten().zip(&from_true_m);
        let reached_m = reached.filter_map(|(is_reachable, way_m)| is_reachable.then_some(*way_m));
        let reached_m: Vec<f64> = reached_m.collect();
        let f_at = |share| f_score(&from_true_m, &from_believed_m, share * self.diagonal_m);
        let error = |believed: f64, truly: f64| round_share(believed / truly - 1.0);
        let volume_error = self.volume_m3.map(|volume_m3| error(believed.volume_m3(), volume_m3));
        let overlap = self.volume_m3.and_then(|_| intersection_over_union(&self.bvh, &bvh, LINES));
        ShapeMetrics {
            chamfer_m,
            chamfer_share: chamfer_m.map(|chamfer_m| round_share(chamfer_m / self.diagonal_m)),
            reached_2_mm: share(reached_m.iter().copied(), |way_m| way_m <= 2e-3).map(round_share),
            reachable_chamfer_m: mean(reached_m),
            f_mm: Some([1e-3, 2e-3].map(|way_m| f_score(&from_true_m, &from_believed_m, way_m))),
            f_1: f_at(0.01),
            f_3: f_at(0.03),
            volume_error: volume_error.filter(|error| error.is_finite()),
            area_error: error(believed.area_m2(), self.area_m2),
            iou: overlap.map(round_share),
            coverage: None,
        }
    }

    /// Returns the metrics of a belief without a surface: no distance, and the scores of an empty
    /// volume.
    pub fn compare_nothing(&self) -> ShapeMetrics {
        ShapeMetrics {
            volume_error: self.volume_m3.map(|_| -1.0),
            area_error: -1.0,
            iou: self.volume_m3.map(|_| 0.0),
            f_mm: Some([0.0; 2]),
            reached_2_mm: self.is_reachable.as_ref().map(|_| 0.0),
            ..ShapeMetrics::default()
        }
    }
}

/// Distances of points from the nearest point of a surface; left out where that is a hole's patch.
fn distances_m(from: &[SurfacePoint], to: &MeshBvh) -> Vec<f64> {
    let nearest = from.iter().map(|spot| to.closest_point(&spot.point));
    let known = nearest.filter(|nearest| !to.mesh().is_patch(nearest.triangle));
    known.map(|nearest| nearest.distance_m).collect()
}

/// Volume inside both meshes over the volume inside either, from the lengths inside them of `lines`
/// parallel lines. The lines follow the longest side of the common bounding box and are spread
/// evenly across it. Lengths along a line are exact, so only two of three dimensions are sampled.
/// `None` if both volumes are empty.
fn intersection_over_union(a: &MeshBvh, b: &MeshBvh, lines: usize) -> Option<f64> {
    let ((low_a, high_a), (low_b, high_b)) = (a.mesh().bounds(), b.mesh().bounds());
    let (low, high) = (low_a.inf(&low_b), high_a.sup(&high_b));
    let sides_m = high - low;
    // Selects the first of the sides that are equal except for rounding.
    let longest_m = sides_m.max() * (1.0 - 1e-9);
    let along = (0..3).find(|&side| sides_m[side] >= longest_m).unwrap_or(0);
    let mut axis = Vector3::zeros();
    axis[along] = 1.0;
    let axis = UnitVector3::new_unchecked(axis);
    let mut crossings: Vec<Crossing> = Vec::new();
    let [mut of_a, mut of_b] = [Vec::new(), Vec::new()];
    let (mut both_m, mut each_m) = (0.0, 0.0);
    for line in 0..lines {
        let [u, v] = in_square(line);
        let mut start = low;
        start[(along + 1) % 3] += u * sides_m[(along + 1) % 3];
        start[(along + 2) % 3] += v * sides_m[(along + 2) % 3];
        start[along] -= sides_m[along];
        for (mesh, spans) in [(a, &mut of_a), (b, &mut of_b)] {
            crossings.clear();
            mesh.crossings(&start, &axis, |crossing| crossings.push(crossing));
            spans_inside(&mut crossings, spans);
        }
        both_m += common_m(&of_a, &of_b);
        each_m += of_a.iter().chain(&of_b).map(|[from, to]| to - from).sum::<f64>();
    }
    let either_m = each_m - both_m;
    (either_m > 0.0).then(|| both_m / either_m)
}

/// Length of the intersection of the sorted spans `a` with the sorted spans `b`.
fn common_m(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let (mut i, mut j, mut sum_m) = (0, 0, 0.0);
    while let (Some([from_a, to_a]), Some([from_b, to_b])) = (a.get(i), b.get(j)) {
        sum_m += (to_a.min(*to_b) - from_a.max(*from_b)).max(0.0);
        if to_a < to_b { i += 1 } else { j += 1 }
    }
    sum_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A recall of a quarter and a precision of one give 2 · ¼ / (5/4). A distance at the limit
    /// counts as within.
    #[test]
    fn the_f_score_is_the_harmonic_mean() {
        assert_eq!(f_score(&[0.1, 1.0, 2.0, 3.0], &[0.0, 0.1], 0.1), 0.4);
        assert_eq!(f_score(&[1.0], &[1.0], 0.1), 0.0);
        assert_eq!(f_score(&[0.0], &[1.0], 0.1), 0.0);
        assert_eq!(f_score(&[0.0], &[], 0.1), 0.0);
    }

    proptest! {
        /// The reference implementation tests the points between whole numbers one by one.
        #[test]
        fn spans_have_in_common_what_lies_in_both(
            a in prop::collection::btree_set(0u8..40, 0..8),
            b in prop::collection::btree_set(0u8..40, 0..8),
        ) {
            let spans = |ends: std::collections::BTreeSet<u8>| -> Vec<[f64; 2]> {
                let ends: Vec<f64> = ends.into_iter().map(f64::from).collect();
                ends.as_chunks().0.to_vec()
            };
            let (a, b) = (spans(a), spans(b));
            let is_in = |spans: &[[f64; 2]], x| spans.iter().any(|[from, to]| *from < x && x < *to);
            let middles = (0..40).map(|i| f64::from(i) + 0.5);
            let count = middles.filter(|&x| is_in(&a, x) && is_in(&b, x)).count();
            prop_assert_eq!(common_m(&a, &b), count as f64);
        }
    }
}
