//! Patches of neighbouring skin samples, so that those far from an object are skipped together.

use super::samples::SkinSample;
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_explore::robot::finger::profile::Profile;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::bvh::MeshParts;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::sweep::Capsule;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

// heuristic: samples are culled in this many slabs along the finger times sectors around it.
const SLABS: usize = 8;
const SECTORS: usize = 8;

// Fraction of the hull's radius around the axis: while it is free of the object, rays start there
// instead of on the axis.
// heuristic: inside the core.
const INNER: f64 = 0.5;

// Margin as a fraction of the hull's radius: parts farther away are not tested again before the
// finger has moved as far.
// heuristic: a few ticks of an approach.
const MARGIN: f64 = 0.1;

/// Factor below 1 by more than rounding.
const BELOW_ONE: f64 = 0.999;

/// Patches of all rays of a skin.
#[derive(Clone, Debug)]
pub(super) struct Patches {
    patches: Vec<Patch>,
    whole: Ball,
    inner: Capsule,
    margin_m: f64,
    /// Largest distance of a ball's centre or of the axis from the origin of `T`.
    reach_m: f64,
}

/// Patch of neighbouring samples with a ball around their rays.
#[derive(Clone, Debug)]
struct Patch {
    range: Range<usize>,
    /// Ball around the rays from the axis, and around the rays from `inner` off it.
    from_axis: Ball,
    from_inner: Ball,
}

#[derive(Clone, Debug)]
struct Ball {
    centre: Point3<f64>,
    radius_m: f64,
}

/// Patches within the margin of an object in one pose: no others can meet the object until the
/// finger has moved by the margin. It is the memory of one trial.
#[derive(Clone, Debug, Default)]
pub(super) struct NearbyPatches {
    mesh: Option<Arc<Mesh>>,
    x_wt: Isometry3<f64>,
    /// Patches, each with the parts of the object within the margin of it.
    near: Vec<(usize, MeshParts)>,
    /// Whether the object was within the margin of the inner capsule.
    is_deep: bool,
}

/// Returns the patch of a sample: samples are sorted by it.
pub(super) fn key(profile: &Profile, sample: &SkinSample) -> usize {
    let p = sample.point();
    let along = (p.x + profile.length_m) / (profile.length_m + profile.radius_m);
    let turn = (p.y.atan2(p.z) / TAU + 0.5) * SECTORS as f64;
    let slab = ((along * SLABS as f64).max(0.0) as usize).min(SLABS - 1);
    slab * SECTORS + (turn as usize).min(SECTORS - 1)
}

impl Patches {
    /// Creates the patches of samples sorted by their [`key`], whose rays end `bulge_m` above the
    /// skin.
    pub fn new(profile: &Profile, samples: &[SkinSample], bulge_m: f64) -> Self {
        let inner = Capsule {
            p0_w: Point3::origin(),
            p1_w: Point3::new(-profile.length_m, 0.0, 0.0),
            radius_m: INNER * profile.radius_m,
        };
        let mut patches = Vec::new();
        let mut first = 0;
        for group in samples.chunk_by(|a, b| key(profile, a) == key(profile, b)) {
            patches.push(Patch {
                range: first..first + group.len(),
                from_axis: Ball::around(group, 0.0, bulge_m),
                from_inner: Ball::around(group, inner.radius_m, bulge_m),
            });
            first += group.len();
        }
        let whole = Ball::around(samples, 0.0, bulge_m);
        let centres = (patches.iter())
            .flat_map(|patch| [&patch.from_axis, &patch.from_inner])
            .chain([&whole])
            .map(|ball| ball.centre.coords.norm());
        let reach_m = centres.fold(profile.length_m, f64::max);
        Self { patches, whole, inner, margin_m: MARGIN * profile.radius_m, reach_m }
    }

    /// Allocates memory for [`near`](Self::near).
    pub fn nearby_patches(&self) -> NearbyPatches {
        NearbyPatches { near: Vec::with_capacity(self.patches.len()), ..NearbyPatches::default() }
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.patches.as_slice())
    }

    /// Returns the ranges of samples whose rays may meet the object in pose `x_wt`, in order. Each
    /// has the parts of the object that it may meet, and the distance off the axis at which the
    /// rays may start.
    pub fn near<'a>(
        &'a self,
        bvh: &'a MeshBvh,
        x_wt: &'a Isometry3<f64>,
        vicinity: &'a mut NearbyPatches,
    ) -> (f64, impl Iterator<Item = (&'a Range<usize>, &'a MeshParts)>) {
        if !vicinity.is_valid(self, bvh, x_wt) {
            self.find_nearby(bvh, x_wt, vicinity);
        }
        let is_deep = vicinity.is_deep && self.is_deep(bvh, x_wt, 0.0);
        let near = vicinity.near.iter().map(|(i, near)| (&self.patches[*i], near));
        let met = near.filter(move |(patch, near)| {
            let ball = if is_deep { &patch.from_axis } else { &patch.from_inner };
            ball.meets(bvh, near, x_wt, 0.0)
        });
        let met = met.map(|(patch, near)| (&patch.range, near));
        (if is_deep { 0.0 } else { self.inner.radius_m }, met)
    }

    /// Finds the patches within the margin.
    fn find_nearby(&self, bvh: &MeshBvh, x_wt: &Isometry3<f64>, vicinity: &mut NearbyPatches) {
        let margin_m = self.margin_m;
        vicinity.mesh = Some(bvh.mesh().clone());
        vicinity.x_wt = *x_wt;
        vicinity.near.clear();
        vicinity.is_deep = false;
        let around = self.whole.nearby(bvh, x_wt, margin_m);
        if !self.whole.meets(bvh, &around, x_wt, margin_m) {
            return;
        }
        vicinity.is_deep = self.is_deep(bvh, x_wt, margin_m);
        let is_deep = vicinity.is_deep;
        let near = self.patches.iter().enumerate().filter_map(|(i, patch)| {
            let ball = if is_deep { &patch.from_axis } else { &patch.from_inner };
            let is_met = ball.meets(bvh, &around, x_wt, margin_m);
            is_met.then(|| (i, ball.nearby(bvh, x_wt, margin_m)))
        });
        vicinity.near.extend(near);
    }

    /// Returns whether the object is within `margin_m` of the inner capsule.
    fn is_deep(&self, bvh: &MeshBvh, x_wt: &Isometry3<f64>, margin_m: f64) -> bool {
        let Capsule { p0_w, p1_w, radius_m } = self.inner;
        let radius_m = radius_m + margin_m;
        bvh.intersects(&Capsule { p0_w: x_wt * p0_w, p1_w: x_wt * p1_w, radius_m })
    }
}

impl NearbyPatches {
    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        self.near.capacity() * size_of::<(usize, MeshParts)>()
    }

    /// Returns whether the finger is still within the margin of the pose in which the patches were
    /// found.
    fn is_valid(&self, patches: &Patches, bvh: &MeshBvh, x_wt: &Isometry3<f64>) -> bool {
        let is_same = self.mesh.as_ref().is_some_and(|mesh| Arc::ptr_eq(mesh, bvh.mesh()));
        let way = x_wt.translation.vector - self.x_wt.translation.vector;
        let turn_rad = self.x_wt.rotation.angle_to(&x_wt.rotation);
        is_same && way.norm() + patches.reach_m * turn_rad < BELOW_ONE * patches.margin_m
    }
}

impl Ball {
    /// Returns the ball around the rays of `samples`, from `from_m` off the axis to `bulge_m` above
    /// the skin.
    fn around(samples: &[SkinSample], from_m: f64, bulge_m: f64) -> Self {
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

    /// Returns the parts of the object that may be within `margin_m` of the ball.
    fn nearby(&self, bvh: &MeshBvh, x_wt: &Isometry3<f64>, margin_m: f64) -> MeshParts {
        bvh.nearby(&(x_wt * self.centre), self.radius_m + margin_m)
    }

    /// Returns whether the object, of which only the parts in `near` can be close, is within
    /// `margin_m` of the ball.
    fn meets(&self, bvh: &MeshBvh, near: &MeshParts, x_wt: &Isometry3<f64>, margin_m: f64) -> bool {
        bvh.touches_near(near, &(x_wt * self.centre), self.radius_m + margin_m)
    }
}
