//! Evidence of a look: what a view shows of the region.

use super::{DepthMap, SeenSurface, Sight, View};
use crate::task::{Region, Zone};
use nalgebra::{Point3, UnitVector3, Vector3};

/// Smallest y of a seen normal in the zone that is used.
// heuristic: a steeper wall's height is uncertain by four times the error of its place.
pub(crate) const SEEN_NORMAL_Y_MIN: f64 = 0.25;

/// Number of surface elements of a view of a zone.
// heuristic: as dense as a Gaussian process of a surface with details of a tenth of the image
// needs; an update grows as the cube.
const OF_ZONE: usize = 250;

/// Number of surface elements of a view of a whole object.
// heuristic: as many as dozens of touches with their normals, whose cost the belief can bear.
const OF_OBJECT: usize = 120;

/// Places along the longer side of the zone of which a view tells the presence of a surface.
// heuristic: two diameters of a finger in a zone as wide as a hand.
const SEEN_PER_SIDE: usize = 12;

/// Probability of a surface where a view saw none.
// heuristic: a steep wall may have left a hole in the view.
const SEEN_THROUGH: f64 = 0.1;

/// Standard deviations of noise and rotation by which a surface is nearer that covers a point.
const COVERED_SIGMAS: f64 = 3.0;

/// Number of hidden points before a seen one that show a surface before it.
// heuristic: a single one may be a flying pixel.
const COVERING: usize = 2;

/// Largest number of points before a seen one.
// heuristic: as many as an image has cells along a side.
const STEPS_MAX: f64 = 256.0;

impl SeenSurface {
    /// Creates the evidence of `view` for a belief over `region`.
    pub fn of_region(view: &View, region: &Region) -> Self {
        let margin_m = view.margin_m();
        let wanted = |p_w: &Point3<f64>| region.is_near(p_w, margin_m);
        let count = match region {
            Region::Zone(_) => OF_ZONE,
            Region::Ball(_) => OF_OBJECT,
        };
        let gradient = |normal_w: &UnitVector3<f64>| field_gradient(region, normal_w);
        let mut seen = Self::new(view, wanted, count, gradient);
        if let Some(zone) = region.zone() {
            let step_m = step_m(zone);
            let map = DepthMap::new(view, 0.25 * step_m);
            seen.presence = presence(zone, view, step_m, &map);
            let covered = seen.stated().map(|p_w| is_covered(zone, view, &map, &p_w));
            seen.covered = seen.with_neighbours(&covered.collect::<Vec<bool>>());
        }
        seen
    }

    /// Returns which elements are `covered` or beside one that is: the edge of what covers them is
    /// as uncertain as the camera's pose.
    fn with_neighbours(&self, covered: &[bool]) -> Vec<bool> {
        let sides_m = self.elements.iter().map(|element| element.side_m);
        let all: Vec<(Point3<f64>, f64)> = self.stated().zip(sides_m).collect();
        let is_beside = |(a, a_m): &(Point3<f64>, f64), (b, b_m): &(Point3<f64>, f64)| {
            (a - b).norm() < a_m + b_m
        };
        let is_covered = |(element, is_covered): (&(Point3<f64>, f64), &bool)| {
            let mut others = all.iter().zip(covered).filter(|(_, is_covered)| **is_covered);
            *is_covered || others.any(|(other, _)| is_beside(element, other))
        };
        all.iter().zip(covered).map(is_covered).collect()
    }

    /// Whether the view tells at the place of a point of `W` whether there is a surface.
    pub(crate) fn tells_at(&self, zone: &Zone, p_w: &Point3<f64>) -> bool {
        let p_z = zone.local(&zone.place(p_w), 0.0);
        let near_m = 0.5 * step_m(zone);
        let is_near = |[x, z]: &[f64; 2]| (x - p_z.x).abs().max((z - p_z.z).abs()) <= near_m;
        self.presence.iter().any(|(place, _)| is_near(place))
    }
}

/// Distance between the places of which a view tells the presence of a surface.
fn step_m(zone: &Zone) -> f64 {
    zone.widest_m() / SEEN_PER_SIDE as f64
}

/// Returns the gradient in `W` of a belief's field at a surface with this normal: of the height
/// above it in a zone, of the distance around a whole object.
pub(crate) fn field_gradient(region: &Region, normal_w: &UnitVector3<f64>) -> Vector3<f64> {
    let steep = region.zone().map_or(1.0, |zone| {
        let up = zone.x_wz().inverse_transform_vector(normal_w).y;
        up.abs().max(SEEN_NORMAL_Y_MIN)
    });
    normal_w.into_inner() / steep
}

/// Returns what a view says of the presence of a surface, at a few places of the zone: places (x,
/// z) with a probability; none if the zone has no depth.
fn presence(zone: &Zone, view: &View, step_m: f64, map: &DepthMap) -> Vec<([f64; 2], f64)> {
    let Some([near_m, far_m]) = zone.depth_m else { return Vec::new() };
    let margin_m = view.accuracy.pose_error.position_sd_m.into_iter().fold(0.0, f64::max);
    let counts = zone.extents_m().into_iter().map(|side| ((side / step_m).round() as usize).max(1));
    let counts: Vec<usize> = counts.collect();
    let deep = ((far_m - near_m) / (0.25 * step_m)).ceil().max(1.0) as usize;
    let verdict = |k: usize| {
        let cell = [k % counts[0], k / counts[0]];
        let middles =
            cell.iter().zip(&counts).map(|(at, count)| (*at as f64 + 0.5) / *count as f64);
        let place = zone.at(&middles.collect::<Vec<_>>());
        let line = (0..=deep).map(|d| {
            let depth_m = near_m + (far_m - near_m) * d as f64 / deep as f64;
            zone.x_wz() * zone.local(&place, -depth_m)
        });
        let presence = match map.sight(line, margin_m) {
            Sight::Surface => 1.0,
            Sight::Nothing => SEEN_THROUGH,
            Sight::Unknown => return None,
        };
        let p_z = zone.local(&place, 0.0);
        Some(([p_z.x, p_z.z], presence))
    };
    (0..counts.iter().product()).filter_map(verdict).collect()
}

/// Whether a surface is before a seen point along the approach, as an overhang under which the
/// camera sees: it hides the points before it. A camera that sees a point of a height field sees
/// all points before it too.
fn is_covered(zone: &Zone, view: &View, map: &DepthMap, p_w: &Point3<f64>) -> bool {
    let Some([near_m, _]) = zone.depth_m else { return false };
    let accuracy = &view.accuracy;
    let turn_sd = accuracy.pose_error.rotation_sd_deg.into_iter().fold(0.0, f64::max).to_radians();
    let depth_m = view.x_wc.inverse_transform_point(p_w).z;
    let noise_m = COVERED_SIGMAS * accuracy.noise.sd_m(depth_m) + map.width_m(depth_m);
    let before_m = -near_m - zone.x_wz().inverse_transform_point(p_w).y;
    let up_w = zone.x_wz() * Vector3::y();
    let step_m = map.width_m(depth_m).max(f64::MIN_POSITIVE);
    let steps = (before_m / step_m).clamp(0.0, STEPS_MAX) as usize;
    let hidden = (1..=steps).map(|step| step as f64 * step_m).filter(|before_m| {
        let margin_m = noise_m + COVERED_SIGMAS * turn_sd * before_m;
        map.is_hidden(&(p_w + up_w * *before_m), margin_m)
    });
    hidden.take(COVERING).count() == COVERING
}
