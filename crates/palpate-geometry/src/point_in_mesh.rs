//! Point-in-mesh test by counting signed surface crossings along lines.
//!
//! A line enters and leaves the surface; where it has entered more often than left, it is inside.
//! Signed counting is exact for a closed mesh of any number of components, nested, touching or
//! overlapping, unlike unsigned counting. It costs one traversal of the hierarchy, whereas the
//! generalised winding number, the solid angles of all triangles, costs one term per triangle. That
//! number would also handle a surface with a missing face; this is compensated by evaluating a line
//! from both of its ends.

use super::bounds::SingleSlab;
use super::bvh::{MeshBvh, MeshParts};
use super::primitives::Line;
use nalgebra::{Point3, UnitVector3, Vector3};

/// Directions of the lines through a point. A heuristic: skew, so that they meet no axis-parallel
/// side in an edge or in its plane.
const SKEW: [[f64; 3]; 3] = [[0.83, 0.44, 0.34], [-0.37, 0.85, 0.38], [-0.29, -0.47, 0.83]];

/// Crossing of a line with a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance along the line, m.
    pub at_m: f64,
    /// Whether the line enters the surface there, against its normal.
    pub enters: bool,
}

impl Crossing {
    fn sign(&self) -> i32 {
        if self.enters { 1 } else { -1 }
    }
}

impl MeshBvh {
    /// Reports every crossing of the infinite ray from `origin` with the mesh, in no particular
    /// order. A crossing through an edge is reported for both triangles.
    pub fn crossings(
        &self,
        origin: &Point3<f64>,
        direction: &UnitVector3<f64>,
        mut tell: impl FnMut(Crossing),
    ) {
        let slab = SingleSlab::new(&self.local(origin), direction);
        let line = Line::along(direction);
        self.visit(
            &MeshParts::WHOLE,
            f64::INFINITY,
            |node| slab.enter_m(node),
            |triangle, limit| {
                let corners = self.mesh().corners(triangle as usize);
                if let Some(at_m) = line.distance_m(origin, &corners).filter(|&at_m| at_m >= 0.0) {
                    let [a, b, c] = corners;
                    tell(Crossing { at_m, enters: (b - a).cross(&(c - a)).dot(direction) < 0.0 });
                }
                limit
            },
        );
    }

    /// Whether `p` is inside the closed mesh, by a majority of three lines through it. For a point
    /// on the surface either result is possible.
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        let (low, high) = self.mesh().bounds();
        if p.sup(&low).inf(&high) != *p {
            return false;
        }
        let says = |axis: &[f64; 3]| {
            let direction = UnitVector3::new_normalize(Vector3::from(*axis));
            let [ahead, behind] = [direction, -direction].map(|way| {
                let (mut left, mut any) = (0, false);
                self.crossings(p, &way, |crossing| {
                    left -= crossing.sign();
                    any = true;
                });
                (left, any)
            });
            ahead.1 && behind.1 && (ahead.0 > 0 || behind.0 > 0)
        };
        SKEW.iter().filter(|axis| says(axis)).count() >= 2
    }
}

/// Returns the intervals of a line inside, as [from, to] in order, from all its `crossings`, which
/// get sorted; `spans` is cleared before.
pub fn spans_inside(crossings: &mut [Crossing], spans: &mut Vec<[f64; 2]>) {
    crossings.sort_unstable_by(|a, b| a.at_m.total_cmp(&b.at_m));
    spans.clear();
    // From the far end, as many bodies lie ahead as were entered, except those never left.
    let outside = crossings.iter().map(Crossing::sign).sum::<i32>().min(0);
    let mut depth = 0;
    for pair in crossings.windows(2) {
        depth += pair[0].sign();
        if depth > outside {
            match spans.last_mut() {
                Some(span) if span[1] == pair[0].at_m => span[1] = pair[1].at_m,
                _ => spans.push([pair[0].at_m, pair[1].at_m]),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::solids::{Triangles, box_mesh, sphere_mesh};
    use proptest::prelude::*;

    fn all_of(pieces: &[Triangles]) -> MeshBvh {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for (points, faces) in pieces {
            let base = vertices.len() as u32;
            vertices.extend(points);
            triangles.extend(faces.iter().map(|face| face.map(|vertex| base + vertex)));
        }
        MeshBvh::new(Mesh::new(&vertices, &triangles).unwrap().0)
    }

    /// Returns a torus around z: a circle of radius `tube_m` moved around one of `ring_m`.
    fn torus(ring_m: f64, tube_m: f64) -> MeshBvh {
        use std::f64::consts::TAU;
        let (turns, around) = (48, 24);
        let vertices: Vec<_> = (0..turns * around)
            .map(|i| {
                let (y, x) = (TAU * f64::from(i / around) / f64::from(turns)).sin_cos();
                let (up, out) = (TAU * f64::from(i % around) / f64::from(around)).sin_cos();
                let across_m = ring_m + tube_m * out;
                Point3::new(across_m * x, across_m * y, tube_m * up)
            })
            .collect();
        let at = |turn: u32, step: u32| turn % turns as u32 * around as u32 + step % around as u32;
        let quads = (0..turns as u32).flat_map(|i| (0..around as u32).map(move |j| (i, j)));
        let triangles: Vec<_> = quads
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        MeshBvh::new(Mesh::new(&vertices, &triangles).unwrap().0)
    }

    proptest! {
        /// Points off the surface by more than the chords of its 48 and 24 corners, 1 - cos(π/24)
        /// of the tube and 1 - cos(π/48) of the ring.
        #[test]
        fn a_torus_is_hollow_in_the_middle(at in prop::array::uniform3(-1.5f64..1.5)) {
            let [x, y, z] = at;
            let from_tube = ((x.hypot(y) - 1.0).hypot(z)) - 0.4;
            prop_assume!(from_tube.abs() > 0.012);
            prop_assert_eq!(torus(1.0, 0.4).contains(&Point3::from(at)), from_tube < 0.0);
        }

        /// Tests two boxes that share a part of a face, a third that overlaps, a fourth within the
        /// first, and a separate ball, at any place including lattice planes.
        #[test]
        fn pieces_may_touch_overlap_and_nest(
            at in prop::array::uniform3(prop_oneof![-0.5f64..4.5, (0..9).prop_map(|i| f64::from(i) * 0.5 + 0.25)]),
        ) {
            let boxes = [
                ([0.0, 0.0, 0.0], [1.0, 2.0, 2.0]),
                ([1.0, 0.5, 0.5], [2.0, 1.5, 1.5]),
                ([1.5, 1.0, 0.0], [3.0, 2.0, 3.0]),
                ([0.25, 0.5, 0.5], [0.75, 1.0, 1.0]),
            ];
            let mut pieces: Vec<Triangles> = boxes.iter().map(|(l, h)| box_mesh(*l, *h)).collect();
            pieces.push(sphere_mesh(Point3::new(3.8, 3.8, 3.8), 0.5, 8));
            let p = Point3::from(at);
            let from_ball = (p - Point3::new(3.8, 3.8, 3.8)).norm();
            prop_assume!(!(0.4..0.51).contains(&from_ball));
            let on_a_side = |(low, high): &([f64; 3], [f64; 3])| {
                (0..3).any(|axis| at[axis] == low[axis] || at[axis] == high[axis])
            };
            prop_assume!(!boxes.iter().any(on_a_side));
            let is_in = |(low, high): &([f64; 3], [f64; 3])| {
                (0..3).all(|axis| (low[axis]..high[axis]).contains(&at[axis]))
            };
            let is_inside = from_ball < 0.45 || boxes.iter().any(is_in);
            prop_assert_eq!(all_of(&pieces).contains(&p), is_inside);
        }
    }

    /// Boxes that share a whole face keep its triangles and their reverses: both are closed.
    #[test]
    fn a_face_shared_by_two_boxes_belongs_to_both() {
        let two =
            all_of(&[box_mesh([0.0; 3], [1.0; 3]), box_mesh([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])]);
        assert_eq!(two.mesh().triangles().len(), 24);
        for x in [0.03, 0.3, 0.97, 1.03, 1.6] {
            for (y, z) in [(0.5, 0.5), (0.1, 0.9), (0.93, 0.27)] {
                assert!(two.contains(&Point3::new(x, y, z)), "{x} {y} {z}");
            }
        }
        for outside in [[-0.1, 0.5, 0.5], [2.1, 0.5, 0.5], [1.0, 1.1, 0.5], [0.9, 0.5, -0.1]] {
            assert!(!two.contains(&Point3::from(outside)), "{outside:?}");
        }
    }

    /// Tests a line through the centres of a box in a box and of a separate one.
    #[test]
    fn a_line_is_inside_from_where_it_enters_to_where_it_leaves() {
        let boxes = all_of(&[
            box_mesh([0.0; 3], [3.0; 3]),
            box_mesh([1.0; 3], [2.0; 3]),
            box_mesh([4.0, 1.0, 1.0], [5.0, 2.0, 2.0]),
        ]);
        let mut crossings = Vec::new();
        let start = Point3::new(-1.0, 1.6, 1.7);
        boxes.crossings(&start, &Vector3::x_axis(), |crossing| crossings.push(crossing));
        assert_eq!(crossings.len(), 6);
        let mut spans = vec![[7.0; 2]];
        spans_inside(&mut crossings, &mut spans);
        assert_eq!(spans, [[1.0, 4.0], [5.0, 6.0]]);
        // The reverse direction, with the first surface missing: no interval is reported in empty
        // space.
        let half = &mut crossings[1..];
        spans_inside(half, &mut spans);
        assert_eq!(spans, [[2.0, 4.0], [5.0, 6.0]]);
        spans_inside(&mut [], &mut spans);
        assert!(spans.is_empty());
    }
}
