//! The oracle planner, which selects touches by the ground truth: an upper bound for any planner.
//!
//! Only a simulation's ground truth can create it. Other planners get only the belief.

use crate::metrics::shape::TrueShape;
use crate::metrics::truth::Truth;
use crate::planner_names::ORACLE;
use palpate_explore::belief::Belief;
use palpate_explore::planner::candidates::{Candidates, free_aim};
use palpate_explore::planner::sample::random_target;
use palpate_explore::planner::search::Search;
use palpate_explore::planner::{
    Offer, Plan, PlanError, Planner, PlannerFactory, PlanningSettings, RefinedPlanner,
};
use palpate_explore::task::{Region, Target};
use palpate_explore::whole_object::ImplicitSurface;
use palpate_explore::whole_object::surface::steepness;
use palpate_geometry::low_discrepancy::SurfacePoint;
use palpate_sim::Environment;
use palpate_sim::library::{LoadedLibrary, TrueObject};
use palpate_sim::probe::exact_probe;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Ground truth that beliefs are compared with and that the oracle uses.
pub(crate) struct GroundTruth {
    /// Scene with the object's mesh.
    pub(crate) environment: Arc<Environment>,
    /// True heights over a zone.
    pub(crate) truth: Truth,
    /// True surface of a whole object; `None` for a zone.
    pub(crate) shape: Option<TrueShape>,
    /// Objects of the hypotheses.
    pub(crate) library: Option<Arc<LoadedLibrary>>,
    /// Object of a library that was drawn for the trial.
    pub(crate) object: Option<TrueObject>,
}

/// Step between the points of the true surface at which the oracle computes the error.
// heuristic: all points give the same choice in eight times the time.
const LOOKED_AT: usize = 8;

impl GroundTruth {
    /// Returns `belief` updated with a rigid finger's touch at `target`, without a new fit.
    fn touched(&self, belief: &Belief, target: &Target) -> Option<Belief> {
        let mut probe = exact_probe(Arc::clone(&self.environment));
        let approach = self.environment.task().approach(target)?;
        let outcome = probe.touch(&approach).ok()?;
        let mut after = belief.clone();
        after.observe(target, &outcome);
        Some(after)
    }

    /// Error of a belief, m: the root mean square over a zone; the mean of |f| / |∇f| on the true
    /// surface of a whole object.
    fn error_m(&self, belief: &Belief) -> Option<f64> {
        match belief.implicit_surface() {
            None => self.truth.rmse_m(belief.field()?),
            Some(surface) => {
                let surface = surface.surface()?;
                let spots = self.shape.as_ref()?.samples().iter().step_by(LOOKED_AT);
                let offset_m = |spot: &SurfacePoint| {
                    let field = surface.field(&spot.point);
                    field.value.abs() / steepness(&field.gradient)
                };
                let offsets_m: Vec<f64> = spots.map(offset_m).collect();
                Some(offsets_m.iter().sum::<f64>() / offsets_m.len() as f64)
            }
        }
    }
}

/// Factory of oracle planners, which share one ground truth.
pub(crate) struct OracleFactory(pub(crate) Arc<GroundTruth>);

impl PlannerFactory for OracleFactory {
    fn name(&self) -> &str {
        ORACLE
    }

    fn make(&self, settings: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner> {
        let search = Search::new(settings, random);
        Box::new(RefinedPlanner(Oracle { search, truth: Arc::clone(&self.0) }))
    }
}

/// Planner that simulates touches on the ground truth and selects the one with the smallest error
/// after it.
struct Oracle {
    search: Search,
    truth: Arc<GroundTruth>,
}

impl Planner for Oracle {
    fn plan(&mut self, belief: &Belief, _offer: &Offer) -> Result<Plan, PlanError> {
        let region = belief.region();
        let targets = match (&region, belief.implicit_surface()) {
            (Region::Ball(_), Some(surface)) => self.aims(surface),
            (Region::Ball(_), None) => Vec::new(),
            (Region::Zone(zone), _) => {
                let count = self.search.settings.oracle.candidates;
                let places = self.search.spread_places(zone, count);
                places.into_iter().map(|place| belief.target(place)).collect()
            }
        };
        let best = self.best(belief, targets);
        Ok(match (best, region) {
            (Some(target), Region::Zone(zone)) => match target.place() {
                Some(place) => self.search.plan_at(belief, &zone, place.to_vec()),
                None => Plan::at(target),
            },
            (Some(target), Region::Ball(_)) => Plan::at(target),
            (None, _) => self.search.anywhere(belief),
        })
    }
}

impl Oracle {
    /// Returns the target after which `belief` has the smallest error.
    fn best(&self, belief: &Belief, targets: Vec<Target>) -> Option<Target> {
        let is_refitted = self.search.settings.oracle.refit && belief.region().zone().is_some();
        let errors = targets.into_iter().filter_map(|target| {
            let mut after = self.truth.touched(belief, &target)?;
            match is_refitted {
                true => after.refit().map(|_| ()).ok()?,
                false => after.fit().is_some().then(|| after.condition())?.ok()?,
            }
            Some((self.truth.error_m(&after)?, target))
        });
        errors.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, target)| target)
    }

    /// Returns random places of the estimated surface, and of where it may extend to, with a free
    /// path; random directions fill up the list.
    fn aims(&mut self, surface: &ImplicitSurface) -> Vec<Target> {
        let tried = self.search.settings.oracle.candidates;
        let rng = &mut self.search.rng;
        let mut aims = Vec::new();
        if let Some(candidates) = Candidates::new(surface, rng) {
            for _ in 0..tried {
                let at = rng.random_range(0..candidates.all.len());
                aims.extend(free_aim(surface, &candidates.all[at]).map(Target::from));
            }
        }
        while aims.len() < tried as usize {
            aims.push(random_target(surface, rng));
        }
        aims
    }
}
