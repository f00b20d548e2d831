//! Parts of which generators build objects: fields of the frame of an object, metres.

#![allow(dead_code)]

use nalgebra::{Point3, Vector3, point, vector};
use palpate::geometry::implicit::Field;

/// Radius of rounded edges, metres.
pub const EDGE_M: f64 = 0.003;

/// Returns a ball.
pub fn ball(p: Point3<f64>, at: Point3<f64>, radius_m: f64) -> Field {
    ellipsoid(p, at, [radius_m; 3])
}

/// Returns an ellipsoid.
pub fn ellipsoid(p: Point3<f64>, at: Point3<f64>, radii_m: [f64; 3]) -> Field {
    Field::ellipsoid(p - at, radii_m.into())
}

/// Returns a rod with round ends.
pub fn rod(p: Point3<f64>, a: Point3<f64>, b: Point3<f64>, radius_m: f64) -> Field {
    Field::round_cone(p, [a, b], [radius_m, radius_m])
}

/// Returns the half-space on the other side of `outward`.
pub fn half_space(p: Point3<f64>, at: Point3<f64>, outward: Vector3<f64>) -> Field {
    Field::plane(p, at, outward.normalize())
}

/// Returns a box with rounded edges.
pub fn cuboid(p: Point3<f64>, at: Point3<f64>, half_m: [f64; 3]) -> Field {
    let sides = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().zip(half_m);
    let planes = sides.flat_map(|(axis, half_m)| {
        [axis, -axis].map(|outward| Field::plane(p, at + outward * half_m, outward))
    });
    planes.reduce(|a, b| a.intersection(b, EDGE_M)).unwrap_or(Field::plane(p, at, Vector3::y()))
}

/// Returns an upright cylinder between two heights.
pub fn cylinder(p: Point3<f64>, radius_m: f64, [low_m, high_m]: [f64; 2]) -> Field {
    let side = Field::ellipsoid(p.coords, vector![radius_m, radius_m, f64::INFINITY]);
    let top = Field::plane(p, point![0.0, 0.0, high_m], Vector3::z());
    let bottom = Field::plane(p, point![0.0, 0.0, low_m], -Vector3::z());
    side.intersection(top, EDGE_M).intersection(bottom, EDGE_M)
}

/// Returns a disc that faces +y.
pub fn disc(p: Point3<f64>, at: Point3<f64>, radius_m: f64, half_depth_m: f64) -> Field {
    let side = Field::ellipsoid(p - at, vector![radius_m, f64::INFINITY, radius_m]);
    let [front, back] = [Vector3::y(), -Vector3::y()]
        .map(|outward| Field::plane(p, at + outward * half_depth_m, outward));
    side.intersection(front, EDGE_M).intersection(back, EDGE_M)
}

/// Returns the union of `all`.
pub fn together(all: impl IntoIterator<Item = Field>, blend_m: f64) -> Field {
    let far = Field { value: f64::MAX, gradient: Vector3::zeros() };
    all.into_iter().fold(far, |sum, each| sum.union(each, blend_m))
}

/// Returns `a` without `b`.
pub fn without(a: Field, b: Field) -> Field {
    a.intersection(Field { value: -b.value, gradient: -b.gradient }, EDGE_M)
}
