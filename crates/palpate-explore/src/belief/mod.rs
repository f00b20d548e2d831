//! Belief after some touches: a Gaussian process over a zone or in space.

mod height_field;
mod quantiles;
mod reach;
mod touches;

pub use height_field::HeightField;
pub use quantiles::BAND;

use super::evidence::Outcome;
use super::gp_settings::GpSettings;
use super::whole_object::{ExplorationSetup, ImplicitSurface, SpatialGpSettings};
use crate::recognition::ObjectHypotheses;
use crate::robot::Finger;
use crate::task::{Region, Target, Task};
use crate::view::RigidError;
use palpate_gp::Posterior;
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;
use palpate_input::error::InputError;
use palpate_input::format;
use serde::{Deserialize, Serialize};

/// Belief of one trial.
///
/// To store a belief use [`to_json`](Self::to_json) and [`from_json`](Self::from_json), which
/// computes the posterior again; hypotheses are not stored.
#[derive(Clone, Serialize, Deserialize)]
pub struct Belief {
    #[serde(flatten)]
    surface: SurfaceBelief,
    /// Hypotheses about the object, where the scene has a library.
    #[serde(skip)]
    hypotheses: Option<ObjectHypotheses>,
}

/// Belief of a surface. Both variants are large, and few exist at a time.
#[derive(Clone, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)]
pub enum SurfaceBelief {
    /// Heights over a zone.
    HeightField(HeightField),
    /// A closed surface in a ball.
    ImplicitSurface(ImplicitSurface),
}

impl Belief {
    /// Creates a belief without data for `task` and `finger`; the flag marks a soft finger.
    pub fn new(
        task: &Task,
        (finger, is_soft): (&Finger, bool),
        gp: &GpSettings,
        space: &SpatialGpSettings,
    ) -> Self {
        match task.region() {
            Region::Zone(zone) => {
                HeightField::new(zone.clone(), gp.clone()).with_finger(finger.clone()).into()
            }
            Region::Ball(ball) => {
                let scope = ExplorationSetup::new(*ball, task, (finger, is_soft));
                ImplicitSurface::new(scope, space.clone()).into()
            }
        }
    }

    /// Adds what an action at `target` has shown; the belief changes at the next
    /// [`refit`](Self::refit).
    pub fn observe(&mut self, target: &Target, outcome: &Outcome) {
        if let Some(hypotheses) = &mut self.hypotheses {
            hypotheses.observe(outcome);
        }
        match &mut self.surface {
            SurfaceBelief::HeightField(field) => field.observe(target, outcome),
            SurfaceBelief::ImplicitSurface(surface) => surface.observe(target, outcome),
        }
    }

    /// Returns the error of the camera's pose in each view, after a fit.
    pub fn rigid_errors(&self) -> Vec<RigidError> {
        match &self.surface {
            SurfaceBelief::HeightField(field) => field.rigid_errors(),
            SurfaceBelief::ImplicitSurface(surface) => surface.rigid_errors(),
        }
    }

    /// Fits the hyperparameters by maximum likelihood and conditions on all touches.
    ///
    /// # Errors
    /// If the covariance of the touches cannot be factored.
    pub fn refit(&mut self) -> Result<&Fit, CovarianceError> {
        match &mut self.surface {
            SurfaceBelief::HeightField(field) => field.refit().map(|(fit, _)| fit),
            SurfaceBelief::ImplicitSurface(surface) => surface.refit().map(|(fit, _)| fit),
        }
    }

    /// Conditions on all touches with the hyperparameters of the last fit.
    ///
    /// # Errors
    /// If the covariance of the touches cannot be factored.
    pub fn condition(&mut self) -> Result<(), CovarianceError> {
        let Some(fit) = self.fit().cloned() else { return Ok(()) };
        match &mut self.surface {
            SurfaceBelief::HeightField(field) => field.condition(&fit),
            SurfaceBelief::ImplicitSurface(surface) => surface.condition(Some(&fit), &fit),
        }
    }

    /// Returns the touches, the settings and the last fit as JSON.
    ///
    /// # Errors
    /// If memory is exhausted.
    pub fn to_json(&self) -> Result<String, InputError> {
        serde_json::to_string(self).map_err(|error| InputError::new(format::json(&error)))
    }

    /// Reads a belief from [`to_json`](Self::to_json) and conditions it again: its posterior is
    /// equal to the last bit. Around a whole object it does not know the reach of an arm.
    ///
    /// # Errors
    /// If the text is not that of a belief, or the covariance of the touches cannot be factored.
    pub fn from_json(text: &str) -> Result<Self, InputError> {
        let mut belief: Self = serde_json::from_str(text)
            .map_err(|error| InputError::new(format::json(&error)).at("belief"))?;
        let restored = match &mut belief.surface {
            SurfaceBelief::HeightField(field) => field.restore(),
            SurfaceBelief::ImplicitSurface(surface) => surface.restore(),
        };
        restored.map_err(|error| InputError::new(error.to_string()).at("belief"))?;
        Ok(belief)
    }

    /// Returns the result of the last [`refit`](Self::refit).
    pub fn fit(&self) -> Option<&Fit> {
        match &self.surface {
            SurfaceBelief::HeightField(field) => field.fit(),
            SurfaceBelief::ImplicitSurface(surface) => surface.fit(),
        }
    }

    /// The Gaussian process, after the first fit: heights over places of a zone, or a field over
    /// points of `W` whose zero set is the surface.
    pub fn posterior(&self) -> Option<&Posterior> {
        match &self.surface {
            SurfaceBelief::HeightField(field) => field.surface(),
            SurfaceBelief::ImplicitSurface(surface) => Some(surface.surface()?.posterior()),
        }
    }

    /// Largest jitter added to a covariance of this belief, relative to its diagonal.
    pub fn jitter(&self) -> f64 {
        match &self.surface {
            SurfaceBelief::HeightField(field) => field.jitter(),
            SurfaceBelief::ImplicitSurface(_) => self.posterior().map_or(0.0, Posterior::jitter),
        }
    }

    /// All targets so far.
    pub fn targets(&self) -> Vec<Target> {
        match &self.surface {
            SurfaceBelief::HeightField(field) => {
                field.targets().iter().cloned().map(Target::from).collect()
            }
            SurfaceBelief::ImplicitSurface(surface) => {
                surface.aims().iter().copied().map(Target::from).collect()
            }
        }
    }

    /// Adds hypotheses about the object in the region.
    pub fn with_hypotheses(self, hypotheses: Option<ObjectHypotheses>) -> Self {
        Self { hypotheses, ..self }
    }

    /// Returns the hypotheses about the object, where the scene has a library.
    pub fn hypotheses(&self) -> Option<&ObjectHypotheses> {
        self.hypotheses.as_ref()
    }

    /// Returns the belief of the surface.
    pub fn surface(&self) -> &SurfaceBelief {
        &self.surface
    }

    /// Returns the belief over a zone, if it is one.
    pub fn height_field(&self) -> Option<&HeightField> {
        match &self.surface {
            SurfaceBelief::HeightField(field) => Some(field),
            SurfaceBelief::ImplicitSurface(_) => None,
        }
    }

    /// Returns the belief of a whole object, if it is one.
    pub fn implicit_surface(&self) -> Option<&ImplicitSurface> {
        match &self.surface {
            SurfaceBelief::HeightField(_) => None,
            SurfaceBelief::ImplicitSurface(surface) => Some(surface),
        }
    }
}

impl From<HeightField> for Belief {
    fn from(field: HeightField) -> Self {
        Self { surface: SurfaceBelief::HeightField(field), hypotheses: None }
    }
}

impl From<ImplicitSurface> for Belief {
    fn from(surface: ImplicitSurface) -> Self {
        Self { surface: SurfaceBelief::ImplicitSurface(surface), hypotheses: None }
    }
}
