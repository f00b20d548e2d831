//! Distances between convex bodies, in closed form: capsule to capsule, box and half-space.

use super::primitives::nearest_on_segment;
use super::sweep::Capsule;
use nalgebra::{Isometry3, Point3, Translation3, UnitVector3, Vector3};

/// A box with arbitrary orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// Pose of its centre in `W`.
    pub x_wb: Isometry3<f64>,
    /// Half of its sides, in metres.
    pub half_m: Vector3<f64>,
}

impl OrientedBox {
    /// Returns the box along the axes of `W` with these smallest and largest coordinates.
    pub fn from_corners((low, high): (Point3<f64>, Point3<f64>)) -> Self {
        let middle = Translation3::from(nalgebra::center(&low, &high).coords);
        Self { x_wb: middle.into(), half_m: (high - low) / 2.0 }
    }
}

/// The half-space behind a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// A point of the plane, in `W`.
    pub p_w: Point3<f64>,
    /// Outward normal of the half-space.
    pub outward_w: UnitVector3<f64>,
}

impl HalfSpace {
    /// Signed distance of a point, m; negative inside.
    pub fn distance_m(&self, p_w: &Point3<f64>) -> f64 {
        self.outward_w.dot(&(p_w - self.p_w))
    }
}

impl Capsule {
    /// Distance to another capsule, m; negative if they overlap: the distance of their axes minus
    /// the radii.
    pub fn to_capsule_m(&self, other: &Self) -> f64 {
        let axes = between_segments_m([&self.p0_w, &self.p1_w], [&other.p0_w, &other.p1_w]);
        axes - self.radius_m - other.radius_m
    }

    /// Distance to a half-space, m; negative if the capsule penetrates it.
    pub fn to_half_space_m(&self, space: &HalfSpace) -> f64 {
        space.distance_m(&self.p0_w).min(space.distance_m(&self.p1_w)) - self.radius_m
    }

    /// Distance to a box, m; negative if they overlap, and never below minus the radius.
    pub fn to_box_m(&self, other: &OrientedBox) -> f64 {
        let ends = [&self.p0_w, &self.p1_w].map(|p| other.x_wb.inverse_transform_point(p).coords);
        to_centred_box_m(&ends, &other.half_m) - self.radius_m
    }
}

/// Returns the smallest of the distances from each end to the other segment and, if it lies within
/// both, the length of the common perpendicular.
fn between_segments_m(a: [&Point3<f64>; 2], b: [&Point3<f64>; 2]) -> f64 {
    let to = |p: &Point3<f64>, [p0, p1]: [&Point3<f64>; 2]| {
        (p - nearest_on_segment(p, p0, p1)).norm_squared()
    };
    let ends = to(a[0], b).min(to(a[1], b)).min(to(b[0], a)).min(to(b[1], a));
    let (u, v, w) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (uu, uv, vv) = (u.norm_squared(), u.dot(&v), v.norm_squared());
    let (uw, vw) = (u.dot(&w), v.dot(&w));
    // Zero or negative by rounding if they are parallel; then the ends determine the distance.
    let square = uu * vv - uv * uv;
    if square > 0.0 {
        let (s, t) = ((uv * vw - vv * uw) / square, (uu * vw - uv * uw) / square);
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            return (w + u * s - v * t).norm_squared().min(ends).sqrt();
        }
    }
    ends.sqrt()
}

/// Returns the distance of a segment from a box about the origin, m: the squared distance of a
/// point moving along the segment is convex, and its derivative is linear between the points where
/// it crosses the plane of a side.
fn to_centred_box_m(ends: &[Vector3<f64>; 2], half_m: &Vector3<f64>) -> f64 {
    let along = ends[1] - ends[0];
    let beyond = |t: f64| (ends[0] + along * t).zip_map(half_m, |p, h| p - p.clamp(-h, h));
    let slope = |t: f64| along.dot(&beyond(t));
    let mut low = (0.0, slope(0.0));
    let mut high = (1.0, slope(1.0));
    if low.1 >= 0.0 || high.1 <= 0.0 {
        return beyond(if low.1 >= 0.0 { 0.0 } else { 1.0 }).norm();
    }
    for axis in 0..3 {
        for side in [-half_m[axis], half_m[axis]] {
            let t = (side - ends[0][axis]) / along[axis];
            if t > low.0 && t < high.0 {
                let here = (t, slope(t));
                if here.1 < 0.0 { low = here } else { high = here }
            }
        }
    }
    let part = -low.1 / (high.1 - low.1);
    beyond(low.0 + (high.0 - low.0) * part).norm()
}
