//! Belief of a whole object about shapes of a library: their mean is the prior mean.

use super::super::evidence::{CameraPose, PriorMean};
use super::super::surface::Part;
use super::ImplicitSurface;
use crate::recognition::{KnownShape, Library, Likeness};
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;
use palpate_gp::likelihood::Likelihood;
use palpate_gp::means::MeanField;
use palpate_gp::{Hyperparameters, MeanModel, Posterior};
use std::sync::Arc;

/// Mean distance of two shapes below which one serves for both.
// heuristic: well below the difference between objects of a kind.
const APART_M: f64 = 5e-4;

/// Largest number of shapes of a mean, and the smallest probability of one; heuristics.
const SHAPES: usize = 6;
const COMPARED: usize = 12;
const UNLIKELY: f64 = 1e-3;

impl ImplicitSurface {
    /// Returns the surface of each shape, with the covariance of `posterior`; none with views.
    pub(super) fn parts(
        &self,
        start: Option<&Hyperparameters>,
        posterior: &Posterior,
    ) -> Vec<Part> {
        if self.shapes.len() < 2 || !self.evidence.seen.is_empty() {
            return Vec::new();
        }
        let part = |shape: &KnownShape| {
            let prior = alone(shape);
            let observations = self.relative_to(&prior, start, CameraPose::Uncertain);
            let at = posterior.hyperparameters().clone();
            let (given, _) = posterior.clone().extended(0, at, &observations)?;
            Some(Part { weight: shape.weight, prior, mean: MeanField::from(&given) })
        };
        self.shapes.iter().filter_map(part).collect()
    }

    /// Fits as [`refit`](Self::refit) about the likeliest of `shapes`, each fitted to the touches.
    /// Their probabilities are those of the Gaussian processes about them with one set of
    /// hyperparameters, that of the likeliest. Without shapes there is no surface.
    ///
    /// # Errors
    /// If the covariance of the touches cannot be factored.
    pub(in crate::whole_object) fn refit_like(
        &mut self,
        shapes: &[KnownShape],
    ) -> Result<(), CovarianceError> {
        self.surface = None;
        self.evidence.register();
        let places = self.settings.free_space_samples;
        let mut distinct: Vec<KnownShape> = Vec::new();
        for shape in self.evidence.fitted(shapes, &self.scope.ball, places) {
            let is_same = |other: &KnownShape| {
                Arc::ptr_eq(&shape.object, &other.object) && shape.apart_m(other) < APART_M
            };
            if !distinct.iter().any(is_same) {
                distinct.push(shape);
            }
        }
        let Some(any) = distinct.first() else { return Ok(()) };
        let start = self.fit.as_ref().map(|fit| fit.hyperparameters.clone());
        // The last hyperparameters tell the shape to fit them about.
        let last = match &start {
            Some(start) => start.clone(),
            None => self.search_about(any.clone(), None)?.hyperparameters,
        };
        let compared = likeliest(self.weighed(distinct, &last, start.as_ref())?, COMPARED);
        let Some(best) = compared.first().cloned() else { return Ok(()) };
        let fit = self.search_about(best, start.as_ref())?;
        let weighed = self.weighed(compared, &fit.hyperparameters, start.as_ref())?;
        self.shapes = likeliest(weighed, SHAPES);
        self.condition_from(start, &fit)
    }

    /// Searches the hyperparameters about one shape.
    fn search_about(
        &mut self,
        shape: KnownShape,
        start: Option<&Hyperparameters>,
    ) -> Result<Fit, CovarianceError> {
        self.shapes = vec![shape.weighted(1.0)];
        let (_, observations) = self.observations_given(start, CameraPose::Uncertain);
        self.search(start, &observations)
    }

    /// Returns the shapes that it is about, and what else [`condition_like`](Self::condition_like)
    /// needs.
    pub(in crate::whole_object) fn likeness(&self) -> Likeness {
        let shapes = self.shapes.iter().map(KnownShape::stored).collect();
        Likeness { noise_m: self.start.as_ref().map(|start| start.noise_sd), shapes }
    }

    /// Conditions on all touches with the given fit, about shapes of `library`, e.g. to draw a
    /// recorded belief.
    ///
    /// # Errors
    /// If the covariance of the touches cannot be factored.
    pub fn condition_like(
        &mut self,
        likeness: &Likeness,
        library: &Library,
        fit: &Fit,
    ) -> Result<(), CovarianceError> {
        let shapes = likeness.shapes.iter();
        self.shapes = shapes.filter_map(|shape| shape.restored(library)).collect();
        let start = likeness
            .noise_m
            .map(|noise_sd| Hyperparameters { noise_sd, ..fit.hyperparameters.clone() });
        self.condition_from(start, fit)
    }

    /// Returns `shapes` with their probabilities: the likelihoods of the Gaussian processes about
    /// them with the same hyperparameters, times their priors.
    ///
    /// # Errors
    /// If the covariance of the touches cannot be factored.
    fn weighed(
        &self,
        shapes: Vec<KnownShape>,
        at: &Hyperparameters,
        start: Option<&Hyperparameters>,
    ) -> Result<Vec<KnownShape>, CovarianceError> {
        let mut first: Option<Posterior> = None;
        let mut logs = Vec::with_capacity(shapes.len());
        for shape in &shapes {
            let observations = self.relative_to(&alone(shape), start, CameraPose::Uncertain);
            // Only heights and slopes differ.
            let known = first.clone().and_then(|it| it.extended(0, at.clone(), &observations));
            let log = match known {
                Some((_, log)) => log,
                None => {
                    let mut likelihood =
                        Likelihood::new(self.kernel, MeanModel::Zero, &observations);
                    let log = likelihood.value_gradient(at, &mut [])?;
                    first = Some(likelihood.posterior(at.clone()));
                    log
                }
            };
            logs.push(log + shape.log_prior());
        }
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weighed = shapes.into_iter().zip(logs);
        Ok(weighed.map(|(shape, log)| shape.weighted((log - most).exp())).collect())
    }
}

/// Returns a shape as the prior mean.
fn alone(shape: &KnownShape) -> PriorMean {
    PriorMean::Shapes(vec![shape.clone().weighted(1.0)])
}

/// Returns at most `most` of the likeliest shapes, in order.
fn likeliest(mut shapes: Vec<KnownShape>, most: usize) -> Vec<KnownShape> {
    shapes.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    shapes.truncate(most);
    let least = shapes.first().map_or(0.0, |likeliest| UNLIKELY * likeliest.weight);
    shapes.retain(|shape| shape.weight >= least);
    let sum: f64 = shapes.iter().map(|shape| shape.weight).sum();
    shapes
        .into_iter()
        .map(|shape| {
            let weight = shape.weight / sum;
            shape.weighted(weight)
        })
        .collect()
}
