//! Signed distance from a mesh on a grid, for very many points.

use super::bvh::MeshBvh;
use super::implicit::Field;
use super::sweep::Capsule;
use nalgebra::{Point3, UnitVector3, Vector3};

/// Margin of the grid around the mesh, as a fraction of the longest side.
// heuristic: a finger's contacts with a shape somewhat larger are on the grid.
const MARGIN: f64 = 0.15;

/// Gap at which a sweep has met the surface, over the side of a cell.
// heuristic: below what the grid resolves.
const SHORTEST: f64 = 0.05;

/// First contact of a moving capsule with the surface that a grid shows.
#[derive(Clone, Copy, Debug)]
pub struct GridHit {
    /// Travel of the capsule until contact, m.
    pub travel_m: f64,
    /// Point of the surface.
    pub point: Point3<f64>,
    /// Unit outward normal.
    pub normal: Vector3<f64>,
}

/// Signed distance from a closed mesh, negative inside, interpolated between the corners of cubic
/// cells.
///
/// Distances at corners are exact, and a distance changes by at most 1 m per m: with cells of the
/// side h, an interpolated one errs by at most h √3 / 2. Outside of the grid it is that at the
/// nearest point of the grid, plus the distance from there.
pub struct DistanceGrid {
    low: Point3<f64>,
    cell_m: f64,
    margin_m: f64,
    /// Number of corners along each axis.
    corners: [usize; 3],
    /// Distances at the corners, m, x first.
    distances_m: Vec<f32>,
}

impl DistanceGrid {
    /// Samples the distance from `bvh` on `cells` along its longest side.
    pub fn new(bvh: &MeshBvh, cells: u32) -> Self {
        let (low, high) = bvh.mesh().bounds();
        let cells = f64::from(cells.max(1));
        let longest_m = (high - low).max().max(f64::MIN_POSITIVE);
        let cell_m = longest_m * (1.0 + 2.0 * MARGIN) / cells;
        let margin_m = MARGIN * longest_m;
        let low = low - Vector3::repeat(margin_m);
        let sides_m = (high - low).add_scalar(margin_m);
        let corners: [usize; 3] =
            sides_m.map(|side_m| (side_m / cell_m).ceil() as usize + 1).into();
        let [nx, ny, nz] = corners;
        let mut distances_m: Vec<f32> = Vec::with_capacity(nx * ny * nz);
        for i in 0..nx * ny * nz {
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64 * cell_m);
            let p = low + Vector3::new(x, y, z);
            let distance_m = bvh.closest_point(&p).distance_m;
            // Between corners with a surface farther than a cell there is none.
            let before = distances_m.last().filter(|_| i % nx > 0 && distance_m > cell_m);
            let is_inside = before.map_or_else(|| bvh.contains(&p), |before| *before < 0.0);
            distances_m.push(if is_inside { -distance_m } else { distance_m } as f32);
        }
        Self { low, cell_m, margin_m, corners, distances_m }
    }

    /// Returns the travel at which a capsule that moves along `direction` by at most `max_travel_m`
    /// first meets the surface, as far as the grid shows it, with the nearest point of the surface
    /// and the normal there; 0 if it overlaps from the start.
    ///
    /// Steps are as long as the distance from the axis, which is looked at in steps of the radius.
    pub fn sweep(
        &self,
        capsule: &Capsule,
        direction: &UnitVector3<f64>,
        max_travel_m: f64,
    ) -> Option<GridHit> {
        let leading = capsule.leading(direction);
        let capsule = leading.as_ref().unwrap_or(capsule);
        let axis = capsule.p1_w - capsule.p0_w;
        let least_m = SHORTEST * self.cell_m;
        let count = (axis.norm() / capsule.radius_m.max(self.cell_m)).ceil().min(64.0) as usize;
        let mut travel_m = 0.0;
        while travel_m <= max_travel_m {
            let places = (0..=count).map(|i| {
                let share = i as f64 / count.max(1) as f64;
                capsule.p0_w + axis * share + direction.scale(travel_m)
            });
            let (mut shown_m, mut lower_m, mut nearest) = (f64::INFINITY, f64::INFINITY, None);
            for p in places {
                let [shown, lower] = self.distances_m(&p);
                if shown < shown_m {
                    (shown_m, nearest) = (shown, Some(p));
                }
                lower_m = lower_m.min(lower);
            }
            let p = nearest?;
            if shown_m - capsule.radius_m < least_m {
                let Field { value, gradient } = self.field(&p);
                let normal = gradient.try_normalize(1e-9).unwrap_or(-direction.into_inner());
                return Some(GridHit { travel_m, point: p - normal * value, normal });
            }
            travel_m += (lower_m - capsule.radius_m).max(least_m);
        }
        None
    }

    /// Returns the distance that the grid shows at `p`, and a lower bound of it, m: the mesh is a
    /// margin inside of the grid.
    fn distances_m(&self, p: &Point3<f64>) -> [f64; 2] {
        let ([scaled, inner], shown_m) = (self.scaled(p), self.field(p).value);
        let beyond_m = (scaled - inner).norm() * self.cell_m;
        [shown_m, if beyond_m > 0.0 { beyond_m + self.margin_m } else { shown_m }]
    }

    /// Returns `p`, and the point of the grid nearest to it, in cells from the first corner.
    fn scaled(&self, p: &Point3<f64>) -> [Vector3<f64>; 2] {
        let last = Vector3::from(self.corners.map(|count| (count - 1) as f64));
        let scaled = (p - self.low) / self.cell_m;
        [scaled, scaled.sup(&Vector3::zeros()).inf(&last)]
    }

    /// Returns the interpolated distance at `p`, m, with its gradient.
    pub fn field(&self, p: &Point3<f64>) -> Field {
        let [scaled, inner] = self.scaled(p);
        let [i, j, k]: [usize; 3] =
            std::array::from_fn(|axis| (inner[axis] as usize).min(self.corners[axis].max(2) - 2));
        let [u, v, w] = [inner.x - i as f64, inner.y - j as f64, inner.z - k as f64];
        let [nx, ny, _] = self.corners;
        let first = i + nx * (j + ny * k);
        let at = |corner: usize| f64::from(self.distances_m[first + corner]);
        let between = |from: f64, to: f64, share: f64| from + share * (to - from);
        // Along x on the four edges of the cell, then along y, then along z.
        let edges = [0, nx, nx * ny, nx * ny + nx].map(|edge| [at(edge), at(edge + 1)]);
        let x = edges.map(|[from, to]| between(from, to, u));
        let slopes = edges.map(|[from, to]| to - from);
        let y = [between(x[0], x[1], v), between(x[2], x[3], v)];
        let value = between(y[0], y[1], w);
        let gradient = Vector3::new(
            between(between(slopes[0], slopes[1], v), between(slopes[2], slopes[3], v), w),
            between(x[1] - x[0], x[3] - x[2], w),
            y[1] - y[0],
        );
        let beyond = (scaled - inner) * self.cell_m;
        let beyond_m = beyond.norm();
        match beyond_m > 0.0 {
            true => Field { value: value + beyond_m, gradient: beyond / beyond_m },
            false => Field { value, gradient: gradient / self.cell_m },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::solids::sphere_mesh;
    use proptest::prelude::*;
    use std::sync::LazyLock;

    fn ball() -> (MeshBvh, DistanceGrid) {
        let (vertices, triangles) = sphere_mesh(Point3::origin(), 0.05, 48);
        let bvh = MeshBvh::new(Mesh::new(&vertices, &triangles).unwrap().0);
        let grid = DistanceGrid::new(&bvh, 40);
        (bvh, grid)
    }

    /// On the grid of a ball, distances err by less than the bound, and gradients are those of
    /// finite differences; far outside, distances err by no more than the grid's margin.
    #[test]
    fn distances_from_a_ball() {
        let (_, grid) = ball();
        let bound_m = 0.5 * 3f64.sqrt() * grid.cell_m;
        for n in 1..500 {
            let number = |k: f64| (f64::from(n) * k).fract() * 2.0 - 1.0;
            let p = Point3::new(number(0.618_034), number(0.754_878), number(0.569_84)) * 0.08;
            let expected_m = p.coords.norm() - 0.05;
            let Field { value, gradient } = grid.field(&p);
            let is_on = (p.coords.amax()) < 0.05 + MARGIN * 0.1;
            let most_m = if is_on { bound_m } else { MARGIN * 0.1 };
            assert!((value - expected_m).abs() < most_m + 1e-4, "{p}: {value}, {expected_m}");
            for axis in 0..3 {
                let step = Vector3::ith(axis, 1e-7);
                let [ahead, behind] = [p + step, p - step].map(|p| grid.field(&p).value);
                let slope = (ahead - behind) / 2e-7;
                assert!(!is_on || (slope - gradient[axis]).abs() < 1e-3, "{p} {axis}");
            }
        }
    }

    proptest! {
        /// A capsule meets a ball on the grid where it meets the mesh, but for the grid's error,
        /// and where it passes far beside it, on neither.
        #[test]
        fn sweeps_are_those_of_the_mesh(
            from in prop::array::uniform3(-1f64..1.0),
            to in prop::array::uniform3(-0.07f64..0.07),
            axis in prop::array::uniform3(-0.1f64..0.1),
            radius_m in 0.002f64..0.03,
        ) {
            static BALL: LazyLock<(MeshBvh, DistanceGrid)> = LazyLock::new(ball);
            let (bvh, grid) = &*BALL;
            let from = Vector3::from(from);
            prop_assume!(from.norm() > 0.2);
            let start = Point3::from(from.normalize() * 0.3);
            let direction = UnitVector3::new_normalize(Point3::from(to) - start);
            let tail = start + Vector3::from(axis) - direction.scale(0.1);
            let capsule = Capsule { p0_w: start, p1_w: tail, radius_m };
            let [exact, found] = [
                bvh.sweep(&capsule, &direction, 0.5).map(|hit| hit.travel_m),
                grid.sweep(&capsule, &direction, 0.5).map(|hit| hit.travel_m),
            ];
            match (exact, found) {
                (Some(exact_m), Some(found_m)) => {
                    let at = capsule.translated(&direction.scale(found_m));
                    let gap_m = bvh.nearest_to_axis(&Capsule { radius_m: 1.0, ..at });
                    let gap_m = gap_m.map_or(1.0, |(a, b)| (a - b).norm()) - radius_m;
                    prop_assert!(gap_m.abs() < 2.5e-3, "{gap_m}, {exact_m} {found_m}");
                }
                (None, None) => {}
                // Within the grid's error of a graze.
                (exact, _) => {
                    let wider = Capsule { radius_m: radius_m + 2.5e-3, ..capsule };
                    let slimmer = Capsule { radius_m: radius_m - 1.5e-3, ..capsule };
                    let grazes = match exact {
                        Some(_) => bvh.sweep(&slimmer, &direction, 0.5).is_none(),
                        None => bvh.sweep(&wider, &direction, 0.5).is_some(),
                    };
                    prop_assert!(grazes);
                }
            }
        }
    }
}
