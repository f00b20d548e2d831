//! The belief of a height field as a surface belief.

use super::HeightField;
use super::solid::below_heights;
use crate::evidence::{Evidence, Outcome};
use crate::surface_belief::{
    self, BelievedSurface, Deviation, HeightPredictions, LOOKED_AT, RandomField, SurfaceBelief,
};
use crate::surface_evidence::Silhouette;
use crate::task::{Region, Target};
use crate::view::{LookOffer, RigidError, SeenSurface};
use nalgebra::Point3;
use palpate_geometry::solids::Triangles;
use palpate_gp::Posterior;
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;
use palpate_gp::posterior::Scratch;

impl SurfaceBelief for HeightField {
    fn region(&self) -> Region {
        self.zone.clone().into()
    }

    fn observe(&mut self, target: &Target, outcome: &Outcome) {
        self.observe(target, outcome);
    }

    fn refit(&mut self) -> Result<(), CovarianceError> {
        self.refit().map(|_| ())
    }

    fn condition(&mut self, _before: Option<&Fit>, fit: &Fit) -> Result<(), CovarianceError> {
        self.condition(fit)
    }

    fn fit(&self) -> Option<&Fit> {
        self.fit()
    }

    fn targets(&self) -> Vec<Target> {
        self.targets.iter().cloned().map(Target::from).collect()
    }

    fn boxed(&self) -> Box<dyn SurfaceBelief> {
        Box::new(self.clone())
    }

    fn field(&self) -> Option<&dyn RandomField> {
        self.surface().map(|posterior| posterior as &dyn RandomField)
    }

    fn explorable(&self) -> Option<&dyn RandomField> {
        self.planning_posterior().map(|posterior| posterior as &dyn RandomField)
    }

    fn target(&self, place: Vec<f64>) -> Target {
        self.target(place)
    }

    fn expected_contacts(&self, places: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.expected_contacts(places)
    }

    fn heights(&self, places: &[Vec<f64>], probabilities: &[f64]) -> Option<HeightPredictions> {
        let predictions = self.surface()?.predict(places.iter().map(Vec::as_slice));
        let quantiles_m = self.predicted_quantiles_m(places, &predictions, probabilities)?;
        let variances = predictions.iter().map(|prediction| prediction.variance).collect();
        Some(HeightPredictions { variances, quantiles_m })
    }

    fn distance_m(&self, p_w: &Point3<f64>, sd_m: Option<f64>) -> Option<Deviation> {
        let (zone, surface) = (&self.zone, self.surface()?);
        let Deviation { mean_m, sd_m: exact_m } = self.predict(&zone.place(p_w).into())?;
        let noise_sd = surface.hyperparameters().touch_sd();
        let further = self.noise_of(sd_m.unwrap_or(0.0)).powi(2) - 1.0;
        let sd_m = exact_m.hypot(noise_sd * further.max(0.0).sqrt());
        Some(Deviation { mean_m: zone.height_m(p_w) - mean_m, sd_m })
    }

    fn predict(&self, target: &Target) -> Option<Deviation> {
        let (surface, place) = (self.surface()?, target.place()?);
        let mut scratch = Scratch::default();
        let noise_sd = surface.hyperparameters().touch_sd();
        let variance = surface.variance(place, &mut scratch) + noise_sd * noise_sd;
        let mean_m = surface.mean(place, &mut scratch);
        Some(Deviation { mean_m, sd_m: variance.max(0.0).sqrt() })
    }

    fn shape(&self) -> Option<BelievedSurface> {
        let posterior = self.surface()?;
        let shape = surface_belief::over_zone(&self.zone, posterior, &self.silhouette());
        let seen = posterior.observations();
        let point = |(i, &height): (usize, &f64)| {
            self.zone.point(&seen.place(i).collect::<Vec<_>>(), height)
        };
        let contacts_w = seen.heights().iter().enumerate().map(point).collect();
        Some(BelievedSurface { contacts_w, ..shape })
    }

    fn possible_solid(&self) -> Option<Triangles> {
        below_heights(self)
    }

    fn fantasize(&self, look: &LookOffer) -> Option<Box<dyn SurfaceBelief>> {
        let (fit, references) = (self.fit()?, SurfaceBelief::references(self, LOOKED_AT)?);
        let seen = self.imagined(look, &references).filter(|seen| !seen.is_empty())?;
        let mut after = self.clone();
        after.add(&Evidence::from(seen));
        after.condition(fit).ok()?;
        Some(Box::new(after))
    }

    fn silhouette(&self) -> Silhouette {
        self.surface_evidence().silhouette()
    }

    fn rigid_errors(&self) -> Vec<RigidError> {
        self.seen().iter().map(SeenSurface::rigid_error).collect()
    }

    fn jitter(&self) -> f64 {
        self.jitter()
    }

    fn posterior(&self) -> Option<&Posterior> {
        self.surface()
    }
}
