//! The oracle, which chooses touches by the ground truth: it shows how much any planner could gain.
//!
//! Only the ground truth of a simulation makes one. A planner is given the belief alone.

use crate::experiment::measure::shape::TrueShape;
use crate::experiment::statistics::mean;
use crate::experiment::trial::entrant::ORACLE;
use crate::experiment::truth::Truth;
use crate::sim::Environment;
use crate::sim::probe::exact;
use palpate_explore::around::ImplicitSurface;
use palpate_explore::around::surface::steepness;
use palpate_explore::belief::Belief;
use palpate_explore::planner::candidates::{Candidates, free_aim};
use palpate_explore::planner::sample::any_side;
use palpate_explore::planner::search::Search;
use palpate_explore::planner::{Plan, PlanError, Planner, PlannerFactory, PlanningSettings};
use palpate_explore::task::{Aim, Target};
use palpate_geometry::spread::Spot;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// The ground truth that the beliefs of a trial are compared with, and that the oracle sees.
pub(in crate::experiment) struct GroundTruth {
    /// The scene, with the object's mesh.
    pub(in crate::experiment) environment: Arc<Environment>,
    /// True heights over a zone.
    pub(in crate::experiment) truth: Truth,
    /// The true surface of a whole object; none in a zone.
    pub(in crate::experiment) shape: Option<TrueShape>,
}

/// Points of the true surface at which the oracle compares.
// heuristic: its choice is the same with all of them, and takes eight times as long.
const LOOKED_AT: usize = 8;

impl GroundTruth {
    /// The belief with a touch of a rigid finger at `target`, not fitted again.
    fn touched(&self, belief: &Belief, target: &Target) -> Option<Belief> {
        let mut probe = exact(Arc::clone(&self.environment));
        let approach = self.environment.task().approach(target)?;
        let touch = probe.touch(&approach).ok()?;
        let mut after = belief.clone();
        after.observe(target, &approach, (&touch, probe.swept().as_ref()));
        Some(after)
    }

    /// Error of a belief, m: over a zone root mean square; in space the mean of |f| / |∇f| on the
    /// true surface.
    fn error_m(&self, belief: &Belief) -> Option<f64> {
        match belief {
            Belief::HeightField(field) => self.truth.rmse_m(field.surface()?),
            Belief::ImplicitSurface(surface) => {
                let mut field = surface.surface()?.field();
                let spots = self.shape.as_ref()?.samples().iter().step_by(LOOKED_AT);
                let offset_m = |spot: &Spot| {
                    let field = field.at(&spot.point);
                    field.value.abs() / steepness(&field.gradient)
                };
                Some(mean(&spots.map(offset_m).collect::<Vec<f64>>()))
            }
        }
    }
}

/// Makes the oracles of trials with one ground truth.
pub(in crate::experiment) struct OracleFactory(pub(in crate::experiment) Arc<GroundTruth>);

impl PlannerFactory for OracleFactory {
    fn name(&self) -> &str {
        ORACLE
    }

    fn make(&self, settings: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner> {
        Box::new(Oracle { search: Search::new(settings, random), truth: Arc::clone(&self.0) })
    }
}

/// Tries touches on the ground truth and asks for the one after which the belief is nearest to it.
struct Oracle {
    search: Search,
    truth: Arc<GroundTruth>,
}

impl Planner for Oracle {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        Ok(match belief {
            Belief::HeightField(field) => {
                let count = self.search.settings.oracle.candidates;
                let places = self.search.scattered(field.zone(), count);
                let targets = places.into_iter().map(Target::from).collect();
                match self.best(belief, targets) {
                    Some(Target::Place(place)) => self.search.conclude(field, place),
                    _ => self.search.anywhere(field.zone()),
                }
            }
            Belief::ImplicitSurface(surface) => {
                let targets = self.aims(surface).into_iter().map(Target::from).collect();
                match self.best(belief, targets) {
                    Some(target) => Plan::at(target),
                    None => Plan::at(any_side(surface.scope(), &mut self.search.rng)),
                }
            }
        })
    }
}

impl Oracle {
    /// The target after which `belief` is nearest to the truth.
    fn best(&self, belief: &Belief, targets: Vec<Target>) -> Option<Target> {
        let is_refitted = self.search.settings.oracle.refit && belief.height_field().is_some();
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

    /// Random places of the believed surface with a free way, and as many random directions where
    /// there are not enough.
    fn aims(&mut self, surface: &ImplicitSurface) -> Vec<Aim> {
        let tried = self.search.settings.oracle.candidates;
        let rng = &mut self.search.rng;
        let mut aims = Vec::new();
        if let Some(candidates) = Candidates::of(surface, rng) {
            let mut field = candidates.surface().field();
            for _ in 0..tried {
                let at = rng.random_range(0..candidates.all.len());
                let place = (&candidates.all[at].p_w, &candidates.all[at].normal_w);
                aims.extend(free_aim(surface, &mut field, place));
            }
        }
        while aims.len() < tried as usize {
            aims.push(any_side(surface.scope(), rng));
        }
        aims
    }
}
