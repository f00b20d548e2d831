//! Grid of equal cells in a plane, and the nearest surface of a mesh over each.

use nalgebra::{Isometry3, Point3};
use palpate_geometry::bvh::MeshBvh;

/// Grid of equal cells in the plane z = 0 of a frame `P`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Centre of the first cell.
    pub first_m: [f64; 2],
    /// Sides of a cell.
    pub step_m: [f64; 2],
    /// Numbers of cells along x and y.
    pub counts: [usize; 2],
}

impl Window {
    /// Creates a grid of `counts` cells over a rectangle of this size about the origin.
    pub fn over(size_m: [f64; 2], counts: [usize; 2]) -> Self {
        let step_m = [0, 1].map(|axis| size_m[axis] / counts[axis] as f64);
        let first_m = [0, 1].map(|axis| 0.5 * (step_m[axis] - size_m[axis]));
        Self { first_m, step_m, counts }
    }

    /// Creates the smallest grid of `counts` square cells that covers the rectangle between two
    /// corners, with the same centre.
    pub fn around(low_m: [f64; 2], high_m: [f64; 2], counts: [usize; 2]) -> Self {
        let side = |axis: usize| (high_m[axis] - low_m[axis]) / counts[axis] as f64;
        let step_m = side(0).max(side(1));
        let first_m = [0, 1].map(|axis| {
            0.5 * (low_m[axis] + high_m[axis]) - 0.5 * (counts[axis] as f64 - 1.0) * step_m
        });
        Self { first_m, step_m: [step_m; 2], counts }
    }

    /// Area of a cell.
    pub fn cell_m2(&self) -> f64 {
        self.step_m[0] * self.step_m[1]
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.counts[0] * self.counts[1]
    }

    /// Whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Centre of a cell; rows along x.
    pub fn centre_m(&self, cell: usize) -> [f64; 2] {
        let at = [cell % self.counts[0], cell / self.counts[0]];
        [0, 1].map(|axis| self.first_m[axis] + at[axis] as f64 * self.step_m[axis])
    }

    /// Corners of the rectangle around the cells, grown by `margin_m`, whose values are positive.
    pub fn bounds_of_positive(&self, values: &[f64], margin_m: f64) -> Option<[[f64; 2]; 2]> {
        let positive = (0..self.len()).filter(|cell| values[*cell] > 0.0);
        let around = positive.map(|cell| self.centre_m(cell)).map(|at| [at, at]);
        let both = around.reduce(|[low, high], [at, _]| {
            [[low[0].min(at[0]), low[1].min(at[1])], [high[0].max(at[0]), high[1].max(at[1])]]
        });
        both.map(|[low, high]| [low.map(|low| low - margin_m), high.map(|high| high + margin_m)])
    }

    /// Whether the cell at a place has a positive value.
    pub fn is_positive(&self, values: &[f64], at_m: [f64; 2]) -> bool {
        let cell = [0, 1].map(|axis| {
            let at = ((at_m[axis] - self.first_m[axis]) / self.step_m[axis]).round();
            (0.0..self.counts[axis] as f64).contains(&at).then_some(at as usize)
        });
        let [Some(column), Some(row)] = cell else { return false };
        values.get(row * self.counts[0] + column).is_some_and(|value| *value > 0.0)
    }

    /// Interpolates values at the cells bilinearly; `None` outside their centres.
    pub fn interpolate(&self, values: &[f64], at_m: [f64; 2]) -> Option<f64> {
        let mut cell = [0; 2];
        let mut share = [0.0; 2];
        for axis in 0..2 {
            let at = (at_m[axis] - self.first_m[axis]) / self.step_m[axis];
            let last = self.counts[axis].checked_sub(2)?;
            if !(0.0..=(last + 1) as f64).contains(&at) {
                return None;
            }
            cell[axis] = (at as usize).min(last);
            share[axis] = at - cell[axis] as f64;
        }
        let row = |row: usize| {
            let from = (cell[1] + row) * self.counts[0] + cell[0];
            values[from] + (values[from + 1] - values[from]) * share[0]
        };
        Some(row(0) + (row(1) - row(0)) * share[1])
    }

    /// Writes to `heights_m` the smallest z ≥ `back_m` of a mesh in `W` at the centre of each cell,
    /// infinite where there is none above the grid; `x_pw` is the pose of `W` in `P`.
    pub fn heights(
        &self,
        mesh: &MeshBvh,
        x_pw: &Isometry3<f64>,
        back_m: f64,
        heights_m: &mut Vec<f64>,
    ) {
        heights_m.clear();
        heights_m.resize(self.len(), f64::INFINITY);
        let reach = [0, 1].map(|axis| 0.5 * self.counts[axis] as f64 * self.step_m[axis]);
        let middle = [0, 1].map(|axis| self.first_m[axis] + reach[axis] - 0.5 * self.step_m[axis]);
        let radius_m = reach[0].hypot(reach[1]).hypot(back_m);
        let centre_w = x_pw.inverse_transform_point(&Point3::new(middle[0], middle[1], 0.0));
        mesh.triangles_near(&centre_w, radius_m, |corners_w| {
            self.draw(corners_w.map(|corner| x_pw * corner), back_m, heights_m);
        });
    }

    /// Lowers the heights to those of a triangle in `P`.
    fn draw(&self, [a, b, c]: [Point3<f64>; 3], back_m: f64, heights_m: &mut [f64]) {
        let range = |axis: usize| {
            let (low, high) =
                (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
            let cell = |at_m: f64| (at_m - self.first_m[axis]) / self.step_m[axis];
            let end = (cell(high).floor() + 1.0).clamp(0.0, self.counts[axis] as f64);
            cell(low).ceil().clamp(0.0, end) as usize..end as usize
        };
        let (columns, rows) = (range(0), range(1));
        let (u, v) = (b - a, c - a);
        let double_m2 = u.x * v.y - u.y * v.x;
        // A triangle seen from its edge has no area.
        if columns.is_empty() || rows.is_empty() || double_m2 == 0.0 {
            return;
        }
        for row in rows {
            for column in columns.clone() {
                let cell = row * self.counts[0] + column;
                let at = self.centre_m(cell);
                let [x, y] = [at[0] - a.x, at[1] - a.y];
                // Barycentric coordinates of the corners b and c.
                let [s, t] = [(x * v.y - y * v.x) / double_m2, (u.x * y - u.y * x) / double_m2];
                let z = a.z + s * u.z + t * v.z;
                if s >= 0.0 && t >= 0.0 && s + t <= 1.0 && z >= back_m {
                    heights_m[cell] = heights_m[cell].min(z);
                }
            }
        }
    }
}
