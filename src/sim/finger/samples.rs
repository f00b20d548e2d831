//! Points spread evenly over the fingertip's outer skin.

use nalgebra::{Point3, UnitVector3, Vector3};
use palpate_explore::robot::finger::profile::{Layers, Profile};
use std::f64::consts::TAU;

/// Golden section of a turn: successive points never line up.
const GOLDEN_TURN: f64 = 0.381_966_011_250_105_1;

/// Step of the central differences over the skin: along it as a part of the samples' distance,
/// which near the apex is where the profile bends; around it in radians.
const STEP: f64 = 0.05;
const STEP_RAD: f64 = 1e-4;

/// One point of the skin with the ray from the axis through it, in `T`.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinSample {
    /// Where the ray leaves the axis.
    pub start: Point3<f64>,
    /// Direction of the ray.
    pub direction: UnitVector3<f64>,
    /// Layers along the ray.
    pub layers: Layers,
    /// Outward normal of the skin.
    pub normal: UnitVector3<f64>,
    /// Area of skin it stands for.
    pub area_m2: f64,
    /// Its node of a shell; none outside of one.
    pub node: Option<usize>,
}

impl SkinSample {
    /// The point of the skin.
    pub fn point(&self) -> Point3<f64> {
        self.start + self.direction.scale(self.layers.outer_m)
    }

    /// Its area seen along the ray: times a displacement along the ray this is volume.
    pub fn section_m2(&self) -> f64 {
        self.area_m2 * self.normal.dot(&self.direction).max(0.0)
    }
}

/// `count` samples, deterministic.
///
/// Equal steps in x cut equal areas out of a cylinder and out of a sphere (Archimedes), so a
/// Fibonacci lattice over x and the turn is even over a capsule; the profile then stretches each
/// area by the local ratio of surfaces.
pub fn spread(profile: &Profile, count: usize) -> Vec<SkinSample> {
    let (length_m, radius_m) = (profile.length_m, profile.radius_m);
    let cell_m = (length_m + radius_m) / count as f64;
    let step_m = STEP * cell_m;
    (0..count)
        .map(|i| {
            let x_m = -length_m + (i as f64 + 0.5) * cell_m;
            let turn = TAU * (i as f64 * GOLDEN_TURN).fract();
            let at = |dx_m: f64, dturn: f64| profile.skin_t(x_m + dx_m, turn + dturn);
            let along: Vector3<f64> = (at(step_m, 0.0) - at(-step_m, 0.0)) / (2.0 * step_m);
            let around = (at(0.0, STEP_RAD) - at(0.0, -STEP_RAD)) / (2.0 * STEP_RAD);
            let (start, direction) = profile.ray(x_m, turn);
            let stretched = around.cross(&along);
            let normal = UnitVector3::try_new(stretched, 0.0).unwrap_or(direction);
            let normal = if normal.dot(&direction) < 0.0 { -normal } else { normal };
            SkinSample {
                start,
                direction,
                layers: profile.layers(start.x, &direction),
                normal,
                area_m2: stretched.norm() * cell_m * TAU,
                node: None,
            }
        })
        .collect()
}
