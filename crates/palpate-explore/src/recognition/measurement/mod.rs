//! Measurement of touches and views for an object at a pose.

mod contacts;
mod likelihood;
mod touch;
mod view;

pub use contacts::{ContactErrors, ContactSet};
pub use likelihood::{LogLikelihood, NoiseModel, log_sum_exp};
pub use touch::{LEVER_M, TouchMeasurement, before_m, hull};
pub use view::ViewMeasurement;

use super::library::PlacedObject;
use likelihood::{PointFit, Residual};
use nalgebra::{Point3, Vector3};
use std::sync::Arc;
use touch::TouchFit;

/// Measurement of one touch or view, or of recorded contacts.
pub enum Measurement {
    /// Recorded contacts.
    Contacts(Arc<ContactSet>),
    /// Contact or miss with the space that the finger swept.
    Touch(TouchMeasurement),
    /// Points that a camera has seen.
    View(ViewMeasurement),
}

/// Residuals of evidence for an object at a pose.
#[derive(Clone, Debug)]
pub enum MeasurementFit {
    /// Those of recorded contacts.
    Contacts(Vec<PointFit>),
    /// Those of a touch.
    Touch(TouchFit),
    /// Distances of the points of a view.
    View(Vec<Residual>),
}

impl Measurement {
    /// Returns the points of contact, in `W`, each with its normal, if its sensor has one; of a
    /// touch the first.
    pub fn touched_w(&self) -> impl Iterator<Item = (Point3<f64>, Option<Vector3<f64>>)> {
        let (contacts, touch) = match self {
            Self::Contacts(contacts) => (Some(contacts.touched_w()), None),
            Self::Touch(touch) => (None, touch.touched_w()),
            Self::View(_) => (None, None),
        };
        contacts.into_iter().flatten().chain(touch)
    }

    /// Returns the residuals for an object at a pose.
    pub fn fit(&self, placed: &PlacedObject) -> MeasurementFit {
        match self {
            Self::Contacts(contacts) => MeasurementFit::Contacts(contacts.fit(placed)),
            Self::Touch(touch) => MeasurementFit::Touch(touch.fit(placed)),
            Self::View(view) => MeasurementFit::View(view.fit(placed)),
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
            (Self::Contacts(contacts), MeasurementFit::Contacts(fit)) => {
                contacts.add(fit, noise, tau_m, to);
            }
            (Self::Touch(touch), MeasurementFit::Touch(fit)) => touch.add(fit, noise, tau_m, to),
            (Self::View(view), MeasurementFit::View(fit)) => view.add(fit, noise, tau_m, to),
            _ => debug_assert!(false, "residuals of other evidence"),
        }
    }
}
