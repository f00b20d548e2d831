//! What is believed of an object before its surface is known: a body about what was met.

use super::settings::PriorShape;
use crate::geometry::implicit::Field;
use crate::geometry::primitives::extent;
use crate::task::Ball;
use nalgebra::{Point3, Vector3};

/// The mean of the field over space.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// Centre in `W` and half axes along those of `W`; none for a field of zeros.
    body: Option<(Point3<f64>, Vector3<f64>)>,
}

/// Shortest half axis as a share of the ball's radius, so that touches on one plane leave a body;
/// chosen.
const THINNEST: f64 = 0.1;

/// Half axis of the sphere before two contacts, as a share of the ball's radius; chosen.
const UNKNOWN: f64 = 0.5;

impl Prior {
    /// About `contacts`, in the `ball` about them.
    pub fn about<'a>(
        shape: PriorShape,
        ball: &Ball,
        contacts: impl Iterator<Item = &'a Point3<f64>>,
    ) -> Self {
        let thinnest_m = THINNEST * ball.radius_m;
        let (centre_w, radii_m) = match extent(contacts) {
            Some([low, high]) if low != high => {
                let radii_m = (high - low) / 2.0;
                (nalgebra::center(&low, &high), radii_m.map(|radius_m| radius_m.max(thinnest_m)))
            }
            _ => (ball.centre_w, Vector3::repeat(UNKNOWN * ball.radius_m)),
        };
        let body = match shape {
            PriorShape::Ellipsoid => Some((centre_w, radii_m)),
            PriorShape::Sphere => Some((centre_w, Vector3::repeat(radii_m.product().cbrt()))),
            PriorShape::None => None,
        };
        Self { body }
    }

    /// The field at `p_w`, negative inside, with its gradient: s·(|v / r|² − 1) / 2 for the offset
    /// v from the centre, the half axes r and the least of them s. It is as smooth as any, so that
    /// what a Gaussian process must add to it is no rougher than the object.
    pub fn field(&self, p_w: &Point3<f64>) -> Field {
        let Some((centre_w, radii_m)) = &self.body else {
            return Field { value: 0.0, gradient: Vector3::zeros() };
        };
        let scaled = (p_w - centre_w).component_div(radii_m);
        let least_m = radii_m.min();
        Field {
            value: 0.5 * least_m * (scaled.norm_squared() - 1.0),
            gradient: scaled.component_div(radii_m) * least_m,
        }
    }
}
