//! Neighbouring samples of the skin together, so that those far from an object are skipped at once.

use super::samples::SkinSample;
use crate::geometry::bvh::MeshBvh;
use crate::robot::finger::profile::Profile;
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::TAU;
use std::ops::Range;

/// The samples are culled in this many slabs along the finger times sectors around it (chosen).
const SLABS: usize = 8;
const SECTORS: usize = 8;

/// Neighbouring samples and a ball around their rays.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub range: Range<usize>,
    /// Around rays from the axis, and around rays from `inner_m` off it.
    pub from_axis: Ball,
    pub from_inner: Ball,
}

#[derive(Clone, Debug)]
pub(super) struct Ball {
    centre: Point3<f64>,
    radius_m: f64,
}

/// The patch to which a sample belongs: samples are sorted by it.
pub(super) fn key(profile: &Profile, sample: &SkinSample) -> usize {
    let p = sample.point();
    let along = (p.x + profile.length_m) / (profile.length_m + profile.radius_m);
    let turn = (p.y.atan2(p.z) / TAU + 0.5) * SECTORS as f64;
    let slab = ((along * SLABS as f64).max(0.0) as usize).min(SLABS - 1);
    slab * SECTORS + (turn as usize).min(SECTORS - 1)
}

/// Patches of samples sorted by their `key`, whose rays end `bulge_m` above the skin.
pub(super) fn patches(
    profile: &Profile,
    samples: &[SkinSample],
    inner_m: f64,
    bulge_m: f64,
) -> Vec<Patch> {
    let mut patches = Vec::new();
    let mut first = 0;
    for group in samples.chunk_by(|a, b| key(profile, a) == key(profile, b)) {
        patches.push(Patch {
            range: first..first + group.len(),
            from_axis: Ball::around(group, 0.0, bulge_m),
            from_inner: Ball::around(group, inner_m, bulge_m),
        });
        first += group.len();
    }
    patches
}

impl Ball {
    /// Around the rays of `samples`, from `from_m` off the axis to `bulge_m` above the skin.
    pub fn around(samples: &[SkinSample], from_m: f64, bulge_m: f64) -> Self {
        let ends = || {
            samples.iter().flat_map(|sample| {
                let to_m = sample.layers.outer_m + bulge_m;
                [from_m, to_m].map(|at_m| sample.start + sample.direction.scale(at_m))
            })
        };
        let sum: Vector3<f64> = ends().map(|end| end.coords).sum();
        let centre = Point3::from(sum / ends().count().max(1) as f64);
        let radius_m = ends().map(|end| (end - centre).norm()).fold(0.0, f64::max);
        Self { centre, radius_m }
    }

    pub fn meets(&self, bvh: &MeshBvh, x_wt: &Isometry3<f64>) -> bool {
        bvh.touches(&(x_wt * self.centre), self.radius_m)
    }
}
