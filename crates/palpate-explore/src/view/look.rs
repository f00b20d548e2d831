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
        seen.presence = region.zone().map(|zone| presence(zone, view)).unwrap_or_default();
        seen
    }
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
fn presence(zone: &Zone, view: &View) -> Vec<([f64; 2], f64)> {
    let Some([near_m, far_m]) = zone.depth_m else { return Vec::new() };
    let step_m = zone.widest_m() / SEEN_PER_SIDE as f64;
    let margin_m = view.accuracy.pose_error.position_sd_m.into_iter().fold(0.0, f64::max);
    let map = DepthMap::new(view, 0.25 * step_m);
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
