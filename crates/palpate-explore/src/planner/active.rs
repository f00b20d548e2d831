//! Planner `active`: touches where the posterior standard deviation is largest (Yi et al. 2016,
//! Algorithm 1). For a whole object, it is the standard deviation of the surface along its normal.

use super::candidates::Candidates;
use super::plan::{Plan, PlannerEntry};
use super::search::Search;
use crate::belief::{Belief, SurfaceBelief};

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "active",
    about: "largest posterior standard deviation, by DIRECT then BFGS (Yi et al. 2016)",
    zone_only: None,
    needs_library: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        Box::new(move |belief: &Belief| Ok(plan(&mut search, belief)))
    },
};

/// Finds the maximum of the variance instead of its root: both have the same maximum, and the
/// gradient of the variance is finite everywhere.
fn plan(search: &mut Search, belief: &Belief) -> Plan {
    match belief.surface() {
        SurfaceBelief::HeightField(field) => match field.planning_posterior() {
            None => search.anywhere(field.zone()),
            Some(known) => {
                search.plan(field, |places, gradients| known.variances(places, gradients))
            }
        },
        SurfaceBelief::ImplicitSurface(surface) => {
            Candidates::plan(surface, &mut search.rng, |candidates| {
                candidates.all.iter().map(|candidate| candidate.offset_m).collect()
            })
        }
    }
}
