//! Signed distance from a mesh on a grid, for very many points.

use super::bvh::MeshBvh;
use super::implicit::Field;
use nalgebra::{Point3, Vector3};

/// Margin of the grid around the mesh, as a fraction of the longest side.
// heuristic: a finger's contacts with a shape somewhat larger are on the grid.
const MARGIN: f64 = 0.15;

/// Signed distance from a closed mesh, negative inside, interpolated between the corners of cubic
/// cells.
///
/// Distances at corners are exact, and a distance changes by at most 1 m per m: with cells of the
/// side h, an interpolated one errs by at most h √3 / 2. Outside of the grid it is that at the
/// nearest point of the grid, plus the distance from there.
pub struct DistanceGrid {
    low: Point3<f64>,
    cell_m: f64,
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
        let low = low - Vector3::repeat(MARGIN * longest_m);
        let sides_m = (high - low).add_scalar(MARGIN * longest_m);
        let corners: [usize; 3] =
            sides_m.map(|side_m| (side_m / cell_m).ceil() as usize + 1).into();
        let [nx, ny, nz] = corners;
        let distance_m = |i: usize| {
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64 * cell_m);
            let p = low + Vector3::new(x, y, z);
            let side = if bvh.contains(&p) { -1.0 } else { 1.0 };
            (side * bvh.closest_point(&p).distance_m) as f32
        };
        let distances_m = (0..nx * ny * nz).map(distance_m).collect();
        Self { low, cell_m, corners, distances_m }
    }

    /// Returns the interpolated distance at `p`, m, with its gradient.
    pub fn field(&self, p: &Point3<f64>) -> Field {
        let last = Vector3::from(self.corners.map(|count| (count - 1) as f64));
        let scaled = (p - self.low) / self.cell_m;
        let inner = scaled.sup(&Vector3::zeros()).inf(&last);
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

    /// On the grid of a ball, distances err by less than the bound, and gradients are those of
    /// finite differences; far outside, distances err by no more than the grid's margin.
    #[test]
    fn distances_from_a_ball() {
        let (vertices, triangles) = sphere_mesh(Point3::origin(), 0.05, 48);
        let bvh = MeshBvh::new(Mesh::new(&vertices, &triangles).unwrap().0);
        let grid = DistanceGrid::new(&bvh, 40);
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
}
