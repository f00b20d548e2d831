//! Where a finger that goes straight at a whole object, from any side, can touch it.

use nalgebra::{UnitVector3, Vector3};
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::primitives::{nearest_on_segment, normal};
use palpate_geometry::spread::{Spot, directions};
use palpate_geometry::sweep::Capsule;
use rayon::prelude::*;

/// Distance between surface and resting finger that still counts as touching, as a share of the
/// diagonal of the object's box; chosen, a tenth of the errors that a belief reaches.
const TOLERANCE: f64 = 6e-4;

/// Directions all around from which the finger comes, beside the surface's own normal. Chosen: of
/// twelve objects of the suite, each with a finger of 7 mm and of 3.5 mm, the reachable share is
/// below that of 1024 directions by 0.2 % of the area in the median and by 1.8 % at most, between
/// the teeth of a gear.
const DIRECTIONS: usize = 128;

/// How the finger goes at an object.
#[derive(Clone, Copy)]
pub struct Reach<'a> {
    /// Radius of its hemisphere and cylinder.
    pub radius_m: f64,
    /// From its hemisphere's centre to its cylinder's far end, in `W`, where it comes along a
    /// direction.
    pub axis_w: &'a (dyn Fn(&UnitVector3<f64>) -> Vector3<f64> + Sync),
    /// Lowest z in `W` to which it may come; none where nothing is below.
    pub lowest_m: Option<f64>,
}

impl Reach<'_> {
    /// Whether it can touch the surface at each of `spots`: on its straight way from outside the
    /// ball around the mesh, to where its hemisphere would rest on the surface there, it is held up
    /// by nothing, or so late that it is there all but the tolerance. Ways are tried along the
    /// normal and along an even spread of directions on its side.
    ///
    /// The mesh is closed; what it takes for its outside is what may be touched.
    pub fn touches(&self, mesh: &MeshBvh, spots: &[Spot]) -> Vec<bool> {
        let spread: Vec<UnitVector3<f64>> = directions(DIRECTIONS).collect();
        let (low, high) = mesh.mesh().bounds();
        let tolerance_m = TOLERANCE * (high - low).norm();
        let touches = |spot: &Spot| {
            let corners = mesh.mesh().corners(spot.triangle as usize);
            let outward = UnitVector3::new_unchecked(normal(&corners));
            let tip_w = spot.point + outward.scale(self.radius_m);
            // A tip no farther than this from there is within the tolerance of the spot, along the
            // tangent; so this much of it is free wherever it may rest, and the way beyond too.
            let aside_m = (tolerance_m * (2.0 * self.radius_m + tolerance_m)).sqrt();
            if mesh.touches(&tip_w, self.radius_m - aside_m) {
                return false;
            }
            let mut ways: Vec<(f64, UnitVector3<f64>)> = (spread.iter())
                .map(|back| (outward.dot(back), *back))
                .filter(|(cosine, _)| *cosine > 0.0)
                .collect();
            ways.push((1.0, outward));
            ways.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
            ways.iter().any(|(_, back)| {
                mesh.ray(&(tip_w + back.scale(aside_m)), back, f64::MAX).is_none()
                    && self.rests_at((mesh, tolerance_m), spot, &tip_w.coords, back)
            })
        };
        spots.par_iter().map(touches).collect()
    }

    /// Whether it comes to rest at `spot` if its tip goes to `tip_w` from `back` there.
    fn rests_at(
        &self,
        (mesh, tolerance_m): (&MeshBvh, f64),
        spot: &Spot,
        tip_w: &Vector3<f64>,
        back: &UnitVector3<f64>,
    ) -> bool {
        let ahead = -*back;
        let axis_w = (self.axis_w)(&ahead);
        let (low, high) = mesh.mesh().bounds();
        let middle_w = (low.coords + high.coords) / 2.0;
        // All of it is beyond a plane that the ball around the mesh does not reach.
        let clear_m = (high - low).norm() / 2.0 + self.radius_m + axis_w.norm() + tolerance_m;
        let way_m = clear_m - (tip_w - middle_w).dot(back);
        let at = |way_m: f64| {
            let p0_w = (tip_w + back.scale(way_m)).into();
            Capsule { p0_w, p1_w: p0_w + axis_w, radius_m: self.radius_m }
        };
        let start = at(way_m);
        let Some(hit) = mesh.sweep(&start, &ahead, way_m + tolerance_m) else { return false };
        let rest = at(way_m - hit.travel_m);
        let on_axis = nearest_on_segment(&spot.point, &rest.p0_w, &rest.p1_w);
        let is_above = |capsule: &Capsule| {
            let lowest_m = capsule.p0_w.z.min(capsule.p1_w.z) - capsule.radius_m;
            self.lowest_m.is_none_or(|limit_m| lowest_m >= limit_m)
        };
        (on_axis - spot.point).norm() - self.radius_m <= tolerance_m
            && is_above(&start)
            && is_above(&rest)
    }
}
