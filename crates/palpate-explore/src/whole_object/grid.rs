//! Triangulation of a field's zero set: surface nets (Gibson 1998) on an adaptive grid that is fine
//! only near the surface; and selection of the components that were touched.

use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use foldhash::{HashSet, HashSetExt};
use nalgebra::{Point3, Vector3};
use ndshape::{RuntimeShape, Shape};

/// Number of cells per side of a block of the coarsest grid.
const COARSEST: usize = 4;

/// Upper bound of the gradient's length relative to that of a distance; blocks whose corner values
/// exclude a zero under this bound are skipped; a heuristic.
const STEEPEST: f64 = 1.4;

/// Cubic block of cells: the indices of its lowest corner, and the number of cells per side.
type Block = ([usize; 3], usize);

/// Values at the corners of cells; NaN where not evaluated.
struct Grid<F> {
    values_at: F,
    low: Point3<f64>,
    cell_m: f64,
    /// Number of corners along each axis.
    count: [usize; 3],
    values: Vec<f32>,
}

/// Returns vertices and triangles of the zero set of a field in a box with cells of `cell_m`; the
/// field's values at some points, m, are those of `values_at`. It is closed, since the surface is
/// capped at the box.
pub fn zero_set(
    [low, high]: [Point3<f64>; 2],
    cell_m: f64,
    values_at: impl Fn(&[Point3<f64>]) -> Vec<f64>,
) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    // One empty cell on every side, and whole blocks.
    let low = low.map(|x| x - cell_m);
    let blocks = (high - low).map(|x| (x / cell_m).ceil() as usize + 1);
    let count = <[usize; 3]>::from(blocks).map(|cells| cells.div_ceil(COARSEST) * COARSEST + 1);
    let values = vec![f32::NAN; count.iter().product()];
    let mut grid = Grid { values_at, low, cell_m, count, values };
    let (mut blocks, mut skipped) = (grid.coarsest(), Vec::new());
    grid.evaluate(&blocks);
    while blocks.first().is_some_and(|(_, side)| *side > 1) {
        blocks.retain(|block| grid.may_cross(block, 0.5, corners(*block), &mut skipped));
        let parts = blocks.iter().flat_map(|block| corners(*block).zip(parts(*block)));
        let parts = parts.filter(|(known, part)| {
            grid.may_cross(part, 1.0, std::iter::once(*known), &mut skipped)
        });
        blocks = parts.map(|(_, part)| part).collect();
        grid.evaluate(&blocks);
    }
    skipped.into_iter().for_each(|(block, value)| grid.fill(block, value));
    let shape = RuntimeShape::<u32, 3>::new(count.map(|n| n as u32));
    debug_assert_eq!(shape.size() as usize, grid.values.len());
    let mut buffer = SurfaceNetsBuffer::default();
    surface_nets(&grid.values, &shape, [0; 3], count.map(|n| n as u32 - 1), &mut buffer);
    let at = |p: &[f32; 3]| low + Vector3::from(p.map(f64::from)) * cell_m;
    (buffer.positions.iter().map(at).collect(), buffer.indices.as_chunks().0.to_vec())
}

/// Returns the eight corners of a block.
fn corners((corner, side): Block) -> impl Iterator<Item = [usize; 3]> {
    (0..8).map(move |c| std::array::from_fn(|axis| corner[axis] + side * (c >> axis & 1)))
}

/// Returns the blocks of half the side in a block; each has the corner of the same number.
fn parts((corner, side): Block) -> impl Iterator<Item = Block> {
    corners((corner, side / 2)).map(move |corner| (corner, side / 2))
}

impl<F: Fn(&[Point3<f64>]) -> Vec<f64>> Grid<F> {
    fn coarsest(&self) -> Vec<Block> {
        let [x, y, z] = self.count.map(|n| (0..n - 1).step_by(COARSEST));
        let rows = z.flat_map(|k| y.clone().map(move |j| (j, k)));
        rows.flat_map(|(j, k)| x.clone().map(move |i| ([i, j, k], COARSEST))).collect()
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.count[1] + j) * self.count[0] + i
    }

    /// Computes the values at the corners of `blocks`; none is inside on the border of the box.
    fn evaluate(&mut self, blocks: &[Block]) {
        let (mut places, mut points) = (Vec::new(), Vec::new());
        for corner in blocks.iter().flat_map(|block| corners(*block)) {
            let index = self.index(corner);
            if self.values[index].is_nan() {
                let is_rim = corner.iter().zip(self.count).any(|(&i, n)| i == 0 || i + 1 == n);
                let least = if is_rim { 1e-3 * self.cell_m as f32 } else { f32::NEG_INFINITY };
                // Marks the corner as taken.
                self.values[index] = least;
                places.push(index);
                points.push(self.low + Vector3::from(corner.map(|i| i as f64)) * self.cell_m);
            }
        }
        for (index, value) in places.into_iter().zip((self.values_at)(&points)) {
            self.values[index] = (value as f32).max(self.values[index]);
        }
    }

    /// Whether the surface may cross a block in which no point is farther from the nearest of
    /// `known` corners than this part of its diagonal; if not, adds it to `skipped` with a value of
    /// its sign.
    fn may_cross(
        &self,
        block: &Block,
        part: f64,
        known: impl Iterator<Item = [usize; 3]>,
        skipped: &mut Vec<(Block, f32)>,
    ) -> bool {
        let [least, greatest] =
            known.fold([f32::INFINITY, f32::NEG_INFINITY], |[least, greatest], corner| {
                let value = self.values[self.index(corner)];
                [least.min(value), greatest.max(value)]
            });
        let reach = (STEEPEST * part * 3f64.sqrt() * block.1 as f64 * self.cell_m) as f32;
        let may_cross = least < reach && greatest > -reach;
        if !may_cross {
            skipped.push((*block, if least > 0.0 { least } else { greatest }));
        }
        may_cross
    }

    /// Fills what was not evaluated of a block.
    fn fill(&mut self, ([i, j, k], side): Block, value: f32) {
        for c in k..=k + side {
            for b in j..=j + side {
                for a in i..=i + side {
                    let index = self.index([a, b, c]);
                    if self.values[index].is_nan() {
                        self.values[index] = value;
                    }
                }
            }
        }
    }
}

/// Returns those of `triangles` that are connected to the vertex nearest to one of `contacts`: a
/// field may have zeros far from all contacts.
pub fn touched_components(
    vertices: &[Point3<f64>],
    triangles: Vec<[u32; 3]>,
    contacts: &[Point3<f64>],
) -> Vec<[u32; 3]> {
    let mut parents: Vec<u32> = (0..vertices.len() as u32).collect();
    for [a, b, c] in &triangles {
        let a = root(&mut parents, *a);
        for other in [b, c] {
            let other = root(&mut parents, *other);
            parents[other as usize] = a;
        }
    }
    let mut kept = HashSet::new();
    for contact in contacts {
        let away = |vertex: &u32| (vertices[*vertex as usize] - contact).norm_squared();
        let nearest = (0..vertices.len() as u32).min_by(|a, b| away(a).total_cmp(&away(b)));
        kept.extend(nearest.map(|vertex| root(&mut parents, vertex)));
    }
    triangles.into_iter().filter(|[a, ..]| kept.contains(&root(&mut parents, *a))).collect()
}

/// Returns the representative vertex of the component of `vertex`.
fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
    while parents[vertex as usize] != vertex {
        let above = parents[parents[vertex as usize] as usize];
        parents[vertex as usize] = above;
        vertex = above;
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::zero_set;
    use nalgebra::Point3;
    use std::collections::HashMap;

    /// Every edge has two triangles, also where the box caps the surface, on any side; and the rest
    /// is at its correct position.
    #[test]
    fn surfaces_are_closed() {
        for centre in [[0.0; 3], [0.05, 0.0, 0.0], [-0.05, 0.02, 0.05], [0.0, 0.05, -0.05]] {
            let centre = Point3::from(centre);
            let corners = [Point3::from([-0.06; 3]), Point3::from([0.06; 3])];
            let (vertices, triangles) = zero_set(corners, 0.004, |points| {
                points.iter().map(|p| (p - centre).norm() - 0.04).collect()
            });
            assert!(triangles.len() > 100);
            let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
            for [a, b, c] in triangles {
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    *edges.entry([from.min(to), from.max(to)]).or_default() +=
                        if from < to { 1 } else { -1 };
                }
            }
            assert!(edges.values().all(|&turns| turns == 0), "{centre}");
            let off_m = |p: &Point3<f64>| ((p - centre).norm() - 0.04).abs();
            let inside = vertices.iter().filter(|p| p.coords.amax() < 0.055);
            assert!(inside.map(off_m).fold(0.0, f64::max) < 0.002, "{centre}");
        }
    }
}
