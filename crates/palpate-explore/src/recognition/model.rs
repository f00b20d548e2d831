//! Log-posterior of an object's pose, with its second-order approximation.

use super::library::{LibraryObject, PlacedObject};
use super::measurement::{LogLikelihood, Measurement, MeasurementFit, NoiseModel};
use super::pose_prior::PosePrior;
use nalgebra::{Cholesky, Const, Isometry3, Matrix6, Vector6};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Object, prior and data of a posterior.
#[derive(Clone, Copy)]
pub(super) struct Model<'a> {
    pub object: &'a LibraryObject,
    pub prior: &'a PosePrior,
    pub evidence: &'a [Arc<Measurement>],
    pub noise: NoiseModel,
    /// Whether residuals are those of the object's grid.
    pub is_coarse: bool,
}

impl Model<'_> {
    /// Returns the residuals of all evidence at a pose.
    pub fn fits(&self, x_wo: &Isometry3<f64>) -> Vec<MeasurementFit> {
        let placed = self.placed(x_wo);
        self.evidence.iter().map(|touch| touch.fit(&placed)).collect()
    }

    /// Returns the object at a pose.
    pub fn placed<'a>(&'a self, x_wo: &'a Isometry3<f64>) -> PlacedObject<'a> {
        PlacedObject { object: self.object, x_wo, is_coarse: self.is_coarse }
    }

    /// Returns the log-likelihood ratio of all evidence at a pose and a temperature.
    pub fn log_likelihood(&self, fits: &[MeasurementFit], tau_m: f64) -> f64 {
        let mut sum = LogLikelihood::zero();
        let each = self.evidence.iter().zip(fits);
        each.for_each(|(touch, fit)| touch.add(fit, &self.noise, tau_m, &mut sum));
        sum.value
    }

    /// Returns the approximation at a pose with these residuals; the first `known` of the evidence
    /// are at no temperature.
    pub fn quadratic(&self, fits: &[MeasurementFit], known: usize, tau_m: f64) -> Quadratic {
        let mut sum = LogLikelihood::zero();
        for (i, (touch, fit)) in self.evidence.iter().zip(fits).enumerate() {
            let tau_m = if i < known { 0.0 } else { tau_m };
            touch.add(fit, &self.noise, tau_m, &mut sum);
        }
        let free = self.prior.free();
        let is_free = |i: usize, j: usize| if free[i] && free[j] { 1.0 } else { 0.0 };
        let mask = Matrix6::from_fn(is_free);
        let information = sum.information.component_mul(&mask) + self.prior.precision();
        let gradient = sum.gradient.component_mul(&mask.diagonal());
        // The precision of the prior is positive, so that only overflow fails.
        let information =
            Cholesky::new(information).unwrap_or_else(|| Cholesky::pack_dirty(Matrix6::identity()));
        Quadratic { value: sum.value, to_peak: information.solve(&gradient), information }
    }
}

/// Second-order approximation of the log-likelihood ratio about a pose, with the prior's precision.
pub(super) struct Quadratic {
    pub value: f64,
    /// Motion to its peak: a step of Gauss and Newton.
    pub to_peak: Vector6<f64>,
    information: Cholesky<f64, Const<6>>,
}

impl Quadratic {
    /// Returns a motion drawn from the Gaussian with this information, for standard normal numbers.
    pub fn deviation(&self, normals: &Vector6<f64>) -> Vector6<f64> {
        let mut across = *normals;
        // Lᵀ x = z gives the covariance (L Lᵀ)⁻¹.
        self.information.l_dirty().tr_solve_lower_triangular_mut(&mut across);
        across
    }

    /// Logarithm of the Gaussian's density at a motion over `free` directions, with its deviations
    /// times `wider`.
    pub fn log_density(&self, by: &Vector6<f64>, wider: f64, free: f64) -> f64 {
        let scale = self.log_determinant() - free * (wider.ln() + 0.5 * TAU.ln());
        scale - 0.5 * self.distance_squared(by) / (wider * wider)
    }

    /// Square of a motion's length in deviations of the Gaussian.
    pub fn distance_squared(&self, by: &Vector6<f64>) -> f64 {
        self.information.l().tr_mul(by).norm_squared()
    }

    /// Logarithm of the square root of the information's determinant.
    pub fn log_determinant(&self) -> f64 {
        self.information.l_dirty().diagonal().iter().map(|x| x.ln()).sum()
    }
}
