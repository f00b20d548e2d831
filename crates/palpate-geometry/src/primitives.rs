//! Exact queries in f64 for points and single triangles: bounding box, area, line intersection,
//! nearest point.

use nalgebra::{Point3, UnitVector3, Vector3};

/// Returns the lowest and highest corner of the smallest axis-aligned box around `points`; `None`
/// for no points.
pub fn extent<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>) -> Option<[Point3<f64>; 2]> {
    let grown = |[low, high]: [Point3<f64>; 2], p: &Point3<f64>| [low.inf(p), high.sup(p)];
    points.into_iter().fold(None, |ends, p| Some(grown(ends.unwrap_or([*p; 2]), p)))
}

/// Largest ratio of height to longest side at which a triangle is degenerate.
const MIN_ASPECT: f64 = 1e-12;

/// Returns the area vector of a triangle times two, in m²; it follows the right-hand rule.
pub(super) fn doubled_area([a, b, c]: [Point3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// Returns an upper bound of the rounding of coordinates as large as those of `points`, in metres.
pub(super) fn rounding_m(points: &[Point3<f64>]) -> f64 {
    4.0 * f64::EPSILON * points.iter().map(|point| point.coords.amax()).fold(0.0, f64::max)
}

/// Whether a triangle has no area: its height is negligible relative to its longest side, or to the
/// rounding of its coordinates.
pub(super) fn is_degenerate([a, b, c]: [Point3<f64>; 3], rounding_m: f64) -> bool {
    let longest_m = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let twice_area_m2 = doubled_area([a, b, c]).norm();
    twice_area_m2 <= longest_m * rounding_m.max(MIN_ASPECT * longest_m)
}

/// A line prepared for watertight triangle tests.
///
/// The triangle is sheared so that the line becomes the z axis, then tested in the plane
/// (Woop, Benthin, Wald: *Watertight Ray/Triangle Intersection*, JCGT 2013). Two triangles that
/// share an edge compute exactly opposite edge functions, rounding keeps their signs right, and
/// zero counts as inside: a line through an edge or a vertex always meets a triangle there.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Axis along which the direction is longest.
    z: usize,
    shear: [f64; 3],
}

impl Line {
    /// Creates a line along `direction`.
    pub fn along(direction: &UnitVector3<f64>) -> Self {
        let z = direction.iamax();
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let shear = [direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]];
        Self { z, shear }
    }

    /// Returns the signed distance from `origin` along the line to the triangle, in metres; `None`
    /// if the line misses it or lies in its plane.
    #[inline]
    pub fn distance_m(&self, origin: &Point3<f64>, triangle: &[Point3<f64>; 3]) -> Option<f64> {
        // With constant axes, coordinates stay in registers.
        match self.z {
            0 => self.along_m::<0>(origin, triangle),
            1 => self.along_m::<1>(origin, triangle),
            _ => self.along_m::<2>(origin, triangle),
        }
    }

    #[inline(always)]
    fn along_m<const Z: usize>(
        &self,
        origin: &Point3<f64>,
        triangle: &[Point3<f64>; 3],
    ) -> Option<f64> {
        let (x, y, z) = ((Z + 1) % 3, (Z + 2) % 3, Z);
        let [sx, sy, sz] = self.shear;
        let [a, b, c] = triangle.map(|corner| {
            let arm = corner - origin;
            (arm[x] - sx * arm[z], arm[y] - sy * arm[z], arm[z])
        });
        let u = c.0 * b.1 - c.1 * b.0;
        let v = a.0 * c.1 - a.1 * c.0;
        let w = b.0 * a.1 - b.1 * a.0;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        (sum != 0.0).then(|| sz * (u / sum * a.2 + v / sum * b.2 + w / sum * c.2))
    }
}

/// Returns the unit normal of a triangle, towards the side from which its corners run
/// counter-clockwise.
pub fn normal(triangle: &[Point3<f64>; 3]) -> Vector3<f64> {
    let [a, b, c] = triangle;
    (b - a).cross(&(c - a)).normalize()
}

/// Returns the point of segment `a`–`b` nearest to `p`.
#[inline]
pub fn nearest_on_segment(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> Point3<f64> {
    let along = b - a;
    a + along * fraction((p - a).dot(&along), along.norm_squared())
}

/// Returns the point of a triangle nearest to `p`.
#[inline]
pub fn nearest_on_triangle(p: &Point3<f64>, triangle: &[Point3<f64>; 3]) -> Point3<f64> {
    let [a, b, c] = triangle;
    // The borders are tried even if the foot of the perpendicular lies inside, because in a
    // sliver rounding can misplace the foot by more than the sliver's width.
    let candidates = [
        nearest_on_segment(p, a, b),
        nearest_on_segment(p, b, c),
        nearest_on_segment(p, c, a),
        perpendicular_foot(p, triangle).unwrap_or(*a),
    ];
    nearest_of(candidates, |q| (q - p).norm_squared())
}

/// Returns the foot of the perpendicular from `p` onto the triangle, if it lies inside.
#[inline]
fn perpendicular_foot(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> Option<Point3<f64>> {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let normal = ab.cross(&ac);
    let beta = ap.cross(&ac).dot(&normal) / normal.norm_squared();
    let gamma = ab.cross(&ap).dot(&normal) / normal.norm_squared();
    (beta >= 0.0 && gamma >= 0.0 && beta + gamma <= 1.0).then(|| a + ab * beta + ac * gamma)
}

/// Returns the nearest points of segment `p`–`q` and segment `a`–`b`, in this order.
pub fn nearest_of_segments(
    [p, q]: [&Point3<f64>; 2],
    [a, b]: [&Point3<f64>; 2],
) -> (Point3<f64>, Point3<f64>) {
    let (along, across, gap) = (q - p, b - a, p - a);
    let (ll, cc, lc) = (along.norm_squared(), across.norm_squared(), along.dot(&across));
    let s = fraction(lc * across.dot(&gap) - cc * along.dot(&gap), ll * cc - lc * lc);
    let on_across = nearest_on_segment(&(p + along * s), a, b);
    // Parallel segments leave s arbitrary, and the clamp of the other parameter may have moved
    // it: one projection back settles both.
    (nearest_on_segment(&on_across, p, q), on_across)
}

/// Returns the nearest points of segment `p`–`q` and a triangle, in this order. If they intersect,
/// both are the intersection.
pub fn nearest_of_segment_and_triangle(
    [p, q]: [&Point3<f64>; 2],
    triangle: &[Point3<f64>; 3],
) -> (Point3<f64>, Point3<f64>) {
    if let Some(point) = crossing([p, q], triangle) {
        return (point, point);
    }
    let [a, b, c] = triangle;
    let candidates = [
        (*p, nearest_on_triangle(p, triangle)),
        (*q, nearest_on_triangle(q, triangle)),
        nearest_of_segments([p, q], [a, b]),
        nearest_of_segments([p, q], [b, c]),
        nearest_of_segments([p, q], [c, a]),
    ];
    nearest_of(candidates, |(on_segment, on_triangle)| (on_segment - on_triangle).norm_squared())
}

fn crossing([p, q]: [&Point3<f64>; 2], triangle: &[Point3<f64>; 3]) -> Option<Point3<f64>> {
    let (direction, length_m) = UnitVector3::try_new_and_get(q - p, 0.0)?;
    let distance_m = Line::along(&direction).distance_m(p, triangle)?;
    (0.0..=length_m).contains(&distance_m).then(|| p + direction.scale(distance_m))
}

fn nearest_of<T: Copy, const N: usize>(candidates: [T; N], distance: impl Fn(&T) -> f64) -> T {
    let mut best = (distance(&candidates[0]), candidates[0]);
    for candidate in &candidates[1..] {
        let here = distance(candidate);
        if here < best.0 {
            best = (here, *candidate);
        }
    }
    best.1
}

/// Returns `part / whole` clamped to 0..=1, and 0 if the whole is zero.
fn fraction(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 0.0 }
}
