//! Bounding volume hierarchy of a mesh: ray, nearest-point and capsule-sweep queries.

use std::cell::Cell;
use std::sync::Arc;
use std::time::Duration;

use nalgebra::{Point3, UnitVector3, Vector3};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::faststack::FastStack;
use obvhs::{BvhBuildParams, fast_stack};

use super::bounds::{Box3, SingleBall, SingleSlab, Slab, Tube, Wall};
use super::mesh::Mesh;
use super::primitives::{Line, nearest_on_triangle, normal};
use super::sweep::{Capsule, Sweep};

/// Padding of boxes as a fraction of the mesh's diagonal: more than the rounding to f32, and the
/// rounding of a query kilometres away.
const PADDING: f64 = 1e-6;

/// Distance below which the direction between two points is undefined, m.
const NO_DIRECTION_M: f64 = 1e-12;

/// A triangle mesh with a bounding volume hierarchy over it.
///
/// Boxes are f32, relative to the centre of the mesh and padded, and only select the triangles to
/// test; every triangle is tested in f64. Queries do not allocate.
#[derive(Clone)]
pub struct MeshBvh {
    mesh: Arc<Mesh>,
    centre: Vector3<f64>,
    bvh: Bvh2,
    /// Largest number of nodes on the stack.
    stack_size: usize,
}

/// Intersection of a ray with the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance from the origin of the ray, in metres.
    pub distance_m: f64,
    /// Index of the triangle.
    pub triangle: u32,
    /// The point, in metres.
    pub point: Point3<f64>,
    /// Unit normal of the triangle, towards the side from which its corners run counter-clockwise.
    pub normal: Vector3<f64>,
}

/// The point of the mesh nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestHit {
    /// Distance between both points, in metres.
    pub distance_m: f64,
    /// The point, in metres.
    pub point: Point3<f64>,
    /// Index of a triangle that contains it.
    pub triangle: u32,
}

/// First contact of a moving capsule with the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepHit {
    /// Travel of the capsule until contact, in metres; 0 if it overlaps from the start.
    pub travel_m: f64,
    /// Contact point of the mesh, in metres; one point of it if the contact is a line or an area.
    pub point: Point3<f64>,
    /// Unit vector from `point` to the axis of the capsule. If the axis itself touches, the
    /// triangle's normal on the side from which the capsule comes.
    pub normal: Vector3<f64>,
    /// Index of a triangle in contact.
    pub triangle: u32,
}

impl MeshBvh {
    /// Builds the hierarchy.
    pub fn new(mesh: impl Into<Arc<Mesh>>) -> Self {
        let mesh = mesh.into();
        let (low, high) = mesh.bounds();
        let centre = (low.coords + high.coords) / 2.0;
        let padding = PADDING * (high - low).norm();
        let boxes: Vec<Aabb> = mesh
            .iter_corners()
            .map(|corners| {
                let [a, b, c] = corners.map(|corner| corner.coords - centre);
                let low = a.inf(&b).inf(&c).add_scalar(-padding);
                let high = a.sup(&b).sup(&c).add_scalar(padding);
                let f32s = |corner: Vector3<f64>| <[f32; 3]>::from(corner.map(|x| x as f32));
                Aabb::new(f32s(low).into(), f32s(high).into())
            })
            .collect();
        let params = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::medium_build() };
        let bvh = build_bvh2(&boxes, params, &mut Duration::default());
        let stack_size = depth(&bvh) + MOST;
        Self { mesh, centre, bvh, stack_size }
    }

    /// The mesh of the hierarchy.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// Returns the first intersection of the ray o + s d, 0 ≤ s ≤ `max_distance_m`, with the mesh,
    /// from either side. A ray through an edge or a vertex does not slip between triangles.
    pub fn ray(
        &self,
        origin: &Point3<f64>,
        direction: &UnitVector3<f64>,
        max_distance_m: f64,
    ) -> Option<RayHit> {
        self.ray_near(&MeshParts::WHOLE, None, origin, direction, max_distance_m)
    }

    /// Returns the first intersection of a ray that stays in the ball of `near`. A good `guess` of
    /// the triangle that it meets spares most others.
    pub fn ray_near(
        &self,
        near: &MeshParts,
        guess: Option<u32>,
        origin: &Point3<f64>,
        direction: &UnitVector3<f64>,
        max_distance_m: f64,
    ) -> Option<RayHit> {
        let slab = SingleSlab::new(&(origin - self.centre), direction);
        let line = Line::along(direction);
        let mut hit = None;
        let mut ask = |triangle: u32, limit_m: f64| {
            let distance_m = line.distance_m(origin, &self.corners(triangle));
            match distance_m.filter(|distance_m| (0.0..limit_m).contains(distance_m)) {
                Some(distance_m) => {
                    hit = Some((distance_m, triangle));
                    distance_m
                }
                None => limit_m,
            }
        };
        let limit_m = max_distance_m.next_up();
        let guess = guess.filter(|triangle| (*triangle as usize) < self.mesh.triangles().len());
        let limit_m = guess.map_or(limit_m, |triangle| ask(triangle, limit_m));
        self.visit(near, limit_m, |node| slab.enter_m(node), ask);
        hit.map(|(distance_m, triangle)| RayHit {
            distance_m,
            triangle,
            point: origin + direction.scale(distance_m),
            normal: normal(&self.corners(triangle)),
        })
    }

    /// Returns the point of the mesh nearest to `p`.
    pub fn closest_point(&self, p: &Point3<f64>) -> ClosestHit {
        let from = p - self.centre;
        let reach = |triangle| {
            let point = nearest_on_triangle(p, &self.corners(triangle));
            ((point - p).norm_squared(), point)
        };
        let mut best = (reach(0), 0);
        self.visit(
            &MeshParts::WHOLE,
            best.0.0,
            |node| Box3::of(node).distance_squared(&from, &from),
            |triangle, limit| {
                let here = reach(triangle);
                if here.0 < limit {
                    best = (here, triangle);
                }
                limit.min(here.0)
            },
        );
        let ((squared, point), triangle) = best;
        ClosestHit { distance_m: squared.sqrt(), point, triangle }
    }

    /// Whether the mesh comes within `radius_m` of `centre`.
    pub fn touches(&self, centre: &Point3<f64>, radius_m: f64) -> bool {
        self.touches_near(&MeshParts::WHOLE, centre, radius_m)
    }

    /// Returns the part of the mesh within `radius_m` of `centre`, for queries that stay there.
    pub fn nearby(&self, centre: &Point3<f64>, radius_m: f64) -> MeshParts {
        MeshParts::new(&self.bvh, &(centre - self.centre), radius_m)
    }

    /// Whether the part `near` comes within `radius_m` of `centre`.
    pub fn touches_near(&self, near: &MeshParts, centre: &Point3<f64>, radius_m: f64) -> bool {
        let ball = SingleBall::new(&(centre - self.centre));
        let mut touched = false;
        let reach = (radius_m * radius_m).next_up();
        self.visit(
            near,
            reach,
            |node| ball.distance_squared(node),
            |triangle, limit| {
                let point = nearest_on_triangle(centre, &self.corners(triangle));
                touched |= (point - centre).norm_squared() < limit;
                // One is enough: nothing lies under the new limit.
                if touched { f64::NEG_INFINITY } else { limit }
            },
        );
        touched
    }

    /// Passes to `visit` the corners of every triangle within `radius_m` of `centre`, and of some
    /// that are farther.
    pub fn triangles_near(
        &self,
        centre: &Point3<f64>,
        radius_m: f64,
        mut visit: impl FnMut([Point3<f64>; 3]),
    ) {
        let ball = SingleBall::new(&(centre - self.centre));
        let reach = (radius_m * radius_m).next_up();
        self.visit(
            &MeshParts::WHOLE,
            reach,
            |node| ball.distance_squared(node),
            |triangle, limit| {
                visit(self.corners(triangle));
                limit
            },
        );
    }

    /// Whether the mesh intersects `capsule`.
    pub fn intersects(&self, capsule: &Capsule) -> bool {
        self.overlap(capsule).is_some()
    }

    /// Whether all six axis-parallel rays from `p` meet back faces: it is inside a closed mesh, or
    /// deep in one with few holes.
    pub fn is_enclosed(&self, p: &Point3<f64>) -> bool {
        let from = p - self.centre;
        if Box3::of(self.bvh.nodes[0].aabb()).distance_squared(&from, &from) > 0.0 {
            return false;
        }
        [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()]
            .into_iter()
            .flat_map(|axis| [axis, -axis])
            .all(|axis| self.ray(p, &axis, f64::MAX).is_some_and(|hit| hit.normal.dot(&axis) > 0.0))
    }

    /// Returns the first contact of a capsule that travels along `direction` by at most
    /// `max_travel_m`: the smallest travel at which the distance from axis to mesh is at most the
    /// radius. If the capsule overlaps from the start, the contact is the point of the mesh nearest
    /// to the axis.
    pub fn sweep(
        &self,
        capsule: &Capsule,
        direction: &UnitVector3<f64>,
        max_travel_m: f64,
    ) -> Option<SweepHit> {
        if let Some(triangle) = self.overlap(capsule) {
            return Some(self.contact(capsule, direction, 0.0, triangle));
        }
        // A capsule that moves along its axis meets first what its leading end meets.
        let (whole, leading) = (capsule, capsule.leading(direction));
        let capsule = leading.as_ref().unwrap_or(capsule);
        let slab = Slab::new(&(capsule.p0_w - self.centre), direction);
        let body = Box3::swept(capsule);
        let sweep = Sweep::new(capsule, *direction);
        let wall = Cell::new(Wall::default());
        let tube = Tube::new(capsule, &self.centre, direction);
        let lower = |node: &Box3| {
            wall.get().travel_m(node).max(slab.enter_m(&node.grown(&body))).max(tube.enter_m(node))
        };
        let mut hit = None;
        self.visit(
            &MeshParts::WHOLE,
            max_travel_m.next_up(),
            |node| lower(&Box3::of(node)),
            |triangle, limit_m| {
                let corners = self.corners(triangle);
                let reach_m = wall.get().travel_to_m(&corners.map(|corner| corner - self.centre));
                if reach_m >= limit_m || lower(&Box3::around(&corners, &self.centre)) >= limit_m {
                    return limit_m;
                }
                match sweep.travel_m(&corners).filter(|&travel_m| travel_m < limit_m) {
                    Some(travel_m) => {
                        let contact = self.contact(whole, direction, travel_m, triangle);
                        wall.set(Wall::new(capsule, &self.centre, direction, &contact.normal));
                        hit = Some(contact);
                        travel_m
                    }
                    None => limit_m,
                }
            },
        );
        hit
    }

    /// Returns the points of axis and mesh that are nearest to each other, if they are no farther
    /// apart than the radius.
    pub fn nearest_to_axis(&self, capsule: &Capsule) -> Option<(Point3<f64>, Point3<f64>)> {
        self.overlap(capsule).map(|triangle| capsule.nearest(&self.corners(triangle)))
    }

    /// Returns the triangle nearest to the axis, if it is no farther than the radius.
    fn overlap(&self, capsule: &Capsule) -> Option<u32> {
        let ends = (capsule.p0_w - self.centre, capsule.p1_w - self.centre);
        let (low, high) = (ends.0.coords.inf(&ends.1.coords), ends.0.coords.sup(&ends.1.coords));
        let lower = |node: &Box3| node.distance_squared(&low.into(), &high.into());
        let mut nearest = None;
        let reach = (capsule.radius_m * capsule.radius_m).next_up();
        self.visit(
            &MeshParts::WHOLE,
            reach,
            |node| lower(&Box3::of(node)),
            |triangle, limit| {
                let corners = self.corners(triangle);
                if lower(&Box3::around(&corners, &self.centre)) >= limit {
                    return limit;
                }
                let (on_axis, on_mesh) = capsule.nearest(&corners);
                let squared = (on_axis - on_mesh).norm_squared();
                if squared < limit {
                    nearest = Some(triangle);
                }
                limit.min(squared)
            },
        );
        nearest
    }

    fn contact(
        &self,
        capsule: &Capsule,
        direction: &UnitVector3<f64>,
        travel_m: f64,
        triangle: u32,
    ) -> SweepHit {
        let corners = self.corners(triangle);
        let (on_axis, point) = capsule.translated(&direction.scale(travel_m)).nearest(&corners);
        let normal = UnitVector3::try_new(on_axis - point, NO_DIRECTION_M).map_or_else(
            || {
                let normal = normal(&corners);
                normal * -normal.dot(direction).signum()
            },
            UnitVector3::into_inner,
        );
        SweepHit { travel_m, point, normal, triangle }
    }

    /// Returns `p` relative to the centre of the boxes.
    pub(super) fn local(&self, p: &Point3<f64>) -> Point3<f64> {
        p - self.centre
    }

    #[inline]
    fn corners(&self, triangle: u32) -> [Point3<f64>; 3] {
        self.mesh.corners(triangle as usize)
    }

    /// Passes to `visit` the triangles of some parts whose boxes have a lower bound below the
    /// limit, near ones first within each part. `ask` returns the new limit.
    #[inline]
    pub(super) fn visit(
        &self,
        parts: &MeshParts,
        mut limit: f64,
        lower: impl Fn(&Aabb) -> f64,
        mut ask: impl FnMut(u32, f64) -> f64,
    ) {
        let nodes = &self.bvh.nodes;
        fast_stack!((f64, u32), (32, 128), self.stack_size, stack, {
            for &part in parts.nodes() {
                stack.push((lower(nodes[part as usize].aabb()), part));
            }
            'waiting: while let Some((bound, index)) = stack.pop() {
                if bound.is_nan() || bound >= limit {
                    continue;
                }
                let mut node = &nodes[index as usize];
                while !node.is_leaf() {
                    let first = node.first_index;
                    let bound = |index: u32| (lower(nodes[index as usize].aabb()), index);
                    let (left, right) = (bound(first), bound(first + 1));
                    let (near, far) = if left.0 <= right.0 { (left, right) } else { (right, left) };
                    if far.0 < limit {
                        stack.push(far);
                    }
                    if near.0.is_nan() || near.0 >= limit {
                        continue 'waiting;
                    }
                    node = &nodes[near.1 as usize];
                }
                let first = node.first_index as usize;
                for &triangle in &self.bvh.primitive_indices[first..][..node.prim_count as usize] {
                    limit = ask(triangle, limit);
                }
            }
        });
    }
}

/// Returns the number of levels of the tree below its root.
fn depth(bvh: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut waiting = vec![(0, 0)];
    while let Some((index, level)) = waiting.pop() {
        deepest = deepest.max(level);
        let node = &bvh.nodes[index as usize];
        if !node.is_leaf() {
            waiting.extend([(node.first_index, level + 1), (node.first_index + 1, level + 1)]);
        }
    }
    deepest
}

/// Largest number of parts; a heuristic: more are tested one by one without benefit.
const MOST: usize = 8;

/// Parts of a mesh that contain every triangle within some ball, and perhaps others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshParts {
    nodes: [u32; MOST],
    count: usize,
}

impl MeshParts {
    /// The whole mesh.
    pub(super) const WHOLE: Self = Self { nodes: [0; MOST], count: 1 };

    const NOTHING: Self = Self { nodes: [0; MOST], count: 0 };

    /// Selects the parts within `radius_m` of `centre`, given relative to the centre of the boxes:
    /// descends level by level as long as all nodes of a level that the ball meets fit.
    fn new(bvh: &Bvh2, centre: &Point3<f64>, radius_m: f64) -> Self {
        let ball = SingleBall::new(centre);
        let reach = (radius_m * radius_m).next_up();
        let is_met =
            |&index: &u32| ball.distance_squared(bvh.nodes[index as usize].aabb()) <= reach;
        let mut found = Self::WHOLE;
        loop {
            let mut below = Self::NOTHING;
            for &index in found.nodes() {
                let node = &bvh.nodes[index as usize];
                let parts = match node.is_leaf() {
                    true => index..index + 1,
                    false => node.first_index..node.first_index + 2,
                };
                if !parts.filter(is_met).all(|part| below.has_taken(part)) {
                    return found;
                }
            }
            if below == found {
                return found;
            }
            found = below;
        }
    }

    /// Returns the root nodes of the parts.
    fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// Adds a node if there is space; returns whether there was.
    fn has_taken(&mut self, node: u32) -> bool {
        let room = self.nodes.get_mut(self.count);
        self.count += usize::from(room.is_some());
        room.map(|room| *room = node).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use proptest::prelude::*;

    /// Returns a wavy sheet, 1 m by 1 m.
    fn sheet() -> MeshBvh {
        const SIDE: u32 = 30;
        let vertex = |i: u32| {
            let (u, v) = (f64::from(i % SIDE) / 29.0, f64::from(i / SIDE) / 29.0);
            Point3::new(u, v, 0.1 * (9.0 * u).sin() * (7.0 * v).cos())
        };
        let vertices: Vec<Point3<f64>> = (0..SIDE * SIDE).map(vertex).collect();
        let cells = (0..SIDE - 1).flat_map(|row| (0..SIDE - 1).map(move |i| row * SIDE + i));
        let halves = cells.flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]]);
        MeshBvh::new(Mesh::new(&vertices, &halves.collect::<Vec<_>>()).unwrap().0)
    }

    proptest! {
        /// Compares with queries that start at the root.
        #[test]
        fn in_the_ball_nothing_is_missed(
            centre in prop::array::uniform3(-0.2..1.2f64),
            radius_m in 0.0..0.5f64,
            from in prop::array::uniform3(-0.5..0.5f64),
            towards in prop::array::uniform3(-1.0..1.0f64),
            part in 0.0..1.0f64,
            guess in prop::option::of(0..2000u32),
        ) {
            let bvh = sheet();
            let centre = Point3::from(centre);
            let near = bvh.nearby(&centre, radius_m);
            let start = centre + Vector3::from(from) * radius_m;
            let Some(direction) = UnitVector3::try_new(Vector3::from(towards), 1e-3) else {
                return Ok(());
            };
            let max_m = (radius_m - (start - centre).norm()).max(0.0);
            let hit = bvh.ray_near(&near, guess, &start, &direction, max_m);
            let whole_m = bvh.ray(&start, &direction, max_m).map(|hit| hit.distance_m);
            prop_assert_eq!(hit.map(|hit| hit.distance_m), whole_m);
            let touches = |near: &MeshParts| bvh.touches_near(near, &start, part * max_m);
            prop_assert_eq!(touches(&near), touches(&MeshParts::WHOLE));
        }
    }
}
