//! Lower bounds on distance and travel to a box, which let a query skip most of a mesh.
//!
//! A node of the hierarchy need not be opened if the query cannot reach its box before the best hit
//! so far. For a point or segment, the bound is its distance to the box; a ray must pass the
//! [`Slab`]s of the box. For a moving capsule, p0 must enter the grown box, the [`Tube`] around its
//! axis must meet the box's ball, and the [`Wall`] ahead of it must meet the box. Each of these is
//! a lower bound, and so is the largest of them.

use glam::Vec3A;
use nalgebra::{Point3, UnitVector3, Vector3};
use obvhs::aabb::Aabb;

use super::sweep::Capsule;

/// Smallest speed, relative to the capsule's, by which a bound is divided; below it the bound would
/// be dominated by rounding.
const MIN_SPEED: f64 = 1e-3;

/// An axis-aligned box, in metres from the centre of the mesh.
#[derive(Clone, Copy)]
pub(super) struct Box3 {
    pub low: Vector3<f64>,
    pub high: Vector3<f64>,
}

impl Box3 {
    #[inline]
    pub fn of(aabb: &Aabb) -> Self {
        let f64s = |corner: [f32; 3]| Vector3::from(corner.map(f64::from));
        Self { low: f64s(aabb.min.into()), high: f64s(aabb.max.into()) }
    }

    #[inline]
    pub fn around(corners: &[Point3<f64>; 3], centre: &Vector3<f64>) -> Self {
        let [a, b, c] = corners;
        Self { low: a.inf(b).inf(c).coords - centre, high: a.sup(b).sup(c).coords - centre }
    }

    /// Returns the margins by which a box grows to contain the moving capsule: the Minkowski sum
    /// with the bounding box of the capsule. A capsule meets the box no earlier than a ray from its
    /// end p0 meets the grown box.
    pub fn swept(capsule: &Capsule) -> Self {
        let draw = capsule.p0_w - capsule.p1_w;
        let zero = Vector3::zeros();
        Self {
            low: draw.inf(&zero).add_scalar(-capsule.radius_m),
            high: draw.sup(&zero).add_scalar(capsule.radius_m),
        }
    }

    #[inline]
    pub fn grown(&self, by: &Self) -> Self {
        Self { low: self.low + by.low, high: self.high + by.high }
    }

    /// Returns the squared distance to the box from `low` to `high`, m².
    #[inline]
    pub fn distance_squared(&self, low: &Point3<f64>, high: &Point3<f64>) -> f64 {
        let gap = (self.low - high.coords).sup(&(low.coords - self.high));
        gap.sup(&Vector3::zeros()).norm_squared()
    }
}

/// The capsule extended along its axis to infinity, tested against the balls around boxes.
pub(super) struct Tube {
    start: Vector3<f64>,
    axis: Vector3<f64>,
    radius_m: f64,
    /// Component of the direction orthogonal to the axis, and the reciprocal of its square; 0 if it
    /// is small, which makes every bound 0.
    velocity: Vector3<f64>,
    inverse_squared: f64,
}

impl Tube {
    pub fn new(capsule: &Capsule, centre: &Vector3<f64>, direction: &UnitVector3<f64>) -> Self {
        let axis = (capsule.p1_w - capsule.p0_w).try_normalize(0.0).unwrap_or_default();
        let velocity = direction.into_inner() - axis * axis.dot(direction);
        Self {
            start: capsule.p0_w.coords - centre,
            axis,
            radius_m: capsule.radius_m,
            velocity,
            inverse_squared: if velocity.norm() < MIN_SPEED {
                0.0
            } else {
                velocity.norm_squared().recip()
            },
        }
    }

    /// Returns the travel until the tube touches the ball around a box; infinite if it never does.
    #[inline]
    pub fn enter_m(&self, node: &Box3) -> f64 {
        let arm = self.start - (node.low + node.high) / 2.0;
        let across = arm - self.axis * self.axis.dot(&arm);
        let nearest_m = -across.dot(&self.velocity) * self.inverse_squared;
        let miss_squared = (across + self.velocity * nearest_m).norm_squared();
        let reach_m = self.radius_m + (node.high - node.low).norm() / 2.0;
        let half_squared = (reach_m * reach_m - miss_squared) * self.inverse_squared;
        if half_squared < 0.0 {
            return f64::INFINITY;
        }
        nearest_m - half_squared.sqrt()
    }
}

/// A moving plane ahead of the capsule, orthogonal to the normal of the best contact so far. The
/// capsule does not touch anything that the plane does not reach: behind a contact on a bulge this
/// excludes everything that the boxes, which are wider than the capsule, would admit.
#[derive(Clone, Copy, Default)]
pub(super) struct Wall {
    /// Normal against the capsule's motion, divided by the speed at which the plane advances.
    normal: Vector3<f64>,
    start_m: f64,
}

impl Wall {
    pub fn new(
        capsule: &Capsule,
        centre: &Vector3<f64>,
        direction: &UnitVector3<f64>,
        normal: &Vector3<f64>,
    ) -> Self {
        let speed = -normal.dot(direction);
        if speed < MIN_SPEED {
            return Self::default();
        }
        let height = |end: Point3<f64>| normal.dot(&(end.coords - centre));
        let start_m = height(capsule.p0_w).min(height(capsule.p1_w)) - capsule.radius_m;
        Self { normal: normal / speed, start_m: start_m / speed }
    }

    /// Returns the travel until the plane reaches the first of these points, relative to the centre
    /// of the mesh.
    #[inline]
    pub fn travel_to_m(&self, points: &[Point3<f64>; 3]) -> f64 {
        let height = points.map(|point| self.normal.dot(&point.coords));
        self.start_m - height[0].max(height[1]).max(height[2])
    }

    /// Returns the travel until the plane reaches a box.
    #[inline]
    pub fn travel_m(&self, node: &Box3) -> f64 {
        let (low, high) =
            (self.normal.component_mul(&node.low), self.normal.component_mul(&node.high));
        self.start_m - low.sup(&high).sum()
    }
}

/// A ray prepared for box tests: a box is the intersection of three slabs, each between two
/// parallel planes (Kay & Kajiya 1986).
pub(super) struct Slab {
    origin: Vector3<f64>,
    inverse: Vector3<f64>,
}

impl Slab {
    pub fn new(origin: &Point3<f64>, direction: &UnitVector3<f64>) -> Self {
        // Large but finite, so that an origin in the plane of a side gives 0, not NaN.
        let inverse = direction.map(|x| if x.abs() < 1e-290 { 1e290 } else { 1.0 / x });
        Self { origin: origin.coords, inverse }
    }

    /// Returns the distance at which the ray enters a box; 0 from inside, infinite if it misses.
    #[inline]
    pub fn enter_m(&self, node: &Box3) -> f64 {
        let low = (node.low - self.origin).component_mul(&self.inverse);
        let high = (node.high - self.origin).component_mul(&self.inverse);
        let (near, far) = (low.inf(&high), low.sup(&high));
        let enter = near.x.max(near.y).max(near.z).max(0.0);
        if enter <= far.x.min(far.y).min(far.z) { enter } else { f64::INFINITY }
    }
}

// The following tests use single precision and all three coordinates at once, for queries that test
// dozens of boxes and few triangles. The query is enlarged, and its bound reduced, by more than
// rounding changes them, so that no bound exceeds the exact one.

/// Twice the accumulated rounding error of a bound's operations, each of which rounds by half an ε.
const ROUNDING: f32 = 5.0 * f32::EPSILON;

/// A ray prepared for box tests in single precision; see [`Slab`].
pub(super) struct SingleSlab {
    origin: SingleBall,
    inverse: Vec3A,
}

impl SingleSlab {
    pub fn new(origin: &Point3<f64>, direction: &UnitVector3<f64>) -> Self {
        // Large but finite, so that an origin in the plane of a side gives 0, not NaN.
        let inverse = direction.map(|x| if x.abs() < 1e-30 { 1e30 } else { 1.0 / x });
        Self { origin: SingleBall::new(origin), inverse: single(&inverse) }
    }

    /// Returns a lower bound of the distance at which the ray enters a box; 0 from inside; infinite
    /// only if it misses.
    #[inline]
    pub fn enter_m(&self, node: &Aabb) -> f64 {
        let low = (node.min - self.origin.high) * self.inverse;
        let high = (node.max - self.origin.low) * self.inverse;
        let enter = low.min(high).max_element().max(0.0) * (1.0 - ROUNDING);
        let leave = low.max(high).min_element() * (1.0 + ROUNDING);
        if enter <= leave { f64::from(enter) } else { f64::INFINITY }
    }
}

/// A point prepared for box tests in single precision: it lies between two corners, due to
/// rounding.
pub(super) struct SingleBall {
    low: Vec3A,
    high: Vec3A,
}

impl SingleBall {
    pub fn new(centre: &Point3<f64>) -> Self {
        let nearest = single(&centre.coords);
        let slack = nearest.abs() * (2.0 * f32::EPSILON);
        Self { low: nearest - slack, high: nearest + slack }
    }

    /// Returns a lower bound of the squared distance to a box, m².
    #[inline]
    pub fn distance_squared(&self, node: &Aabb) -> f64 {
        let gap = (node.min - self.high).max(self.low - node.max).max(Vec3A::ZERO);
        f64::from(gap.length_squared() * (1.0 - ROUNDING))
    }
}

fn single(vector: &Vector3<f64>) -> Vec3A {
    Vec3A::from(<[f32; 3]>::from(vector.map(|x| x as f32)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn coordinates(size: f64) -> impl Strategy<Value = Vector3<f64>> {
        let any = prop_oneof![-size..size, Just(0.0), Just(size), -1e-9..1e-9f64];
        prop::array::uniform3(any).prop_map(Vector3::from)
    }

    proptest! {
        /// Compares with double precision.
        #[test]
        fn no_bound_is_above_the_exact_one(
            corner in coordinates(0.2),
            size in coordinates(0.2),
            (near, far) in (coordinates(0.3), coordinates(3e3)),
            is_far in any::<bool>(),
            towards in coordinates(1.0),
        ) {
            let origin = Point3::from(if is_far { far } else { near });
            let node = Aabb::new(single(&corner), single(&(corner + size.abs())));
            let exact = Box3::of(&node);
            let squared = SingleBall::new(&origin).distance_squared(&node);
            prop_assert!(squared <= exact.distance_squared(&origin, &origin));
            let Some(direction) = UnitVector3::try_new(towards, 1e-12) else { return Ok(()) };
            let enter_m = SingleSlab::new(&origin, &direction).enter_m(&node);
            let exact_m = Slab::new(&origin, &direction).enter_m(&exact);
            prop_assert!(enter_m <= exact_m, "{enter_m} is above {exact_m}");
        }
    }
}
