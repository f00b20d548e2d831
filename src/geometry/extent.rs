//! The box that points span.

use nalgebra::Point3;

/// Least and greatest corner of the smallest axis-aligned box around `points`; none of none.
pub fn extent<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>) -> Option<[Point3<f64>; 2]> {
    let grown = |[low, high]: [Point3<f64>; 2], p: &Point3<f64>| [low.inf(p), high.sup(p)];
    points.into_iter().fold(None, |ends, p| Some(grown(ends.unwrap_or([*p; 2]), p)))
}
