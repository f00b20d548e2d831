//! The object as a height field over the zone: a surface that is explored along one direction is
//! one, and MuJoCo collides it as it is.

use super::text::{CONTACT, list, pose};
use crate::sim::Environment;
use crate::sim::environment::{CLEARANCE_M, Shape};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// Heights along each side. On the bird, 101 were measured to place a finger's contact within
/// 0.004 mm in the median and 0.03 mm at most; 51 within 0.012 and 0.12 mm.
const PER_SIDE: usize = 101;

/// Thickness of the ground under the lowest height; chosen.
const GROUND_M: f64 = 0.01;

/// Asset and geom of what the finger can meet from targets in the zone; places where the approach
/// meets nothing lie as low as the lowest that do.
pub(super) fn obstacle(environment: &Environment) -> Option<String> {
    let Shape::Mesh { bvh, .. } = environment.shape() else { return None };
    let (scene, zone) = (environment.scene(), environment.task().zone()?);
    let margin_m = scene.finger.radius_m + scene.finger.length_m;
    let side = |[low, high]: [f64; 2]| [low - margin_m, high + margin_m];
    let (x_m, z_m) = (side(zone.x_m), side(zone.z_m.unwrap_or_default()));
    let at =
        |[low, high]: [f64; 2], i: usize| low + (high - low) * i as f64 / (PER_SIDE - 1) as f64;
    let x_wz = zone.x_wz();
    let ahead_w = zone.ahead_w();
    let [near_m, far_m] = environment.task().depth_m();
    let start_y_m = -near_m + CLEARANCE_M;
    let heights: Vec<Option<f64>> = (0..PER_SIDE * PER_SIDE)
        .map(|k| {
            let from_z = Point3::new(at(x_m, k % PER_SIDE), start_y_m, at(z_m, k / PER_SIDE));
            let way_m = start_y_m + far_m + CLEARANCE_M;
            let hit = bvh.ray(&(x_wz * from_z), &ahead_w, way_m);
            hit.map(|hit| x_wz.inverse_transform_point(&hit.point).y)
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
    let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2);
    let middle_z = Translation3::new(middle(x_m), lowest, middle(z_m));
    Some(format!(
        r#"  <asset><hfield name="object" nrow="{PER_SIDE}" ncol="{PER_SIDE}" size="{} {} {rise_m} {GROUND_M}" elevation="{}"/></asset>
  <worldbody><geom name="object" type="hfield" hfield="object" {} {CONTACT}/></worldbody>
"#,
        half(x_m),
        half(z_m),
        list(values),
        pose(&(x_wz * Isometry3::from_parts(middle_z, turned))),
    ))
}
