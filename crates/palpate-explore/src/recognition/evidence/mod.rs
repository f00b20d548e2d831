//! Evidence of touches and views for an object at a pose.

mod likelihood;
mod touch;
mod view;

pub use likelihood::{LogLikelihood, NoiseModel};
pub use touch::{TouchEvidence, before_m, hull};
pub use view::ViewEvidence;

use super::library::LibraryObject;
use likelihood::Residual;
use nalgebra::Isometry3;
use touch::TouchFit;

/// Evidence of one touch or view.
pub enum Evidence {
    /// Contact or miss with the space that the finger swept.
    Touch(TouchEvidence),
    /// Points that a camera has seen.
    View(ViewEvidence),
}

/// Residuals of evidence for an object at a pose.
#[derive(Clone, Debug)]
pub enum EvidenceFit {
    /// Those of a touch.
    Touch(TouchFit),
    /// Distances of the points of a view.
    View(Vec<Residual>),
}

impl Evidence {
    /// Returns the residuals for `object` at the pose `x_wo`.
    pub fn fit(&self, object: &LibraryObject, x_wo: &Isometry3<f64>) -> EvidenceFit {
        match self {
            Self::Touch(touch) => EvidenceFit::Touch(touch.fit(object, x_wo)),
            Self::View(view) => EvidenceFit::View(view.fit(object, x_wo)),
        }
    }

    /// Adds the log-likelihood ratio of its residuals at the temperature `tau_m`.
    pub fn add(&self, fit: &EvidenceFit, noise: &NoiseModel, tau_m: f64, to: &mut LogLikelihood) {
        match (self, fit) {
            (Self::Touch(touch), EvidenceFit::Touch(fit)) => touch.add(fit, noise, tau_m, to),
            (Self::View(view), EvidenceFit::View(fit)) => view.add(fit, noise, tau_m, to),
            (Self::Touch(_), EvidenceFit::View(_)) | (Self::View(_), EvidenceFit::Touch(_)) => {
                debug_assert!(false, "residuals of other evidence");
            }
        }
    }
}
