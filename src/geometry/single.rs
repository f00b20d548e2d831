//! Bounds of rays and balls in single precision, all three coordinates at once: a query asks dozens
//! of boxes and few triangles.
//!
//! What is asked about grows, and its bound shrinks, by more than rounding moves them: no bound is
//! above the exact one.

use glam::Vec3A;
use nalgebra::{Point3, UnitVector3, Vector3};
use obvhs::aabb::Aabb;

/// Twice what the operations of a bound, each of which rounds by half an ε, can be off by together.
const ROUNDING: f32 = 5.0 * f32::EPSILON;

/// A point and what rounding makes of it: somewhere between two corners.
struct Rounded {
    low: Vec3A,
    high: Vec3A,
}

impl Rounded {
    fn new(point: &Point3<f64>) -> Self {
        let nearest = single(&point.coords);
        let slack = nearest.abs() * (2.0 * f32::EPSILON);
        Self { low: nearest - slack, high: nearest + slack }
    }
}

/// A ray prepared for boxes, as [`super::bounds::Slab`].
pub(super) struct SingleSlab {
    origin: Rounded,
    inverse: Vec3A,
}

impl SingleSlab {
    pub fn new(origin: &Point3<f64>, direction: &UnitVector3<f64>) -> Self {
        // Large but finite, so that an origin in the plane of a side gives 0, not NaN.
        let inverse = direction.map(|x| if x.abs() < 1e-30 { 1e30 } else { 1.0 / x });
        Self { origin: Rounded::new(origin), inverse: single(&inverse) }
    }

    /// At most the distance at which the ray enters a box, 0 from inside; infinite only if it
    /// misses.
    #[inline]
    pub fn enter_m(&self, node: &Aabb) -> f64 {
        let low = (node.min - self.origin.high) * self.inverse;
        let high = (node.max - self.origin.low) * self.inverse;
        let enter = low.min(high).max_element().max(0.0) * (1.0 - ROUNDING);
        let leave = low.max(high).min_element() * (1.0 + ROUNDING);
        if enter <= leave { f64::from(enter) } else { f64::INFINITY }
    }
}

/// A point prepared for boxes.
pub(super) struct SingleBall {
    centre: Rounded,
}

impl SingleBall {
    pub fn new(centre: &Point3<f64>) -> Self {
        Self { centre: Rounded::new(centre) }
    }

    /// At most the squared distance to a box, in m².
    #[inline]
    pub fn distance_squared(&self, node: &Aabb) -> f64 {
        let gap = (node.min - self.centre.high).max(self.centre.low - node.max).max(Vec3A::ZERO);
        f64::from(gap.length_squared() * (1.0 - ROUNDING))
    }
}

fn single(vector: &Vector3<f64>) -> Vec3A {
    Vec3A::from(<[f32; 3]>::from(vector.map(|x| x as f32)))
}

#[cfg(test)]
mod tests {
    use super::super::bounds::{Box3, Slab};
    use super::*;
    use proptest::prelude::*;

    fn coordinates(size: f64) -> impl Strategy<Value = Vector3<f64>> {
        let any = prop_oneof![-size..size, Just(0.0), Just(size), -1e-9..1e-9f64];
        prop::array::uniform3(any).prop_map(Vector3::from)
    }

    proptest! {
        /// Double precision is the slow twin.
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
