//! The object as a height field over the zone: a surface that is explored along one direction is
//! one, and MuJoCo collides it as it is.

use super::{CONTACT, list};
use crate::sim::Environment;
use crate::sim::environment::{APPROACH_W, CLEARANCE_M, Shape};
use nalgebra::Point3;

/// Heights along each side. On the bird, 101 were measured to place a finger's contact within
/// 0.004 mm in the median and 0.03 mm at most; 51 within 0.012 and 0.12 mm.
const PER_SIDE: usize = 101;

/// Thickness of the ground under the lowest height; chosen.
const GROUND_M: f64 = 0.01;

/// Asset and geom of what the finger can meet from targets in the zone; places where −y meets
/// nothing lie as low as the lowest that do.
pub(super) fn obstacle(environment: &Environment) -> Option<String> {
    let Shape::Mesh { bvh, .. } = environment.shape() else { return None };
    let (low, high) = bvh.mesh().bounds();
    let scene = environment.scene();
    let margin_m = scene.finger.radius_m + scene.finger.length_m;
    let side = |[low, high]: [f64; 2]| [low - margin_m, high + margin_m];
    let (x_m, z_m) = (side(scene.zone.x_m), side(scene.zone.z_m.unwrap_or_default()));
    let at =
        |[low, high]: [f64; 2], i: usize| low + (high - low) * i as f64 / (PER_SIDE - 1) as f64;
    let start_y = high.y + CLEARANCE_M;
    let heights: Vec<Option<f64>> = (0..PER_SIDE * PER_SIDE)
        .map(|k| {
            let from = Point3::new(at(x_m, k % PER_SIDE), start_y, at(z_m, k / PER_SIDE));
            let hit = bvh.ray(&from, &APPROACH_W, start_y - low.y + CLEARANCE_M);
            hit.map(|hit| hit.point.y)
        })
        .collect();
    let lowest = heights.iter().flatten().copied().reduce(f64::min)?;
    let highest = heights.iter().flatten().copied().fold(lowest, f64::max);
    // MuJoCo stretches heights to 0..1 and refuses a field without any.
    let rise_m = (highest - lowest).max(1e-6);
    let values = heights.iter().map(|height| height.map_or(0.0, |y| (y - lowest) / rise_m));
    let half = |[low, high]: [f64; 2]| (high - low) / 2.0;
    let middle = |[low, high]: [f64; 2]| (high + low) / 2.0;
    // Its rows run against z and its heights along y: turned by −90° about x.
    Some(format!(
        r#"  <asset><hfield name="object" nrow="{PER_SIDE}" ncol="{PER_SIDE}" size="{} {} {rise_m} {GROUND_M}" elevation="{}"/></asset>
  <worldbody><geom name="object" type="hfield" hfield="object" pos="{} {lowest} {}" quat="1 -1 0 0" {CONTACT}/></worldbody>
"#,
        half(x_m),
        half(z_m),
        list(values),
        middle(x_m),
        middle(z_m),
    ))
}
