//! Analytic surfaces: solids given by a formula instead of by triangles.
//!
//! A solid is a scalar field, in metres: negative inside, positive outside, zero on the surface.
//! Every field here is 1-Lipschitz, |f(p) - f(q)| <= |p - q|, so the distance to the surface is at
//! least |f(p)|; this makes [`ImplicitSolid::ray`] safe. Shapes and blends follow Quilez, "Distance
//! functions" (iquilezles.org/articles/distfunctions), with exact gradients.
//!
//! Only + - * / and square roots are used, so that values have the same bits on every machine. A
//! point that is not finite gives NaN or `None`, never a panic.

use nalgebra::{Point3, Vector3};

/// Shortest step of a ray, m. A heuristic: a ray can miss at most a graze with a chord shorter than
/// this, a ten-thousandth of the 1 mm that touch resolves.
const SHORTEST_STEP_M: f64 = 1e-7;
/// Length of the bracketing interval at which a ray's crossing is accepted, m; a heuristic.
const RAY_TOLERANCE_M: f64 = 1e-12;
/// Field value that counts as zero, m. A heuristic: some ten roundings at 0.1 m.
const ZERO_M: f64 = 1e-15;
/// Largest number of Newton steps. A heuristic: far more than a point near the surface needs.
const NEWTON_STEPS: usize = 50;

/// A solid given by a 1-Lipschitz field, in its own frame, metres.
pub trait ImplicitSolid: Send + Sync {
    /// Returns the field and its gradient at `p`.
    fn field(&self, p: Point3<f64>) -> Field;

    /// Returns the lowest and highest corner of a box that encloses the solid.
    fn bounds(&self) -> [Point3<f64>; 2];

    /// Returns the field at `p`, m: negative inside, positive outside.
    fn value(&self, p: Point3<f64>) -> f64 {
        self.field(p).value
    }

    /// Returns the field's gradient at `p`: it points outwards, and is no longer than one.
    fn gradient(&self, p: Point3<f64>) -> Vector3<f64> {
        self.field(p).gradient
    }

    /// Projects `p` onto the surface by Newton's steps p - f ∇f / |∇f|²; close to the surface this
    /// is the nearest point to second order. Returns `None` if they do not converge.
    fn project(&self, mut p: Point3<f64>) -> Option<Point3<f64>> {
        for _ in 0..NEWTON_STEPS {
            let Field { value, gradient } = self.field(p);
            if value.abs() <= ZERO_M {
                return Some(p);
            }
            p -= gradient * (value / gradient.norm_squared());
        }
        None
    }

    /// Returns the distance from `origin` along `direction` (of any length) to the first crossing
    /// of the surface, from outside or from inside, if it is within `max_m` metres.
    ///
    /// Steps of |f| cannot pass the surface; once one of the shortest length has passed it, the
    /// crossing is found by bisection.
    fn ray(&self, origin: Point3<f64>, direction: Vector3<f64>, max_m: f64) -> Option<f64> {
        let unit = direction.try_normalize(0.0)?;
        let value_at = |distance_m: f64| self.value(origin + unit * distance_m);
        let mut value = value_at(0.0);
        if value == 0.0 && max_m >= 0.0 {
            return Some(0.0);
        }
        let inside = value < 0.0;
        let (mut before, mut reached) = (0.0, 0.0);
        while (value < 0.0) == inside && value != 0.0 {
            before = reached;
            reached = max_m.min(before + value.abs().max(SHORTEST_STEP_M));
            value = value_at(reached);
            // The end of the ray, steps below rounding, or values that are not finite.
            if !(reached > before && reached <= max_m && value.is_finite()) {
                return None;
            }
        }
        while reached - before > RAY_TOLERANCE_M {
            let middle = 0.5 * (before + reached);
            if middle <= before || middle >= reached {
                break;
            }
            let value = value_at(middle);
            if (value < 0.0) == inside && value != 0.0 {
                before = middle;
            } else {
                reached = middle;
            }
        }
        Some(reached)
    }
}

/// A field's value at a point, metres, and its gradient there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Negative inside, positive outside, metres.
    pub value: f64,
    /// Derivative of the value with respect to the point.
    pub gradient: Vector3<f64>,
}

impl std::ops::Add for Field {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, gradient: self.gradient + other.gradient }
    }
}

impl Field {
    /// Half-space below the plane through `on` with the unit normal `normal`.
    pub fn plane(p: Point3<f64>, on: Point3<f64>, normal: Vector3<f64>) -> Self {
        Self { value: normal.dot(&(p - on)), gradient: normal }
    }

    /// Ellipsoid, (|v / r| - 1) min r for the offset v from its centre. An infinite radius makes it
    /// an elliptic cylinder.
    pub fn ellipsoid(offset: Vector3<f64>, radii_m: Vector3<f64>) -> Self {
        let scale_m = radii_m.min();
        let scaled = offset.component_div(&radii_m);
        Self {
            value: (scaled.norm() - 1.0) * scale_m,
            gradient: unit_or_zero(scaled).component_div(&radii_m) * scale_m,
        }
    }

    /// Hull of two balls with these centres and radii, neither in the other: its exact distance.
    ///
    /// It is the union of balls of radius `r_a - s t` at `a + t u`, where u is the unit axis and s
    /// the sine of the half angle; the distance is minimal over t at `t = h - q s / c`, for a point
    /// h along the axis and q beside it.
    pub fn round_cone(
        p: Point3<f64>,
        [a, b]: [Point3<f64>; 2],
        [a_radius_m, b_radius_m]: [f64; 2],
    ) -> Self {
        let axis = b - a;
        let length_m = axis.norm();
        let sine = (a_radius_m - b_radius_m) / length_m;
        let tangent = sine / (1.0 - sine * sine).sqrt();
        let along_m = (p - a).dot(&axis) / length_m;
        let beside_m = (p - a - axis * (along_m / length_m)).norm();
        let fraction = ((along_m - beside_m * tangent) / length_m).clamp(0.0, 1.0);
        let from_axis = p - a - axis * fraction;
        Self {
            value: from_axis.norm() - (a_radius_m + fraction * (b_radius_m - a_radius_m)),
            gradient: unit_or_zero(from_axis),
        }
    }

    /// Returns the solid with a layer of `thickness_m` added (negative: removed).
    pub fn offset(self, thickness_m: f64) -> Self {
        Self { value: self.value - thickness_m, ..self }
    }

    /// Tube around the curve in which two surfaces cross at right angles: √(f² + g²) - r.
    pub fn tube(self, other: Self, radius_m: f64) -> Self {
        let norm = (self.value * self.value + other.value * other.value).sqrt();
        let gradient = self.gradient * self.value + other.gradient * other.value;
        // The gradient is undefined on the curve itself: zero, as at a ball's centre.
        let gradient = if norm == 0.0 { gradient } else { gradient / norm };
        Self { value: norm - radius_m, gradient }
    }

    /// Union of both solids with the edge between them filled: Quilez's cubic smooth minimum,
    /// min(f, g) - k h³ / 6 with h = max(1 - |f - g| / k, 0). Twice continuously differentiable;
    /// the gradient is a weighted mean of the two, which keeps the field 1-Lipschitz.
    pub fn union(self, other: Self, blend_m: f64) -> Self {
        let (near, far) = if self.value < other.value { (self, other) } else { (other, self) };
        let gap = (far.value - near.value) / blend_m;
        let overlap = if gap >= 1.0 { 0.0 } else { 1.0 - gap };
        Self {
            value: near.value - blend_m * overlap * overlap * overlap / 6.0,
            gradient: near.gradient.lerp(&far.gradient, 0.5 * overlap * overlap),
        }
    }

    /// Intersection of both solids, with the edge rounded off as [`Field::union`] fills it. Where
    /// they meet at right angles the smallest radius of the edge is 0.35 `blend_m`.
    pub fn intersection(self, other: Self, blend_m: f64) -> Self {
        self.complement().union(other.complement(), blend_m).complement()
    }

    fn complement(self) -> Self {
        Self { value: -self.value, gradient: -self.gradient }
    }
}

/// Returns v / |v|; zero for the zero vector, where a ball's distance has no gradient.
fn unit_or_zero(v: Vector3<f64>) -> Vector3<f64> {
    let norm = v.norm();
    if norm == 0.0 { v } else { v / norm }
}
