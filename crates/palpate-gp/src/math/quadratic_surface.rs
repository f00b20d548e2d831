//! Quadratic surface through some points, by least squares.

use nalgebra::{Matrix6, UnitVector3, Vector2, Vector3, Vector6};

/// The surface z = c · (1, x, y, x², xy, y²) through some points.
pub struct QuadraticSurface {
    coefficients: Vector6<f64>,
    /// Inverse of the normal matrix.
    covariance: Matrix6<f64>,
    middle: Vector2<f64>,
    scale_m: f64,
}

impl QuadraticSurface {
    /// Fits (x, y, z) by least squares; `None` if the points do not determine a surface.
    pub fn fit(points: impl Iterator<Item = [f64; 3]> + Clone) -> Option<Self> {
        let count = points.clone().count() as f64;
        let middle =
            points.clone().map(|[x, y, _]| Vector2::new(x, y)).sum::<Vector2<f64>>() / count;
        let squares = points.clone().map(|[x, y, _]| (Vector2::new(x, y) - middle).norm_squared());
        let scale_m = (squares.sum::<f64>() / count).sqrt();
        let mut fitted =
            Self { coefficients: Vector6::zeros(), covariance: Matrix6::zeros(), middle, scale_m };
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for [x, y, z] in points {
            let row = fitted.terms([x, y]);
            normal += row * row.transpose();
            right += row * z;
        }
        fitted.covariance = normal.try_inverse()?;
        fitted.coefficients = fitted.covariance * right;
        fitted.coefficients.iter().all(|c| c.is_finite()).then_some(fitted)
    }

    fn terms(&self, at_m: [f64; 2]) -> Vector6<f64> {
        let [x, y] = ((Vector2::from(at_m) - self.middle) / self.scale_m).into();
        Vector6::new(1.0, x, y, x * x, x * y, y * y)
    }

    /// Returns the height at (x, y), and its variance in units of a point's.
    pub fn height(&self, at_m: [f64; 2]) -> (f64, f64) {
        let row = self.terms(at_m);
        (row.dot(&self.coefficients), row.dot(&(self.covariance * row)))
    }

    /// Returns (∂z/∂x, ∂z/∂y) at (x, y).
    pub fn slopes(&self, at_m: [f64; 2]) -> [f64; 2] {
        let [x, y] = ((Vector2::from(at_m) - self.middle) / self.scale_m).into();
        let c = &self.coefficients;
        let slope_x = (c[1] + 2.0 * c[3] * x + c[4] * y) / self.scale_m;
        let slope_y = (c[2] + c[4] * x + 2.0 * c[5] * y) / self.scale_m;
        [slope_x, slope_y]
    }

    /// Unit normal at (x, y), towards +z.
    pub fn normal(&self, at_m: [f64; 2]) -> UnitVector3<f64> {
        let [slope_x, slope_y] = self.slopes(at_m);
        UnitVector3::new_normalize(Vector3::new(-slope_x, -slope_y, 1.0))
    }
}
