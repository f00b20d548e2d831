//! Log-likelihood ratios of residuals with their derivatives by a pose.

use crate::recognition::library::{Nearest, PlacedObject};
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3, Vector6};

/// Length below which a direction is rounding, m.
const ROUNDING_M: f64 = 1e-9;

/// Number of further points of a touch, or of points of a view, that count as independent: their
/// errors are correlated.
// heuristic: a patch has a height, two slopes, and some curvature.
const INDEPENDENT: f64 = 6.0;

/// Returns the factor on the deviations of `count` points that are close to each other.
pub fn inflation(count: usize) -> f64 {
    (count as f64 / INDEPENDENT).max(1.0).sqrt()
}

/// Returns the logarithm of a sum of exponentials; −∞ for an empty one.
pub fn log_sum_exp(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match most.is_finite() {
        true => most + logs.iter().map(|log| (log - most).exp()).sum::<f64>().ln(),
        false => most,
    }
}

/// Noise of the contacts of an object at its true pose.
#[derive(Clone, Copy, Debug)]
pub struct NoiseModel {
    /// Deviation of a contact along the normal, m, on top of its sensor's.
    pub contact_sd_m: f64,
    /// Deviation of a normal about each of two axes, rad.
    pub normal_sd_rad: f64,
    /// Share of contacts that are anywhere.
    pub outliers: f64,
}

/// A distance, m, with its derivative by the pose.
#[derive(Clone, Debug, Default)]
pub struct Residual {
    pub value_m: f64,
    pub slope: Vector6<f64>,
}

impl Residual {
    /// Returns the distance along `n` of the object's point `p_w` from a fixed point. It changes
    /// with the motion of p along n by n·(v + ω × p).
    pub fn along(value_m: f64, n: &Vector3<f64>, p_w: &Point3<f64>, x_wo: &Isometry3<f64>) -> Self {
        let lever = (p_w.coords - x_wo.translation.vector).cross(n);
        Self { value_m, slope: Vector6::new(n.x, n.y, n.z, lever.x, lever.y, lever.z) }
    }

    /// Returns the distance of `p_w` from the surface of an object at a pose, and the nearest
    /// point.
    pub fn of_point(placed: &PlacedObject, p_w: &Point3<f64>) -> (Self, Nearest) {
        let nearest = placed.nearest(p_w);
        let Nearest { q_w, face_w, distance_m } = &nearest;
        // Close to the surface the direction is rounding; the face has it.
        let n = match distance_m.abs() > ROUNDING_M {
            true => (p_w - q_w) / *distance_m,
            false => *face_w,
        };
        (Self::along(*distance_m, &-n, q_w, placed.x_wo), nearest)
    }
}

/// Residuals of a point of contact.
#[derive(Clone, Debug)]
pub struct PointFit {
    pub distance: Residual,
    /// Rotation vector from the object's normal to the measured one, and the object's normal.
    pub turn: Option<(Vector3<f64>, Vector3<f64>)>,
}

/// Sum of log-likelihood ratios with its derivatives by the pose.
pub struct LogLikelihood {
    pub value: f64,
    pub gradient: Vector6<f64>,
    /// Gauss–Newton approximation of minus the second derivative.
    pub information: Matrix6<f64>,
}

impl LogLikelihood {
    /// Creates the sum over nothing.
    pub fn zero() -> Self {
        Self { value: 0.0, gradient: Vector6::zeros(), information: Matrix6::zeros() }
    }

    /// Adds a mixture ratio with the exponent's derivatives.
    pub fn add(&mut self, inlier: f64, outlier: f64, terms: &Terms) {
        let ratio = inlier + outlier;
        let share = inlier / ratio;
        self.value += ratio.ln();
        self.gradient -= terms.gradient * share;
        self.information += terms.information * share;
    }

    /// Adds `weight` times the log-likelihood ratio of a normal that is turned by the rotation
    /// vector `turn` from the object's, over one that is uniform over a hemisphere.
    pub fn add_turn(
        &mut self,
        turn: &Vector3<f64>,
        normal_w: &Vector3<f64>,
        sd_rad: f64,
        weight: f64,
    ) {
        let mut terms = Terms::default();
        terms.add_turn(turn, normal_w, sd_rad);
        self.value -= weight * (terms.half_squares + 2.0 * sd_rad.ln());
        self.gradient -= terms.gradient * weight;
        self.information += terms.information * weight;
    }
}

/// Half of a sum of squares with its derivatives.
#[derive(Default)]
pub struct Terms {
    pub half_squares: f64,
    gradient: Vector6<f64>,
    information: Matrix6<f64>,
}

impl Terms {
    pub fn add(&mut self, residual: &Residual, sd_m: f64) {
        let weight = sd_m.powi(-2);
        self.half_squares += 0.5 * residual.value_m.powi(2) * weight;
        self.gradient += residual.slope * (residual.value_m * weight);
        self.information += residual.slope * residual.slope.transpose() * weight;
    }

    pub fn add_turn(&mut self, turn: &Vector3<f64>, normal_w: &Vector3<f64>, sd_rad: f64) {
        let weight = sd_rad.powi(-2);
        let across = Matrix3::identity() - normal_w * normal_w.transpose();
        self.half_squares += 0.5 * turn.norm_squared() * weight;
        let mut gradient = self.gradient.fixed_rows_mut::<3>(3);
        gradient -= across * turn * weight;
        let mut information = self.information.fixed_view_mut::<3, 3>(3, 3);
        information += across * weight;
    }
}
