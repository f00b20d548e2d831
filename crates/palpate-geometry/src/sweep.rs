//! Straight sweep of a capsule against one triangle.

use nalgebra::{Point3, UnitVector3, Vector3};

use super::primitives::{Line, nearest_of_segment_and_triangle};

/// Distance, in metres, below which a start counts as touching, so that rounding does not let a
/// shape that rests on a surface fall through it.
const TOUCH_M: f64 = 1e-11;

/// Squared sine below which a motion is parallel to an edge and meets only the corners at its ends.
const PARALLEL: f64 = 1e-24;

/// Relative distance from a line at which an axis is parallel to it.
const ROUNDING: f64 = 1e-12;

/// All points within `radius_m` of a segment. Equal ends give a sphere, a zero radius a segment or
/// a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// One end of the axis, in W, in metres.
    pub p0_w: Point3<f64>,
    /// The other end of the axis, in W, in metres.
    pub p1_w: Point3<f64>,
    /// Radius, in metres, not negative.
    pub radius_m: f64,
}

impl Capsule {
    /// Creates a sphere.
    pub fn sphere(centre_w: Point3<f64>, radius_m: f64) -> Self {
        Self { p0_w: centre_w, p1_w: centre_w, radius_m }
    }

    /// Returns the sphere at the leading end of a capsule whose axis is parallel to `direction`.
    pub fn leading(&self, direction: &UnitVector3<f64>) -> Option<Self> {
        let axis = self.p1_w - self.p0_w;
        let along_m = axis.dot(direction);
        let is_parallel = (axis - direction.scale(along_m)).norm() <= ROUNDING * axis.norm();
        let end_w = if along_m > 0.0 { self.p1_w } else { self.p0_w };
        is_parallel.then(|| Self::sphere(end_w, self.radius_m))
    }

    /// Returns the nearest points of the axis and a triangle, in this order.
    pub fn nearest(&self, triangle: &[Point3<f64>; 3]) -> (Point3<f64>, Point3<f64>) {
        nearest_of_segment_and_triangle([&self.p0_w, &self.p1_w], triangle)
    }

    /// Returns this capsule, moved by `by`.
    pub fn translated(&self, by: &Vector3<f64>) -> Self {
        Self { p0_w: self.p0_w + by, p1_w: self.p1_w + by, ..*self }
    }
}

/// A capsule moving along a direction, prepared for many triangles.
///
/// Sliding the capsule against a triangle T is equivalent to sliding the point p0 against T
/// extruded along p0 − p1 and rounded by the radius r. That body is convex, so p0 enters it at the
/// first intersection with one of the pieces that cover its surface: the prism's faces moved
/// outwards by r, the cylinders of radius r around its edges, the spheres of radius r around its
/// corners. Parts of a piece inside the body are met later and do not matter.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    start: Point3<f64>,
    draw: Vector3<f64>,
    radius_m: f64,
    direction: UnitVector3<f64>,
    line: Line,
}

impl Sweep {
    /// Prepares `capsule` moving along `direction`.
    pub fn new(capsule: &Capsule, direction: UnitVector3<f64>) -> Self {
        Self {
            start: capsule.p0_w,
            draw: capsule.p0_w - capsule.p1_w,
            radius_m: capsule.radius_m,
            direction,
            line: Line::along(&direction),
        }
    }

    /// Returns the travel, in metres, at which the capsule first touches the triangle, if it does.
    ///
    /// The capsule must not overlap the triangle at the start.
    pub fn travel_m(&self, triangle: &[Point3<f64>; 3]) -> Option<f64> {
        let far = triangle.map(|corner| corner + self.draw);
        let is_sphere = self.draw == Vector3::zeros();
        let mut first = f64::INFINITY;
        // The smallest travel that is not behind the start.
        let mut offer = |travel_m: Option<f64>| {
            if let Some(travel_m) = travel_m
                && travel_m >= -TOUCH_M
            {
                first = first.min(travel_m.max(0.0));
            }
        };
        self.base(triangle, &mut offer);
        if !is_sphere {
            self.base(&far, &mut offer);
        }
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (&triangle[i], &triangle[j]);
            offer(self.edge_travel(a, b));
            offer(self.corner_travel(a));
            if !is_sphere {
                offer(self.edge_travel(&far[i], &far[j]));
                offer(self.edge_travel(a, &far[i]));
                offer(self.corner_travel(&far[i]));
                self.side([a, b, &far[j], &far[i]], &mut offer);
            }
        }
        first.is_finite().then_some(first)
    }

    fn base(&self, triangle: &[Point3<f64>; 3], offer: &mut impl FnMut(Option<f64>)) {
        let [a, b, c] = triangle;
        self.face((b - a).cross(&(c - a)), &[*triangle], offer);
    }

    /// Offers the travel to the parallelogram of an extruded edge.
    fn side(&self, [a, b, c, d]: [&Point3<f64>; 4], offer: &mut impl FnMut(Option<f64>)) {
        let normal = (b - a).cross(&(d - a));
        self.face(normal, &[[*a, *b, *c], [*a, *c, *d]], offer);
    }

    /// Offers the travel to a flat face, offset by the radius against the motion.
    fn face(
        &self,
        normal: Vector3<f64>,
        triangles: &[[Point3<f64>; 3]],
        offer: &mut impl FnMut(Option<f64>),
    ) {
        let Some(normal) = UnitVector3::try_new(normal, 0.0) else { return };
        let offset_m = -self.radius_m * normal.dot(&self.direction).signum();
        let origin = self.start - normal.scale(offset_m);
        for triangle in triangles {
            offer(self.line.distance_m(&origin, triangle));
        }
    }

    /// Returns the travel to the cylinder around an edge, without its ends, m.
    fn edge_travel(&self, a: &Point3<f64>, b: &Point3<f64>) -> Option<f64> {
        let (axis, length_m) = UnitVector3::try_new_and_get(b - a, 0.0)?;
        let arm = self.start - a;
        let (arm_along, speed_along) = (arm.dot(&axis), self.direction.dot(&axis));
        let across = arm - axis.scale(arm_along);
        let velocity = self.direction.into_inner() - axis.scale(speed_along);
        let speed_squared = velocity.norm_squared();
        if speed_squared < PARALLEL {
            return None;
        }
        let nearest_m = -across.dot(&velocity) / speed_squared;
        let miss_squared = (across + velocity * nearest_m).norm_squared();
        let half_chord = self.half_chord(miss_squared)? / speed_squared.sqrt();
        let travel_m = nearest_m - half_chord;
        (0.0..=length_m).contains(&(arm_along + speed_along * travel_m)).then_some(travel_m)
    }

    /// Returns the travel to the sphere around a corner, m.
    fn corner_travel(&self, corner: &Point3<f64>) -> Option<f64> {
        let arm = self.start - corner;
        let nearest_m = -arm.dot(&self.direction);
        let miss_squared = (arm + self.direction.scale(nearest_m)).norm_squared();
        Some(nearest_m - self.half_chord(miss_squared)?)
    }

    fn half_chord(&self, miss_squared: f64) -> Option<f64> {
        let squared = self.radius_m * self.radius_m - miss_squared;
        (squared >= 0.0).then(|| squared.sqrt())
    }
}
