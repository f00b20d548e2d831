//! The trait of beliefs about a surface.

mod error_bound;
mod random_field;

pub use random_field::{RandomField, Reduction};

use self::error_bound::{BOUNDED_AT, correlations, rms_quantile};
use crate::evidence::Outcome;
use crate::recognition::{KnownShape, Likeness};
use crate::surface_evidence::Silhouette;
use crate::task::zone::grid_triangles;
use crate::task::{Region, Target, Zone};
use crate::view::{LookOffer, RigidError};
use nalgebra::Point3;
use palpate_geometry::solids::Triangles;
use palpate_gp::Posterior;
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;
use palpate_gp::math::normal;
use palpate_gp::reduction::VarianceReduction;
use std::any::Any;

/// A belief about the surface in a region, from the outcomes of actions.
///
/// Points of its domain are places (x) or (x, z) of a zone, or points of `W` around a whole object.
/// A planner asks a belief, and the [region](Self::region) only where it samples targets.
pub trait SurfaceBelief: Any + Send + Sync {
    /// Region that is explored.
    fn region(&self) -> Region;

    /// Adds what an action at `target` has shown; the belief changes at the next
    /// [`refit`](Self::refit).
    fn observe(&mut self, target: &Target, outcome: &Outcome);

    /// Sets shapes that the object may be like; by default nothing, for a belief without a
    /// library.
    fn resemble(&mut self, _shapes: Vec<KnownShape>) {}

    /// Returns the shapes that it is about; `None` for a belief without a library.
    fn likeness(&self) -> Option<Likeness> {
        None
    }

    /// Fits the hyperparameters by maximum likelihood and conditions on all evidence.
    ///
    /// # Errors
    /// If the covariance of the evidence cannot be factored.
    fn refit(&mut self) -> Result<(), CovarianceError>;

    /// Conditions on all evidence with the hyperparameters of `fit`, which started from `before`;
    /// by default as [`refit`](Self::refit), for a belief without hyperparameters.
    ///
    /// # Errors
    /// If the covariance of the evidence cannot be factored.
    fn condition(&mut self, _before: Option<&Fit>, _fit: &Fit) -> Result<(), CovarianceError> {
        self.refit()
    }

    /// Hyperparameters of the last [`refit`](Self::refit) or [`condition`](Self::condition), if it
    /// has any.
    fn fit(&self) -> Option<&Fit> {
        None
    }

    /// Targets of all touches so far.
    fn targets(&self) -> Vec<Target>;

    /// Copies the belief.
    fn boxed(&self) -> Box<dyn SurfaceBelief>;

    /// Means and variances, after the first fit: heights over places of a zone, or a field over
    /// points of `W` whose zero set is the surface, negative inside.
    fn field(&self) -> Option<&dyn RandomField>;

    /// Field whose variance is what a touch can still reduce: that of [`field`](Self::field),
    /// conditioned also on targets without a contact. Its means are meaningless.
    fn explorable(&self) -> Option<&dyn RandomField> {
        self.field()
    }

    /// Variances of the surface's position along the heights, or along its normal at `points` on
    /// it, that a touch can still reduce; NaN before the first fit. Writes the gradients into
    /// `gradients` unless that is empty.
    fn surface_variances(&self, points: &[Vec<f64>], gradients: &mut [Vec<f64>]) -> Vec<f64> {
        match self.explorable() {
            Some(field) => field.variances(points, gradients),
            None => vec![f64::NAN; points.len()],
        }
    }

    /// Returns about `count` points spread over the believed surface: by default, on a grid over a
    /// zone. `None` before the first fit.
    fn references(&self, count: usize) -> Option<Vec<Vec<f64>>> {
        let (Region::Zone(zone), Some(_)) = (self.region(), self.field()) else { return None };
        let per_side = (count as f64).powf(1.0 / zone.dimension() as f64);
        Some(zone.grid(per_side.round() as usize))
    }

    /// Returns the target that touches the believed surface at a place of a zone.
    fn target(&self, place: Vec<f64>) -> Target {
        place.into()
    }

    /// Returns the places where touches at `places` of a zone are expected to make contact: by
    /// default the same.
    fn expected_contacts(&self, places: &[Vec<f64>]) -> Vec<Vec<f64>> {
        places.to_vec()
    }

    /// Whether the finger can reach a target in the region.
    fn reaches(&self, _target: &Target) -> bool {
        true
    }

    /// Returns the heights at places of a zone: variances, and quantiles with the noise of a touch
    /// at `probabilities` in (0, 1). `None` before the first fit.
    fn heights(&self, places: &[Vec<f64>], probabilities: &[f64]) -> Option<HeightPredictions> {
        let field = self.field()?;
        let (means, variances) = (field.means(places), field.variances(places, &mut []));
        let z: Vec<f64> = probabilities.iter().map(|p| normal::quantile(*p)).collect();
        let noise2 = field.noise_sd().powi(2);
        let quantiles_m = means.iter().zip(&variances).map(|(mean, variance)| {
            let sd_m = (variance + noise2).max(0.0).sqrt();
            z.iter().map(|z| mean + z * sd_m).collect()
        });
        Some(HeightPredictions { quantiles_m: quantiles_m.collect(), variances })
    }

    /// Returns the root mean square error of the heights over a zone, m, that the belief is sure
    /// with `probability` not to exceed where a finger reaches a surface. `None` around a whole
    /// object and before the first fit.
    fn rmse_bound_m(&self, probability: f64) -> Option<f64> {
        let Region::Zone(_) = self.region() else { return None };
        let places = self.references(BOUNDED_AT)?;
        let heights = self.heights(&places, &[0.025, 0.5, 0.975])?;
        let sds_m: Vec<f64> = (heights.quantiles_m.iter())
            .map(|ends_m| {
                let [below_m, above_m] = [ends_m[1] - ends_m[0], ends_m[2] - ends_m[1]];
                (0.5 * (below_m * below_m + above_m * above_m)).sqrt() / normal::BAND_95
            })
            .collect();
        let slices: Vec<&[f64]> = places.iter().map(Vec::as_slice).collect();
        let weights = self.silhouette().probabilities(slices.iter().copied());
        let correlations = match self.posterior() {
            Some(posterior) => {
                let references = VarianceReduction::new(posterior, slices.iter().copied());
                correlations(references.covariances(&slices))
            }
            // Errors in common exceed a bound the most often.
            None => vec![vec![1.0; places.len()]; places.len()],
        };
        Some(rms_quantile(&weights, &sds_m, &correlations, probability))
    }

    /// Returns the distance of `p_w` outside the believed surface, m, with the standard deviation
    /// of a touch, whose contact may state the deviation `sd_m`; by default along the heights of a
    /// zone, and without this statement. `None` before the first fit.
    fn distance_m(&self, p_w: &Point3<f64>, _sd_m: Option<f64>) -> Option<Deviation> {
        let Region::Zone(zone) = self.region() else { return None };
        let Deviation { mean_m, sd_m } = self.predict(&zone.place(p_w).into())?;
        Some(Deviation { mean_m: zone.height_m(p_w) - mean_m, sd_m })
    }

    /// Returns the predicted contact of a touch at `target`: by default its height over a zone.
    /// Around an object it is the distance before the aimed point, 0 with the ball's radius as
    /// deviation without a contact. `None` before the first fit.
    fn predict(&self, target: &Target) -> Option<Deviation> {
        let (field, place) = (self.field()?, target.place()?.to_vec());
        let places = [place];
        let mean_m = *field.means(&places).first()?;
        let variance = field.variances(&places, &mut []).first()? + field.noise_sd().powi(2);
        Some(Deviation { mean_m, sd_m: variance.max(0.0).sqrt() })
    }

    /// Returns the believed surface for drawing, by default over a zone where a surface is likely;
    /// `None` before the first fit, or without a surface.
    fn shape(&self) -> Option<BelievedSurface> {
        let Region::Zone(zone) = self.region() else { return None };
        Some(over_zone(&zone, self.field()?, &self.silhouette()))
    }

    /// Returns the closed boundary, in `W`, of the space where the object may be; `None` if that is
    /// unknown.
    fn possible_solid(&self) -> Option<Triangles> {
        None
    }

    /// Returns the belief after a look, if it shows the believed surface; `None` before the first
    /// fit, if it shows nothing, and for a belief that takes no views.
    fn fantasize(&self, _look: &LookOffer) -> Option<Box<dyn SurfaceBelief>> {
        None
    }

    /// Probability that a surface is present at places of a zone.
    fn silhouette(&self) -> Silhouette {
        Silhouette::everywhere()
    }

    /// Errors of the camera's pose in each view, after a fit.
    fn rigid_errors(&self) -> Vec<RigidError> {
        Vec::new()
    }

    /// Largest jitter added to a covariance, relative to its diagonal.
    fn jitter(&self) -> f64 {
        0.0
    }

    /// Gaussian process of the field, if it is one, after the first fit.
    fn posterior(&self) -> Option<&Posterior> {
        None
    }
}

/// Predicted heights at some places.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightPredictions {
    /// Variances without the noise of a touch, m².
    pub variances: Vec<f64>,
    /// Quantiles, m: one row a place, one column a probability.
    pub quantiles_m: Vec<Vec<f64>>,
}

/// A predicted length with its standard deviation, noise included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Mean, m.
    pub mean_m: f64,
    /// Standard deviation, m.
    pub sd_m: f64,
}

/// Believed surface for drawing, in `W`.
#[derive(Clone, Debug, Default)]
pub struct BelievedSurface {
    /// Points of the surface.
    pub points_w: Vec<Point3<f64>>,
    /// Standard deviation of the surface at each point, m.
    pub sds_m: Vec<f64>,
    /// Whether a surface is likely at each point.
    pub is_likely: Vec<bool>,
    /// Triangles between the points; none over an interval, whose points are a line.
    pub triangles: Vec<[u32; 3]>,
    /// Points of contact.
    pub contacts_w: Vec<Point3<f64>>,
}

/// Number of places that a look is imagined to show.
// heuristic: a mean over them is within a few percent.
pub(crate) const LOOKED_AT: usize = 100;

/// Points along each side of a zone for drawing.
// heuristic: sufficient for display.
const PER_SIDE: usize = 21;

/// Returns the believed surface over a zone where a surface is likely.
pub(crate) fn over_zone(
    zone: &Zone,
    field: &dyn RandomField,
    silhouette: &Silhouette,
) -> BelievedSurface {
    let places = zone.grid(PER_SIDE);
    let is_likely = silhouette.is_likely(places.iter().map(Vec::as_slice));
    let variances = field.variances(&places, &mut []);
    let means = field.means(&places);
    let triangles = match zone.z_m {
        None => Vec::new(),
        Some(_) => grid_triangles(PER_SIDE, PER_SIDE)
            .filter(|corners| corners.iter().all(|&i| is_likely[i]))
            .map(|corners| corners.map(|corner| corner as u32))
            .collect(),
    };
    BelievedSurface {
        points_w: places.iter().zip(means).map(|(place, mean)| zone.point(place, mean)).collect(),
        sds_m: variances.into_iter().map(|variance| variance.max(0.0).sqrt()).collect(),
        is_likely,
        triangles,
        contacts_w: Vec::new(),
    }
}
