//! Belief after some actions: the surface in a zone or a ball, and hypotheses about the object.

mod height_field;
mod mean_grid;
mod over_zone;
mod quantiles;
mod reach;
mod solid;
mod touches;

pub use crate::surface_belief::{
    BelievedSurface, Deviation, HeightPredictions, RandomField, Reduction, SurfaceBelief,
};
pub use height_field::HeightField;
pub use quantiles::BAND;

use super::evidence::Outcome;
use super::gp_settings::GpSettings;
use super::whole_object::settings::PriorShape;
use super::whole_object::{ExplorationSetup, ImplicitSurface, LibrarySurface, SpatialGpSettings};
use crate::recognition::{Library, Likeness, ObjectHypotheses};
use crate::robot::sensor::TipSurface;
use crate::task::{Region, Target, Task};
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;
use palpate_input::error::InputError;
use palpate_input::format;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::ops::Deref;

/// Number of shapes that the surface may be like.
// heuristic: several poses of several objects; most that differ little are merged.
const SHAPES: usize = 32;

/// Belief of one trial: a belief of the surface, whose methods it has, and hypotheses about the
/// object.
///
/// To store a belief use [`to_json`](Self::to_json) and [`from_json`](Self::from_json), which
/// computes the posterior again.
pub struct Belief {
    surface: Box<dyn SurfaceBelief>,
    /// Hypotheses about the object, where the scene has a library.
    hypotheses: Option<ObjectHypotheses>,
}

/// Belief of a surface as it is stored.
#[derive(Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)]
enum StoredBelief {
    HeightField(HeightField),
    ImplicitSurface(ImplicitSurface),
}

impl Belief {
    /// Creates a belief without data for `task` and a tip with this `surface`.
    pub fn new(
        task: &Task,
        surface: &TipSurface,
        gp: &GpSettings,
        space: &SpatialGpSettings,
    ) -> Self {
        match task.region() {
            Region::Zone(zone) => {
                HeightField::new(zone.clone(), gp.clone()).with_finger(task.finger().clone()).into()
            }
            Region::Ball(ball) => {
                let scope = ExplorationSetup::new(*ball, task, surface);
                let surface = ImplicitSurface::new(scope, space.clone());
                match space.prior {
                    PriorShape::Library => LibrarySurface::new(surface).into(),
                    _ => surface.into(),
                }
            }
        }
    }

    /// Adds what an action at `target` has shown; the belief of the surface changes at the next
    /// [`refit`](SurfaceBelief::refit).
    pub fn observe(&mut self, target: &Target, outcome: &Outcome) {
        if let Some(hypotheses) = &mut self.hypotheses {
            hypotheses.observe(outcome);
        }
        self.surface.observe(target, outcome);
    }

    /// Fits the surface; see [`SurfaceBelief::refit`].
    ///
    /// # Errors
    /// If the covariance of the evidence cannot be factored.
    pub fn refit(&mut self) -> Result<(), CovarianceError> {
        if let Some(hypotheses) = self.hypotheses.as_ref().filter(|_| self.has_library_prior()) {
            self.surface.resemble(hypotheses.shapes(SHAPES));
        }
        self.surface.refit()
    }

    /// Whether shapes of the library are the prior of the surface.
    fn has_library_prior(&self) -> bool {
        (&*self.surface as &dyn Any).is::<LibrarySurface>()
    }

    /// Conditions the surface on all evidence with the hyperparameters of the last fit.
    ///
    /// # Errors
    /// If the covariance of the evidence cannot be factored.
    pub fn condition(&mut self) -> Result<(), CovarianceError> {
        let Some(fit) = self.fit().cloned() else { return Ok(()) };
        self.surface.condition(Some(&fit), &fit)
    }

    /// Conditions the surface on all evidence with the hyperparameters of `fit`, which started
    /// from `before`, e.g. to draw a recorded belief.
    ///
    /// # Errors
    /// If the covariance of the evidence cannot be factored.
    pub fn condition_on(&mut self, before: Option<&Fit>, fit: &Fit) -> Result<(), CovarianceError> {
        self.surface.condition(before, fit)
    }

    /// Conditions the surface as [`condition_on`](Self::condition_on) does, about the shapes of
    /// `library` that a recorded belief of a whole object was about.
    ///
    /// # Errors
    /// If the covariance of the evidence cannot be factored.
    pub fn condition_like(
        &mut self,
        likeness: &Likeness,
        library: &Library,
        fit: &Fit,
    ) -> Result<(), CovarianceError> {
        match (&mut *self.surface as &mut dyn Any).downcast_mut::<ImplicitSurface>() {
            Some(surface) => surface.condition_like(likeness, library, fit),
            None => self.surface.condition(None, fit),
        }
    }

    /// Returns the evidence, the settings and the last fit as JSON.
    ///
    /// # Errors
    /// If the belief has hypotheses, which depend on all draws of random numbers before, or is not
    /// a height field or an implicit surface.
    pub fn to_json(&self) -> Result<String, InputError> {
        if self.hypotheses.is_some() {
            return Err(InputError::new("a belief with hypotheses about the object is not stored")
                .remedy("store the row of the trial, from which it is made again"));
        }
        let stored = match (self.height_field(), self.implicit_surface()) {
            (Some(field), _) => StoredBelief::HeightField(field.clone()),
            (None, Some(surface)) => StoredBelief::ImplicitSurface(surface.clone()),
            (None, None) => return Err(InputError::new("this kind of belief is not stored")),
        };
        serde_json::to_string(&stored).map_err(|error| InputError::new(format::json(&error)))
    }

    /// Reads a belief from [`to_json`](Self::to_json) and conditions it again: its posterior is
    /// equal to the last bit. Around a whole object it does not know the reach of an arm.
    ///
    /// # Errors
    /// If the text is not that of a belief, or the covariance of the touches cannot be factored.
    pub fn from_json(text: &str) -> Result<Self, InputError> {
        let stored: StoredBelief = serde_json::from_str(text)
            .map_err(|error| InputError::new(format::json(&error)).at("belief"))?;
        let restored = match stored {
            StoredBelief::HeightField(mut field) => field.restore().map(|()| field.into()),
            StoredBelief::ImplicitSurface(mut surface) => {
                surface.restore().map(|()| surface.into())
            }
        };
        restored.map_err(|error: CovarianceError| InputError::new(error.to_string()).at("belief"))
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
    pub fn surface(&self) -> &dyn SurfaceBelief {
        &*self.surface
    }
}

impl Clone for Belief {
    fn clone(&self) -> Self {
        Self { surface: self.surface.boxed(), hypotheses: self.hypotheses.clone() }
    }
}

impl Deref for Belief {
    type Target = dyn SurfaceBelief;

    fn deref(&self) -> &Self::Target {
        &*self.surface
    }
}

impl<B: SurfaceBelief + 'static> From<B> for Belief {
    fn from(surface: B) -> Self {
        Self { surface: Box::new(surface), hypotheses: None }
    }
}

impl dyn SurfaceBelief {
    /// Returns the belief over a zone by a Gaussian process, if it is one.
    pub fn height_field(&self) -> Option<&HeightField> {
        (self as &dyn Any).downcast_ref()
    }

    /// Returns the belief of a whole object, if it is one.
    pub fn implicit_surface(&self) -> Option<&ImplicitSurface> {
        let any = self as &dyn Any;
        let like = any.downcast_ref().map(LibrarySurface::favoured);
        like.or_else(|| any.downcast_ref())
    }
}
