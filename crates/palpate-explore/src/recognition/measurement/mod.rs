//! Measurement of touches and views for an object at a pose.

mod likelihood;
mod touch;
mod view;

pub use likelihood::{LogLikelihood, NoiseModel};
pub use touch::{LEVER_M, TouchMeasurement, before_m, hull};
pub use view::ViewMeasurement;

use super::library::LibraryObject;
use likelihood::Residual;
use nalgebra::{Isometry3, Point3, Vector3};
use touch::TouchFit;

/// Measurement of one touch or view.
pub enum Measurement {
    /// Contact or miss with the space that the finger swept.
    Touch(TouchMeasurement),
    /// Points that a camera has seen.
    View(ViewMeasurement),
}

/// Residuals of evidence for an object at a pose.
#[derive(Clone, Debug)]
pub enum MeasurementFit {
    /// Those of a touch.
    Touch(TouchFit),
    /// Distances of the points of a view.
    View(Vec<Residual>),
}

impl Measurement {
    /// Returns the point that a touch has met, in `W`.
    pub fn contact_w(&self) -> Option<Point3<f64>> {
        Some(self.touched_w()?.0)
    }

    /// Returns the point that a touch has met, in `W`, and its normal, if its sensor has one.
    pub fn touched_w(&self) -> Option<(Point3<f64>, Option<Vector3<f64>>)> {
        match self {
            Self::Touch(touch) => touch.touched_w(),
            Self::View(_) => None,
        }
    }

    /// Returns the residuals for `object` at the pose `x_wo`.
    pub fn fit(&self, object: &LibraryObject, x_wo: &Isometry3<f64>) -> MeasurementFit {
        match self {
            Self::Touch(touch) => MeasurementFit::Touch(touch.fit(object, x_wo)),
            Self::View(view) => MeasurementFit::View(view.fit(object, x_wo)),
        }
    }

    /// Adds the log-likelihood ratio of its residuals at the temperature `tau_m`.
    pub fn add(
        &self,
        fit: &MeasurementFit,
        noise: &NoiseModel,
        tau_m: f64,
        to: &mut LogLikelihood,
    ) {
        match (self, fit) {
            (Self::Touch(touch), MeasurementFit::Touch(fit)) => touch.add(fit, noise, tau_m, to),
            (Self::View(view), MeasurementFit::View(fit)) => view.add(fit, noise, tau_m, to),
            (Self::Touch(_), MeasurementFit::View(_))
            | (Self::View(_), MeasurementFit::Touch(_)) => {
                debug_assert!(false, "residuals of other evidence");
            }
        }
    }
}
