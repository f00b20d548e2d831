//! Ground truth on the test grid of an experiment.
//!
//! A planner cannot access it. This planner, which uses its belief, compiles:
//!
//! ```
//! use palpate_experiment::metrics::truth::Truth;
//! use palpate_explore::belief::Belief;
//! use palpate_explore::planner::{Offer, Plan, PlanError, Planner};
//! use palpate_gp::posterior::Scratch;
//!
//! struct Honest;
//!
//! impl Planner for Honest {
//!     fn plan(&mut self, belief: &Belief, _: &Offer) -> Result<Plan, PlanError> {
//!         let posterior = belief.posterior().ok_or("no fit")?;
//!         Ok(Plan::at(vec![posterior.mean(&[0.0, 0.0], &mut Scratch::default()), 0.0]))
//!     }
//! }
//! ```
//!
//! A planner that also takes the ground truth does not compile (E0050, another signature), and the
//! oracle's data cannot be named outside of `experiment` (E0603, private).
//!
//! ```compile_fail,E0050
//! use palpate_experiment::metrics::truth::Truth;
//! use palpate_explore::belief::Belief;
//! use palpate_explore::planner::{Offer, Plan, PlanError, Planner};
//!
//! struct Cheat;
//!
//! impl Planner for Cheat {
//!     fn plan(&mut self, belief: &Belief, _: &Offer, truth: &Truth) -> Result<Plan, PlanError> {
//!         Ok(Plan::at(vec![truth.rmse_m(belief.field().ok_or("no fit")?).unwrap_or(0.0)]))
//!     }
//! }
//! ```
//!
//! ```compile_fail,E0603
//! use palpate_experiment::trial::oracle::GroundTruth;
//! ```

pub mod scan_truth;

use crate::metrics::{Metrics, coverage, interval_score, nlpd, rmse};
use palpate_explore::belief::{BAND, HeightPredictions, RandomField, SurfaceBelief};
use palpate_explore::task::Zone;
use palpate_geometry::decimate::decimate;
use palpate_geometry::mesh::Mesh;
use palpate_sim::Environment;
use palpate_sim::reach;
use std::sync::Arc;

/// True heights on the test grid of an experiment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Test points.
    pub places: Vec<Vec<f64>>,
    /// True height at each point above the zone's datum; `None` outside the object, and over a hole
    /// of its mesh.
    pub heights_m: Vec<Option<f64>>,
    /// Whether each point lies in the outer tenth of the zone.
    pub is_edge: Vec<bool>,
    /// Whether a touch with a target inside the zone can reach the surface at each point.
    pub is_reachable: Vec<bool>,
    /// Whether points without a height have no surface; otherwise it is unknown.
    pub is_complete: bool,
    /// Surface of a whole object in `W`, for drawing and comparison; `None` for a zone.
    pub mesh: Option<Arc<Mesh>>,
}

/// Maximum triangles of the surface of a whole object that a run stores.
// heuristic: a megabyte of text, and finer than any figure shows.
const TRIANGLES: usize = 20_000;

/// Step between the grid points at which the belief's variance is computed.
// heuristic: the variance costs the square of the number of touches, the mean only that number.
const CALIBRATION_STEP: usize = 4;

impl Truth {
    /// Samples the environment's surface on a grid of `per_side` points along each side of the
    /// zone; reports the name of each step to `tell`.
    pub fn sample(environment: &Environment, per_side: usize, tell: &dyn Fn(&str)) -> Self {
        let Some(zone) = environment.task().zone() else {
            return Self::whole_object(environment.mesh());
        };
        tell("sampling the surface");
        let places = zone.grid(per_side);
        let heights_m: Vec<_> =
            places.iter().map(|place| environment.true_height_m(place)).collect();
        let is_reachable = reach::reachable(environment, &places, &heights_m, tell);
        let is_complete = !places.iter().any(|place| environment.is_hole(place));
        Self { is_complete, ..Self::new(zone, places, heights_m, is_reachable) }
    }

    /// Ground truth where no surface is known: the test points of a zone, if there is one.
    pub fn unknown(zone: Option<&Zone>, per_side: usize) -> Self {
        let Some(zone) = zone else { return Self::default() };
        let places = zone.grid(per_side);
        let count = places.len();
        Self::new(zone, places, vec![None; count], vec![false; count])
    }

    /// Ground truth of a whole object with the surface `mesh`, simplified if it is large; it has no
    /// test points.
    pub fn whole_object(mesh: Option<&Mesh>) -> Self {
        let kept = mesh.map(|mesh| match mesh.triangles().len() > TRIANGLES {
            true => {
                let (vertices, triangles) = decimate(mesh, TRIANGLES);
                Mesh::new(&vertices, &triangles).map_or_else(|_| mesh.clone(), |(mesh, _)| mesh)
            }
            false => mesh.clone(),
        });
        Self { mesh: kept.map(Arc::new), ..Self::default() }
    }

    /// Whether any height is known.
    pub fn is_known(&self) -> bool {
        self.heights_m.iter().any(Option::is_some)
    }

    /// Ground truth from known heights and reachabilities.
    pub fn new(
        zone: &Zone,
        places: Vec<Vec<f64>>,
        heights_m: Vec<Option<f64>>,
        is_reachable: Vec<bool>,
    ) -> Self {
        let is_edge = places.iter().map(|place| zone.is_edge(place)).collect();
        Self { places, heights_m, is_edge, is_reachable, is_complete: false, mesh: None }
    }

    /// Number of test points on the surface.
    pub fn surface_count(&self) -> usize {
        self.heights_m.iter().flatten().count()
    }

    /// Number of reachable test points.
    pub fn reachable_count(&self) -> usize {
        self.is_reachable.iter().filter(|&&is_reachable| is_reachable).count()
    }

    /// Share of the test points on the surface that the finger cannot reach; `None` if it reaches
    /// all or none.
    pub fn unreachable_share(&self) -> Option<f64> {
        let (reached, all) = (self.reachable_count(), self.surface_count());
        (0 < reached && reached < all).then(|| 1.0 - reached as f64 / all as f64)
    }

    /// Lowest and highest surface above the datum; `None` without a surface.
    pub fn span_m(&self) -> Option<[f64; 2]> {
        let heights_m = || self.heights_m.iter().flatten().copied();
        Some([heights_m().reduce(f64::min)?, heights_m().reduce(f64::max)?])
    }

    /// Root mean square error of a belief over the known surface; `None` without one.
    pub fn rmse_m(&self, belief: &dyn RandomField) -> Option<f64> {
        let means = belief.means(&self.places);
        rmse(self.errors(&means).map(|(_, error)| error))
    }

    /// Returns each point on the surface and the error of a belief with these `means`.
    fn errors(&self, means: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        let heights_m = self.heights_m.iter().zip(means).enumerate();
        heights_m.filter_map(|(i, (height_m, mean))| Some((i, (*height_m)? - mean)))
    }

    /// Compares a belief with the ground truth over the known surface; `None` without one, or
    /// before the belief's first fit.
    pub fn compare(&self, belief: &dyn SurfaceBelief) -> Option<Metrics> {
        let field = belief.field().filter(|_| self.surface_count() > 0)?;
        let means = field.means(&self.places);
        let is_calibrated = |i: &usize| i.is_multiple_of(CALIBRATION_STEP);
        let places = self.places.iter().step_by(CALIBRATION_STEP);
        let places: Vec<Vec<f64>> = places.cloned().collect();
        let HeightPredictions { variances, quantiles_m: bands_m } =
            belief.heights(&places, &BAND)?;
        let noise2 = field.noise_sd().powi(2);
        let densities = self.errors(&means).filter(|(i, _)| is_calibrated(i));
        let densities =
            densities.map(|(i, error)| (error, variances[i / CALIBRATION_STEP] + noise2));
        let banded = |holds: &dyn Fn(usize) -> bool| -> Vec<(f64, [f64; 2])> {
            let heights_m = self.heights_m.iter().enumerate().step_by(CALIBRATION_STEP);
            let known = heights_m.zip(&bands_m).filter(|((i, _), _)| holds(*i));
            known
                .filter_map(|((_, height_m), band)| Some(((*height_m)?, [band[0], band[1]])))
                .collect()
        };
        let rmse_where = |holds: &dyn Fn(usize) -> bool| {
            rmse(self.errors(&means).filter(|(i, _)| holds(*i)).map(|(_, error)| error))
        };
        let heights_m = self.heights_m.iter().zip(&means);
        let heights_m = heights_m.filter_map(|(height_m, mean)| Some(((*height_m)?, *mean)));
        Some(Metrics {
            edge_rmse_m: rmse_where(&|i| self.is_edge[i]),
            reachable_rmse_m: rmse_where(&|i| self.is_reachable[i]),
            unreachable_rmse_m: rmse_where(&|i| !self.is_reachable[i]),
            coverage: coverage(banded(&|_| true)),
            reachable_coverage: coverage(banded(&|i| self.is_reachable[i])),
            unreachable_coverage: coverage(banded(&|i| !self.is_reachable[i])),
            interval_score_m: interval_score(banded(&|_| true)),
            nlpd: nlpd(densities),
            ..Metrics::from_heights(heights_m)
        })
    }
}
